#pragma once
// Pose and velocity of a moving stimulus, as the store keeps them.

#include "data/record.h"
#include "rendering/scene_motion.h"
#include "stimuli/vec.h"

namespace palpate::runner::session {

inline data::BodyRecord body_record(const rendering::BodyPose& body) {
  data::BodyRecord out;
  out.centre = {body.centre.x, body.centre.y, body.centre.z};
  const Quat& q = body.orientation;
  out.orientation_wxyz = {q.w, q.x, q.y, q.z};
  out.velocity = {body.velocity.x, body.velocity.y, body.velocity.z};
  out.spin = {body.spin.x, body.spin.y, body.spin.z};
  return out;
}

inline bool same_body(const data::BodyRecord& a, const data::BodyRecord& b) {
  return a.centre == b.centre && a.orientation_wxyz == b.orientation_wxyz &&
         a.velocity == b.velocity && a.spin == b.spin;
}

}  // namespace palpate::runner::session
