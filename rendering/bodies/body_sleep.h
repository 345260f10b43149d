#pragma once
// Bodies that have come to rest sleep: they are neither moved nor held against each other until
// something comes near. Nothing here allocates.

#include <cstdint>

#include "rendering/bodies/body_world.h"

namespace palpate::rendering {

/// After a step: those that touch each other fall asleep together when each has gone nowhere for
/// half a second. Where neither gravity nor damping acts, a body sleeps only if it has no momentum
/// at all, so that none is lost.
/// \param duration  s, of the step
void fall_asleep(const BodyWorld& world, BodyWorldState& state, double duration);

/// Wakes a body and those that fell asleep with it.
void wake(BodyWorldState& state, std::uint32_t body);

}  // namespace palpate::rendering
