#pragma once
// What the experimenter sees and can do, in Dear ImGui.

#include <array>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "runner/display/pointer_hand.h"
#include "runner/display/scene_view.h"
#include "runner/display/window.h"

namespace palpate {

/// A force as it was at a time.
struct ForcePoint {
  double time = 0;   ///< s, session clock
  double force = 0;  ///< N, on the hand, of both devices together
};

/// Of a field, ended by a zero.
using TypedText = std::array<char, 1000>;

/// Held down, whichever window has the keyboard.
struct Modifiers {
  bool ctrl = false, shift = false;
};

class ConsoleView {
 public:
  /// Needs a current OpenGL context.
  explicit ConsoleView(const WindowSettings& settings);

  /// \param now  s, when it came
  void take(ConsoleState state, double now);
  /// One frame; what was asked for in it, without times. \param now  s
  std::vector<ConsoleCommand> draw(double now, const Modifiers& modifiers);

 private:
  void draw_view(const Modifiers& modifiers);
  void draw_side(double now, std::vector<ConsoleCommand>& asked);
  void draw_notes(std::vector<ConsoleCommand>& asked);

  SceneView scene_;
  Camera camera_;
  std::optional<PointerHand> hand_;
  ConsoleState state_;
  double came_ = 0;  ///< s
  bool any_ = false;
  std::deque<ForcePoint> forces_;
  TypedText note_{}, reason_{};
  std::size_t messages_seen_ = 0;
};

}  // namespace palpate
