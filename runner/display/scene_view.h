#pragma once
// 3D view of objects and stylus for the console, rendered off screen into a texture, and the
// pointer that moves the mouse device in it.

#include <functional>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "runner/devices/mouse.h"
#include "runner/display/scene/camera.h"
#include "runner/display/scene/scene_drawing.h"
#include "runner/display/scene/scene_renderer.h"
#include "runner/servo/sample.h"
#include "runner/servo/servo.h"

namespace palpate::runner::display {

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

}  // namespace palpate::runner::display
