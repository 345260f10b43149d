#pragma once

#include "runner/display/window.h"

struct GLFWmonitor;
struct GLFWwindow;

namespace palpate {

/// \param number  from 1; 0: `otherwise`, or the first where there are not so many
/// \throws DisplayError for a number that is asked for and not connected
GLFWmonitor* monitor(int number, int otherwise);

/// A hidden window with an OpenGL 3.3 context, centred on the monitor. \throws DisplayError
GLFWwindow* make_window(const std::string& title, GLFWmonitor* on, int width, int height,
                        bool full_screen);

/// What GLFW says of its latest failure.
std::string glfw_reason();

}  // namespace palpate
