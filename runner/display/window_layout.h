#pragma once
// The places of the two windows: planned before they open, and kept while they are moved.

#include <optional>
#include <string>

#include "runner/display/monitors.h"
#include "runner/display/window.h"
#include "runner/display/window_places.h"

struct GLFWwindow;

namespace palpate::runner::display {

/// The planned place of a window, without its frame.
struct WindowGeometry {
  bool full_screen = false;  ///< without a frame; the box is its monitor's
  ScreenBox box;
  Monitor monitor;
  int least_width = 0, least_height = 0;  ///< px; limits for the user's resizing
};

struct WindowLayout {
  WindowGeometry participant, console;
  bool shared = false;  ///< both windows are on the participant's monitor
  double participant_scale = 1, console_scale = 1;  ///< of letters and buttons
};

/// Puts each window at its last place if it still fits there, else on its monitor. On a single
/// monitor the participant's window gets the space that the console leaves: no window may cover the
/// emergency button, and without a window manager none can be moved.
/// \throws DisplayError if a requested monitor is not connected
WindowLayout lay_out_windows(const WindowSettings& settings);

/// A window in the middle of the first monitor. \param width, height  px, at scale 1
WindowGeometry lay_out_single(int width, int height, double scale);

/// The scale scales of text and buttons on the first monitor. \param wanted  0: use the monitor's
double single_scale(double wanted);

/// Puts a window that no monitor shows into the middle of the first one: its monitor was switched
/// off.
void bring_into_sight(GLFWwindow* window);

/// A hidden window with an OpenGL 3.3 context, made current. \throws DisplayError
GLFWwindow* make_window(const std::string& title, const WindowGeometry& geometry,
                        bool stereo = false);

/// GLFW's description of its latest error.
std::string glfw_reason();

/// Keeps a session's two windows in place: at the requested places, even if the window manager
/// moves them at first or a monitor is switched off, and the participant's never over the console's
/// emergency button. Belongs to the display's thread.
class WindowPlacing {
 public:
  /// \param settings  must outlive it
  WindowPlacing(GLFWwindow* participant, GLFWwindow* console, const WindowSettings& settings,
                const WindowLayout& layout);

  /// Call it between two frames. \param now  s \param bar  px, height of the emergency button
  void step(double now, float bar);
  /// Places to which the experimenter has moved the windows; none: they have not moved.
  std::optional<WindowPlaces> moved_to() const;
  /// False while the window manager has time to show them.
  bool settled() const { return settled_; }
  /// The reason why the participant may not see the right window; empty: all is well.
  const std::string& misplaced() const { return misplaced_; }
  /// Whether one monitor shows both windows.
  bool shared() const { return shared_; }

 private:
  struct Placed {
    GLFWwindow* window;
    ScreenBox asked;
    ScreenBox now{}, shown{};  ///< shown: after the window manager placed it
    int tries = 0;
  };
  bool look();
  bool full_screen() const { return layout_.participant.full_screen; }
  void look_at_monitors(double now);
  void place_again(const WindowLayout& layout, double now);
  bool fills_its_monitor() const;
  void fill_monitor();
  void settle(double now);
  void judge(double now);
  std::string misplacement() const;
  void uncover(double now, int bar);
  void move_away(int bar);
  void bring_back(int bar);
  static void ask_for(Placed& placed);

  const WindowSettings& settings_;
  const WindowLayout first_;  ///< on the monitors at the beginning
  WindowLayout layout_;       ///< on those that are there now
  Placed participant_, console_;
  std::vector<Monitor> monitors_;
  bool settled_ = false, covered_ = false, shared_, put_back_ = false;
  int attempts_ = 0;  ///< failed attempts to move the participant's window away
  double began_ = -1, next_ = 0, moved_at_ = 0, raised_at_ = 0, next_monitors_ = 0;  ///< s
  std::string misplaced_;
};

}  // namespace palpate::runner::display
