#pragma once
// Handling of a lost X server and of windows destroyed from outside.

struct GLFWwindow;

namespace palpate::runner::display {

/// Thrown when the connection to the display is lost.
class DisplayLost {};

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
