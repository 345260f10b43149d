#pragma once

#include <string>

#include "runner/display/window.h"

struct GLFWmonitor;
struct GLFWwindow;

namespace palpate::runner {

/// Position and size of a window, px of the desktop.
struct WindowGeometry {
  GLFWmonitor* full_screen_on = nullptr;  ///< nullptr: a window with a frame
  int left = 0, top = 0, width = 0, height = 0;
};

struct WindowLayout {
  WindowGeometry participant, console;
  bool shared = false;  ///< both windows are on the participant's monitor
  double participant_scale = 1, console_scale = 1;  ///< of letters and buttons
};

/// Each window on its monitor; on a single monitor side by side, because without a window manager
/// overlapping windows could not be moved.
/// \throws DisplayError if a requested monitor is not connected
WindowLayout lay_out_windows(const WindowSettings& settings);

/// A hidden window with an OpenGL 3.3 context, made current. \throws DisplayError
GLFWwindow* make_window(const std::string& title, const WindowGeometry& geometry);

/// GLFW's description of its latest error.
std::string glfw_reason();

}  // namespace palpate::runner
