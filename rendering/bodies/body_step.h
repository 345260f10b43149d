#pragma once
// A step of bodies that collide. Free motion goes up to the time at which a pair meets; there the
// bodies bounce, and the step goes on. What touches or may meet within the rest of the step is held
// apart by impulses that solve a linear complementarity problem. Nothing here allocates.

#include <cstdint>
#include <span>

#include "rendering/bodies/body_world.h"

namespace palpate::rendering {

/// Moves all bodies on. \param duration  s
void step_bodies(const BodyWorld& world, BodyWorldState& state, double duration);

/// Moves those bodies on that springs press on, and what they touch, in one go, so that a body
/// between a spring and a wall is held. They start where `state` has them; springs get their
/// impulses.
/// \param chosen  1 for each body that is to move
void step_pressed(const BodyWorld& world, BodyWorldState& state, std::span<const char> chosen,
                  std::span<PressingSpring> springs, double duration);

/// Marks all that is connected with a marked body through what touches, or may meet within a step
/// in which bodies are pushed by a distance besides, m.
/// \return whether a marked body has anything to touch
bool mark_connected(const BodyWorld& world, BodyWorldState& state, double duration, double distance,
                    std::span<char> marked);

/// Whether a body that is awake touches nothing, nor may within a step in which it goes so much
/// farther, m. Wakes nothing.
bool touches_nothing(const BodyWorld& world, BodyWorldState& state, std::uint32_t body,
                     double duration, double distance);

}  // namespace palpate::rendering
