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

namespace palpate::runner {

/// A force as it was at a time.
struct ForcePoint {
  double time = 0;   ///< s, session clock
  double force = 0;  ///< N, on the hand, of both devices together
};

/// Of a field, ended by a zero.
using TypedText = std::array<char, 1000>;

/// The end of a session that is being asked for.
struct Ending {
  bool asked = false, seen = false;
  TypedText reason{};  ///< typed so far
};

/// Held down, whichever window has the keyboard.
struct Modifiers {
  bool ctrl = false, shift = false;
};

class ConsoleView {
 public:
  /// Needs a current OpenGL context. \param shared  the participant may see it as well
  ConsoleView(const WindowSettings& settings, bool shared);

  /// \param now  s, when it came
  void take(ConsoleState state, double now);
  /// One frame; what was asked for in it, without times. \param now  s
  std::vector<ConsoleCommand> draw(double now, const Modifiers& modifiers);
  /// Whether the pointer is on the emergency button: as drawn last, or where it will be.
  bool on_emergency(float y) const { return y >= 0 && y < emergency_to_; }
  void light_emergency(bool on) { emergency_lit_ = on; }

 private:
  void draw_picture(const Modifiers& modifiers, bool with_plots,
                    std::vector<ConsoleCommand>& asked);
  void draw_hidden(float width, float height);
  void draw_view(const Modifiers& modifiers, float width, float height);
  void draw_side(double now, bool narrow, std::vector<ConsoleCommand>& asked);
  void draw_notes(std::vector<ConsoleCommand>& asked);
  static float least_notes();  ///< px, of the newest messages and the field for a note

  SceneView scene_;
  Camera camera_;
  std::optional<PointerHand> hand_;
  ConsoleState state_;
  bool shared_, hidden_;  ///< hidden: shape, scene and whether answers are right
  double came_ = 0;       ///< s
  bool any_ = false;
  std::deque<ForcePoint> forces_;
  TypedText note_{};
  Ending ending_;
  float emergency_to_ = 40;  ///< px, its lower edge; it is as wide as the window
  bool emergency_lit_ = false;
  float controls_ = 1;  ///< px, height of all between picture and messages, as drawn last
  std::size_t messages_seen_ = 0;
  int frames_to_scroll_ = 0;  ///< to the newest message
};

}  // namespace palpate::runner
