#pragma once

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

}  // namespace palpate::runner::display
