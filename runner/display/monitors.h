#pragma once

#include <string>

#include "runner/display/window.h"

struct GLFWmonitor;
struct GLFWwindow;

namespace palpate::runner {

/// Where a window goes, px of the desktop.
struct Place {
  GLFWmonitor* full_screen_on = nullptr;  ///< none: a window with a frame
  int left = 0, top = 0, width = 0, height = 0;
};

struct Places {
  Place participant, console;
  bool shared = false;  ///< both windows can be seen from the participant's chair
  double participant_scale = 1, console_scale = 1;  ///< of letters and buttons
};

/// Each on its monitor; on one and the same, side by side, never one over the other: without a
/// window manager nobody could move them apart.
/// \throws DisplayError for a monitor that is asked for and not connected
Places place_windows(const WindowSettings& settings);

/// A hidden window with an OpenGL 3.3 context, made current. \throws DisplayError
GLFWwindow* make_window(const std::string& title, const Place& place);

/// What GLFW says of its latest failure.
std::string glfw_reason();

}  // namespace palpate::runner
