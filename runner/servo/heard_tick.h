#pragma once
// The audible part of a tick with forces, and the queue that carries it to the sound's thread.

#include <algorithm>
#include <cstdint>
#include <glm/geometric.hpp>

#include "rendering/probe.h"
#include "runner/servo/ring.h"
#include "runner/servo/sample.h"

namespace palpate::runner::servo {

/// Virtual frame, SI units.
struct HeardTick {
  std::int64_t time_ns = 0;    ///< session clock, of the tick
  rendering::LineProbe probe;  ///< m, virtual
  bool touching = false;
  Vec3 normal{0, 0, 1};  ///< unit, of the deepest contact, out of the object
  double along = 0;      ///< m, from the tip along the stylus to that contact
  double pressing = 0;   ///< N, along the normal
};

inline HeardTick heard_tick(const Sample& sample) {
  HeardTick out;
  out.time_ns = sample.time_ns;
  out.probe = sample.probe;
  const rendering::Contact& deepest = sample.rendering.deepest;
  out.touching = sample.rendering.contacts > 0;
  if (!out.touching) return out;
  out.normal = deepest.normal;
  out.along = deepest.along;
  out.pressing = std::max(0.0, glm::dot(sample.rendering.force, deepest.normal));
  return out;
}

using HeardTicks = Ring<HeardTick>;

}  // namespace palpate::runner::servo
