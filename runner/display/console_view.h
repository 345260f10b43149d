#pragma once
// The experimenter's console: layout of its panels, and state kept between frames.

#include <imgui.h>

#include <array>
#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "runner/devices/mouse.h"
#include "runner/display/scene/camera.h"
#include "runner/display/scene/scene_drawing.h"
#include "runner/display/scene/scene_renderer.h"
#include "runner/display/window.h"
#include "runner/servo/sample.h"
#include "runner/servo/servo.h"

namespace palpate::runner::display {

// 3D view of objects and stylus for the console, rendered off screen into a texture.

/// Pointer input over the console's view since the last frame. Pixels of the view.
struct PointerMotion {
  glm::vec2 at{0, 0}, moved{0, 0};
  float wheel = 0;     ///< notches, away from the user
  bool over = false;   ///< the pointer is over the view
  bool turn = false;   ///< Ctrl or the left button: turns the stylus instead of moving it
  bool depth = false;  ///< Shift: vertical motion acts like the wheel
  bool orbit = false;  ///< the right button: moves the camera; the stylus stays
};

/// The first point where a line of sight meets the object. \param from  m, virtual frame
using LineOfSight =
    std::function<std::optional<glm::vec3>(const glm::vec3& from, const glm::vec3& along)>;

/// Moves the mouse device's stylus with the pointer: the tip is under the pointer, pressed a little
/// into the surface there. Beside the object it lies in a plane in front of it, outside the home
/// zone. The wheel changes the penetration depth or, beside the object, the distance of the plane.
class PointerControl {
 public:
  PointerControl(devices::MouseStylus& device, const WorkspaceMap& workspace);
  void step(const PointerMotion& pointer, const Camera& camera, const LineOfSight& object);
  /// Puts the stylus there until the next step. \param stylus  m, virtual frame
  void rest_at(const rendering::LineProbe& stylus);

 private:
  Vec3 wanted(const glm::vec2& pixel, const Camera& camera, const LineOfSight& object);

  devices::MouseStylus& device_;
  WorkspaceMap workspace_;
  devices::StylusTarget target_;
  glm::vec2 pointer_offset_{0, 0};  ///< px, from the tip to the pointer, kept after a turn
  bool was_over_ = false, touches_ = false;
  double press_depth_ = 0;     ///< m, penetration depth along the line of sight
  double plane_distance_ = 0;  ///< m, from the centre towards the viewer
};

/// Needs a current OpenGL 3.3 context, also to be destroyed.
class SceneView {
 public:
  /// \throws DisplayError
  SceneView();

  using Objects = std::shared_ptr<const std::vector<stimuli::ObjectSpec>>;
  /// \return the OpenGL texture, `width` by `height` px, valid until the next draw
  /// \param bodies  poses of objects that move
  unsigned draw(const Objects& objects, const rendering::Tool& tool, const servo::Sample& sample,
                std::span<const rendering::BodyPose> bodies, const Camera& camera, int width,
                int height);
  /// The first point where a line meets the objects drawn last from outside.
  std::optional<glm::vec3> hit(const glm::vec3& from, const glm::vec3& along) const;
  /// The reason why the objects could not be drawn; empty: they were.
  const std::string& trouble() const { return trouble_; }

 private:
  SceneRenderer renderer_;
  Objects shown_;
  std::optional<SceneDrawing> drawing_;  ///< of the current objects
  std::vector<Pose> poses_;              ///< of the objects; empty: none can move
  std::string trouble_;
};

// Colours and small elements of the console's panels, in Dear ImGui.

namespace console_colour {
inline const ImVec4 kQuiet{0.60F, 0.64F, 0.69F, 1};
inline const ImVec4 kBright{0.95F, 0.94F, 0.91F, 1};
inline const ImVec4 kGood{0.47F, 0.78F, 0.55F, 1};
inline const ImVec4 kBad{0.97F, 0.46F, 0.40F, 1};
inline const ImVec4 kButton{0.20F, 0.24F, 0.28F, 1};
inline const ImVec4 kDue{0.16F, 0.42F, 0.27F, 1};
inline const ImVec4 kRed{0.74F, 0.16F, 0.15F, 1};
inline const ImVec4 kRedLit{0.86F, 0.23F, 0.21F, 1};
}  // namespace console_colour

void coloured_text(const ImVec4& colour, const std::string& words);
/// Breaks lines at spaces only: Dear ImGui would break "0.5" apart.
void wrapped_text(const ImVec4& colour, const std::string& words);
/// Name and value in the next two cells of a table.
void table_row(const char* name, const std::string& value,
               const ImVec4& colour = console_colour::kBright);

enum class Look { plain, lit, due };  ///< due: the button to press next
bool wide_button(const char* words, float width, Look look = Look::plain);

struct SliderRange {
  float least, most;  ///< logarithmic where least > 0
  int digits;         ///< after the decimal point; the value is rounded to them
  const char* unit;   ///< with a space before it
};
/// Name and value are drawn beside the slider: inside, the handle would hide the value. \return
/// whether it was moved
bool slider(const char* name, float& value, const SliderRange& range);

std::string fixed_point(double value, int digits);

/// A point of the force plot.
struct ForcePoint {
  double time = 0;   ///< s, session clock
  double force = 0;  ///< N, on the hand, sum of both devices
};

/// Text of an input field, zero-terminated.
using TypedText = std::array<char, 1000>;

/// The dialog for ending the session.
struct EndRequest {
  bool open = false, shown = false;
  TypedText reason{};  ///< as typed so far
};

/// The dialog for another answer to a question of a page.
struct Correction {
  bool open = false;
  std::size_t at = 0;  ///< into ConsoleState::given
  TypedText answer{};  ///< as typed so far
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

// Panels of the experimenter's console. Each function draws into the current Dear ImGui window.

/// \param hidden  leaves out the shape and whether answers were correct
/// \param compact  two values in a row, for low windows
void draw_status(const ConsoleState& state, bool hidden, bool compact);
/// The steps before the first trial: the current one large, with a button for each possible answer.
void draw_checklist(const Checklist& list, EndRequest& ending,
                    std::vector<ConsoleCommand>& commands);
/// Adds a command, without a time, for each button pressed. The dialog for ending the session
/// replaces the buttons: the console has no pop-ups, so nothing can cover the emergency button.
/// The dialog for correcting an answer does so, too. \param compact  as for the status
void draw_buttons(const ConsoleState& state, bool compact, EndRequest& ending,
                  Correction& correction, std::vector<ConsoleCommand>& commands);
/// The emergency button along the upper edge of the window, over everything else. Only drawn: its
/// clicks are handled by ConsoleWindow. \return its lower edge, px
float draw_emergency(bool lit);
/// If forces are off: the reason, and the button to allow them again.
/// \param silence  s without an update from the session; 0: updates arrive
void draw_forces_off(const ConsoleState& state, double silence,
                     std::vector<ConsoleCommand>& commands);
/// \param compact  as for the status
void draw_health(const ConsoleState& state, bool compact);
float health_height();  ///< px, of that which is not compact
/// \param height  px
void draw_forces(const std::deque<ForcePoint>& forces, float width, float height);
void draw_times(const std::vector<double>& times, float width, float height);
void draw_scores(const ConsoleState& state, float width, float height);

}  // namespace palpate::runner::display
