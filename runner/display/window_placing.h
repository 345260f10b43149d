#pragma once

#include <optional>

#include "runner/display/window_layout.h"

namespace palpate::runner::display {

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
