#pragma once

#include <functional>
#include <optional>

#include "runner/devices/mouse.h"
#include "runner/display/camera.h"
#include "runner/servo/servo.h"

namespace palpate::runner {

/// What the pointer did over the console's view since the last frame. Pixels of the view.
struct PointerMotion {
  glm::vec2 at{0, 0}, moved{0, 0};
  float wheel = 0;     ///< notches, away from the user
  bool over = false;   ///< the pointer is over the view
  bool turn = false;   ///< Ctrl or the left button: turn instead of move
  bool reach = false;  ///< Shift: up and down is as the wheel
  bool orbit = false;  ///< the right button: look from elsewhere; the stylus stays
};

/// Where a line of sight first meets the object. \param from  m, virtual frame
using LineOfSight =
    std::function<std::optional<glm::vec3>(const glm::vec3& from, const glm::vec3& along)>;

/// Moves a StylusTarget as the pointer says: the tip is under the pointer, pressed a little into
/// the surface that is seen there. Beside the object it floats before it, as far off as a trial
/// asks for to begin. The wheel presses harder, and beside the object goes to and fro.
class PointerHand {
 public:
  PointerHand(MouseStylus& device, const WorkspaceMap& workspace);
  void step(const PointerMotion& pointer, const Camera& camera, const LineOfSight& object);

 private:
  Vec3 wanted(const glm::vec2& pixel, const Camera& camera, const LineOfSight& object);

  MouseStylus& device_;
  WorkspaceMap workspace_;
  StylusTarget hand_;
  glm::vec2 held_{0, 0};  ///< px, from the tip to the pointer: after a turn the tip must not jump
  bool was_over_ = false, touches_ = false;
  double press_ = 0;  ///< m, into the surface, along the line of sight
  double off_ = 0;    ///< m, of the plane beside the object, from the centre to the viewer
};

}  // namespace palpate::runner
