#pragma once
// The experimenter's console: layout of its panels, and state kept between frames.

#include <deque>
#include <optional>
#include <vector>

#include "runner/display/console_elements.h"
#include "runner/display/console_panels.h"
#include "runner/display/scene/camera.h"
#include "runner/display/scene_view.h"
#include "runner/display/window.h"

namespace palpate::runner::display {

class ConsoleView {
 public:
  /// Needs a current OpenGL context. \param shared  the participant may see the console as well
  ConsoleView(const WindowSettings& settings, bool shared);

  /// \param now  s, time of arrival
  void update(ConsoleState state, double now);
  /// One monitor shows both windows, or no longer does: hides the shape and the scene, or shows
  /// them.
  void share(bool shared);
  /// Draws a frame. \return the commands given in it, without times. \param now  s
  std::vector<ConsoleCommand> draw(double now, const Modifiers& modifiers);
  /// Whether a pointer position (px) lies in the emergency button, which spans the window's width.
  bool in_emergency_button(float y) const { return y >= 0 && y < emergency_bottom_; }
  float emergency_height() const { return emergency_bottom_; }  ///< px, with its margin
  void highlight_emergency(bool on) { emergency_highlit_ = on; }
  /// Asks whether to end the session, as its button does.
  void ask_to_end() { end_request_.open = true; }
  bool asks_to_end() const { return end_request_.open; }

 private:
  void draw_picture(const Modifiers& modifiers, bool with_plots,
                    std::vector<ConsoleCommand>& commands);
  void draw_hidden(float width, float height);
  void draw_view(const Modifiers& modifiers, float width, float height);
  void draw_side(double now, bool narrow, std::vector<ConsoleCommand>& commands);
  void draw_notes(std::vector<ConsoleCommand>& commands);
  void draw_answer(std::vector<ConsoleCommand>& commands);
  static bool readings_are_in_picture(bool wide);
  static float min_notes_height();  ///< px, space for the newest messages and the note field

  SceneView scene_;
  Camera camera_;
  std::optional<PointerControl> control_;
  ConsoleState state_;
  bool shared_, hidden_;   ///< hidden: do not show shape, scene and whether answers are correct
  double updated_at_ = 0;  ///< s
  bool has_state_ = false;
  std::deque<ForcePoint> forces_;
  TypedText note_{}, answer_{};
  EndRequest end_request_;
  Correction correction_;
  float emergency_bottom_ = 40;  ///< px, lower edge of the button
  bool emergency_highlit_ = false;
  float controls_ = 1;  ///< px, height of the controls as drawn last
  std::size_t messages_seen_ = 0;
  int frames_to_scroll_ = 0;  ///< frames that still scroll to the newest message
};

}  // namespace palpate::runner::display
