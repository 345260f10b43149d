#pragma once

#include "runner/devices/mouse.h"
#include "runner/display/camera.h"
#include "runner/servo.h"

namespace palpate {

/// What the pointer did over the console's view since the last frame. Pixels of the view.
struct PointerMotion {
  glm::vec2 at{0, 0}, moved{0, 0};
  float wheel = 0;     ///< notches, away from the user
  bool over = false;   ///< the pointer is over the view
  bool turn = false;   ///< Ctrl or the left button: turn instead of move
  bool reach = false;  ///< Shift: up and down is into the picture and out of it
  bool orbit = false;  ///< the right button: look from elsewhere; the stylus stays
};

/// Moves a MouseHand as the pointer says: the tip stays under the pointer, in a plane that faces
/// the viewer; the wheel moves that plane.
class PointerHand {
 public:
  PointerHand(MouseStylus& device, const WorkspaceMap& workspace);
  void step(const PointerMotion& pointer, const Camera& camera);

 private:
  MouseStylus& device_;
  WorkspaceMap workspace_;
  MouseHand hand_;
  glm::vec2 held_{0, 0};  ///< px, from the tip to the pointer: after a turn the tip must not jump
  bool was_over_ = false;
};

}  // namespace palpate
