#pragma once
// The experimenter's console: layout of its panels, and what it keeps from frame to frame.

#include <array>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "runner/display/pointer_control.h"
#include "runner/display/scene_view.h"
#include "runner/display/window.h"

namespace palpate::runner {

/// A point of the force plot.
struct ForcePoint {
  double time = 0;   ///< s, session clock
  double force = 0;  ///< N, on the hand, of both devices together
};

/// Text of an input field, zero-terminated.
using TypedText = std::array<char, 1000>;

/// The dialog for ending the session.
struct EndRequest {
  bool open = false, shown = false;
  TypedText reason{};  ///< as typed so far
};

/// Modifier keys held down in either window.
struct Modifiers {
  bool ctrl = false, shift = false;
};

class ConsoleView {
 public:
  /// Needs a current OpenGL context. \param shared  the participant may see the console as well
  ConsoleView(const WindowSettings& settings, bool shared);

  /// \param now  s, time of arrival
  void update(ConsoleState state, double now);
  /// Draws a frame. \return the commands given in it, without times. \param now  s
  std::vector<ConsoleCommand> draw(double now, const Modifiers& modifiers);
  /// Whether a pointer position (px) lies in the emergency button, which spans the window's width.
  bool in_emergency_button(float y) const { return y >= 0 && y < emergency_bottom_; }
  float emergency_height() const { return emergency_bottom_; }  ///< px, with its margin
  void highlight_emergency(bool on) { emergency_highlit_ = on; }

 private:
  void draw_picture(const Modifiers& modifiers, bool with_plots,
                    std::vector<ConsoleCommand>& commands);
  void draw_hidden(float width, float height);
  void draw_view(const Modifiers& modifiers, float width, float height);
  void draw_side(double now, bool narrow, std::vector<ConsoleCommand>& commands);
  void draw_notes(std::vector<ConsoleCommand>& commands);
  void draw_answer(std::vector<ConsoleCommand>& commands);
  static float min_notes_height();  ///< px, for the newest messages and the note field

  SceneView scene_;
  Camera camera_;
  std::optional<PointerControl> control_;
  ConsoleState state_;
  bool shared_, hidden_;   ///< hidden: shape, scene and whether answers are correct
  double updated_at_ = 0;  ///< s
  bool has_state_ = false;
  std::deque<ForcePoint> forces_;
  TypedText note_{}, answer_{};
  EndRequest end_request_;
  float emergency_bottom_ = 40;  ///< px, lower edge of the button
  bool emergency_highlit_ = false;
  float controls_ = 1;  ///< px, height of the controls as drawn last
  std::size_t messages_seen_ = 0;
  int frames_to_scroll_ = 0;  ///< to the newest message
};

}  // namespace palpate::runner
