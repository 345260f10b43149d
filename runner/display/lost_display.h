#pragma once

struct GLFWwindow;

namespace palpate {

/// The display's connection broke, or a window was destroyed by somebody else.
class LostDisplay {};

/// From now on LostDisplay is thrown out of whatever call meets a broken connection or a destroyed
/// window, instead of ending the program (Xlib's way), and a broken pipe is an error, not a signal.
/// After it nothing may be asked of the display again.
void survive_lost_display();

/// Losing this window counts.
void survive_loss_of(GLFWwindow* window);

/// Asks for nothing and waits for nothing: whether the connection is known to be broken.
bool display_lost();

}  // namespace palpate
