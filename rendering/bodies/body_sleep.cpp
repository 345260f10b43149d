#include "rendering/bodies/body_sleep.h"

#include <algorithm>
#include <glm/geometric.hpp>

namespace palpate::rendering {
namespace {

constexpr double kRestBefore = 0.5;  // s
constexpr double kNowhere = 1e-6;    // m, of any point of the body in that time
constexpr double kInTouch = 1e-6;    // m

bool has_stopped(const BodyWorld& world, const MovingBody& body, const BodyMotion& motion,
                 const SleepState& sleep) {
  const Quat turn = motion.orientation * glm::conjugate(sleep.orientation);
  const double moved = glm::distance(motion.centre, sleep.centre) +
                       2 * body.radius * glm::length(Vec3(turn.x, turn.y, turn.z));
  if (!(moved <= kNowhere)) return false;
  return world.gravity != Vec3(0) || body.of.damping > 0 ||
         (motion.velocity == Vec3(0) && motion.spin_momentum == Vec3(0));
}

/// Sets state.island by what touches.
void join_touching(const BodyWorld& world, BodyWorldState& state) {
  for (std::uint32_t i = 0; i < state.island.size(); ++i) state.island[i] = i;
  for (bool more = true; more;) {
    more = false;
    for (const auto& parts : state.near_parts) {
      const BodyPair& pair = world.pairs[parts.pair];
      if (pair.obstacle || parts.gap > kInTouch) continue;
      std::uint32_t &a = state.island[pair.a], &b = state.island[pair.b];
      if (a == b) continue;
      a = b = std::min(a, b);
      more = true;
    }
  }
}

}  // namespace

void fall_asleep(const BodyWorld& world, BodyWorldState& state, double duration) {
  if (!world.sleeps) return;
  bool any = false;
  for (std::size_t i = 0; i < world.bodies.size(); ++i) {
    SleepState& sleep = state.sleep[i];
    if (sleep.asleep) continue;
    if (has_stopped(world, world.bodies[i], state.motion[i], sleep)) {
      sleep.rested += duration;
      any |= sleep.rested >= kRestBefore;
    } else {
      sleep = {false, 0, static_cast<std::uint32_t>(i), state.motion[i].centre,
               state.motion[i].orientation};
    }
  }
  if (!any) return;
  join_touching(world, state);
  for (std::uint32_t group = 0; group < state.island.size(); ++group) {
    if (state.island[group] != group || state.sleep[group].asleep) continue;
    bool rests = true;
    for (std::size_t i = group; i < state.island.size(); ++i)
      rests &= state.island[i] != group || state.sleep[i].rested >= kRestBefore;
    if (!rests) continue;
    for (std::size_t i = group; i < state.island.size(); ++i) {
      if (state.island[i] != group) continue;
      state.sleep[i].asleep = true;
      state.sleep[i].group = group;
      state.motion[i].velocity = state.motion[i].spin_momentum = Vec3(0);
      ++state.sleeping;
    }
  }
}

void wake(BodyWorldState& state, std::uint32_t body) {
  if (!state.sleep[body].asleep) {
    state.sleep[body].rested = 0;
    return;
  }
  const std::uint32_t group = state.sleep[body].group;
  for (SleepState& sleep : state.sleep) {
    if (!sleep.asleep || sleep.group != group) continue;
    sleep.asleep = false;
    sleep.rested = 0;
    --state.sleeping;
  }
}

}  // namespace palpate::rendering
