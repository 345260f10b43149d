#pragma once
// The monitors of the display. GLFW's list is not used: GLFW 3.3.8 ends the program when it is
// asked for the area of a monitor that has just been switched off or moved to another connector.

#include <string>
#include <vector>

#include "runner/display/window_places.h"

namespace palpate::runner::display {

struct Monitor {
  std::string name;  ///< of its connector, "HDMI-1"; unique
  ScreenBox box;     ///< px
  bool operator==(const Monitor&) const = default;
};

/// Those that are switched on: the primary one, then from left to right; at least one. A display
/// without RandR 1.5, or with nothing switched on, is one monitor. Call it in the display's thread,
/// between start_glfw() and glfwTerminate().
std::vector<Monitor> monitors();

/// null: it is not there
const Monitor* monitor_named(const std::vector<Monitor>& all, const std::string& name);
/// The monitor that shows most of the box; null: none shows any of it.
const Monitor* monitor_of(const std::vector<Monitor>& all, const ScreenBox& box);

/// The monitor's area without the desktop's panels.
ScreenBox work_area(const Monitor& monitor);

/// Keeps the display from going dark while no key is pressed, until end().
class LitScreens {
 public:
  explicit LitScreens(bool wanted);
  LitScreens(const LitScreens&) = delete;
  LitScreens& operator=(const LitScreens&) = delete;
  /// Restores what was set before.
  void end();

 private:
  bool on_ = false;
  int timeout_ = 0, interval_ = 0, blanking_ = 0, exposures_ = 0;
};

}  // namespace palpate::runner::display
