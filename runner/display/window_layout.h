#pragma once
// The places of the two windows: planned before they open, and kept while they are moved.

#include <optional>
#include <string>

#include "runner/display/window.h"
#include "runner/display/window_places.h"

struct GLFWmonitor;
struct GLFWwindow;

namespace palpate::runner::display {

/// The planned place of a window, without its frame.
struct WindowGeometry {
  GLFWmonitor* full_screen_on = nullptr;  ///< nullptr: a window with a frame
  ScreenBox box;
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

/// Space for the participant's window when it must not cover the console: the rest of the console's
/// monitor. \param console  without its frame \param bar  height of its emergency button, px
ScreenBox room_beside(const ScreenBox& console, int bar, const FrameSize& frame);

/// A window in the middle of the first monitor. \param width, height  px, at scale 1
WindowGeometry lay_out_single(int width, int height, double scale);

/// The scale scales of text and buttons on the first monitor. \param wanted  0: use the monitor's
double single_scale(double wanted);

/// The part of the desktop that all monitors cover together.
ScreenBox desktop();

/// The frame around a window; for a hidden window the future frame, if the window manager reports
/// it.
FrameSize frame_of(GLFWwindow* window);

/// A hidden window with an OpenGL 3.3 context, made current. \throws DisplayError
GLFWwindow* make_window(const std::string& title, const WindowGeometry& geometry);

/// GLFW's description of its latest error.
std::string glfw_reason();

/// Keeps a session's two windows in place: at the requested places, even if the window manager
/// moves them at first, and the participant's never over the console's emergency button. Belongs to
/// the display's thread.
class WindowPlacing {
 public:
  WindowPlacing(GLFWwindow* participant, GLFWwindow* console, const WindowLayout& layout);

  /// Call it between two frames. \param now  s \param bar  px, height of the emergency button
  void step(double now, float bar);
  /// Places to which the experimenter has moved the windows; none: they have not moved.
  std::optional<WindowPlaces> moved_to() const;

 private:
  struct Placed {
    GLFWwindow* window;
    ScreenBox asked;
    ScreenBox now{}, shown{};  ///< shown: after the window manager placed it
    int tries = 0;
  };
  bool look();
  void settle(double now);
  void uncover(double now, int bar);
  void move_away(int bar);
  static void ask_for(Placed& placed);

  Placed participant_, console_;
  bool full_screen_;
  bool settled_ = false, covered_ = false;
  int attempts_ = 0;  ///< failed attempts to move the participant's window away
  double began_ = -1, next_ = 0, moved_at_ = 0, raised_at_ = 0;  ///< s
};

}  // namespace palpate::runner::display
