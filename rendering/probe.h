#pragma once
// The line probe: the stylus as a segment.

#include "rendering/scene_motion.h"
#include "stimuli/vec.h"

namespace palpate::rendering {

/// The virtual probe as the device reports it: a segment from tip to tail, m. World frame, or the
/// mesh frame if a function says so. tip == tail: a point.
struct LineProbe {
  Vec3 tip, tail;
};

inline LineProbe translated(const LineProbe& probe, const Vec3& by) {
  return {probe.tip + by, probe.tail + by};
}

}  // namespace palpate::rendering
