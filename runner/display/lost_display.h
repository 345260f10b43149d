#pragma once

struct GLFWwindow;

namespace palpate::runner {

/// The display's connection broke.
class LostDisplay {};

/// From now on LostDisplay is thrown out of whatever call meets a broken connection, instead of
/// ending the program (Xlib's way), a broken pipe is an error, not a signal, and what the display
/// refuses is ignored. After LostDisplay nothing may be asked of the display again.
void survive_lost_display();

/// `gone` becomes true when somebody else destroys the window; the display lives on. It must
/// outlive the connection.
void watch_window(GLFWwindow* window, bool& gone);

/// Whether it is, of a window that is watched. After its size was asked for: GLFW does not look
/// whether there was an answer, and gives what lay about in memory.
bool is_gone(GLFWwindow* window);

/// Asks for nothing and waits for nothing: whether the connection is known to be broken.
bool display_lost();

}  // namespace palpate::runner
