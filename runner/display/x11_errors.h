#pragma once
// Handling of a lost X server, of windows destroyed from outside, and of a killed window manager.

struct GLFWwindow;

namespace palpate::runner::display {

/// Thrown when the connection to the display is lost.
class DisplayLost {};

/// Starts GLFW. Where a window manager was killed, it first removes the property that still names
/// it: GLFW 3.3.8 ends the program when it finds it. \return false: glfwGetError has the reason
bool start_glfw();

/// Replaces Xlib's error handlers, which end the program: from now on a call that meets a lost
/// connection throws DisplayLost, SIGPIPE is ignored, and so are errors of single requests. After
/// DisplayLost the display must not be used again.
void handle_display_errors();

/// Sets `gone` when another program destroys the window while the display lives on. `gone` must
/// outlive the connection.
void flag_when_destroyed(GLFWwindow* window, bool& gone);

/// Whether such a window was destroyed. Ask after its size was queried: GLFW does not check for an
/// error and then returns uninitialised memory.
bool was_destroyed(GLFWwindow* window);

/// Whether the connection is known to be lost; sends nothing and does not wait.
bool connection_lost();

}  // namespace palpate::runner::display
