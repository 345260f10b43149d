#pragma once
// Poses within poses.

#include "stimuli/vec.h"

namespace palpate::stimuli {

/// The pose in the frame of `outer` of what has the pose `inner` in its own.
inline Pose compose(const Pose& outer, const Pose& inner) {
  return {outer.orientation * inner.position + outer.position,
          outer.orientation * inner.orientation};
}

}  // namespace palpate::stimuli
