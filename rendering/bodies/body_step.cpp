#include "rendering/bodies/body_step.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "rendering/bodies/body_contacts.h"
#include "rendering/bodies/body_sleep.h"

namespace palpate::rendering {
namespace {

constexpr int kMostEvents = 32;  // in a step; then what meets is held apart without a bounce

Vec3 velocity_after(const BodyWorld& world, const MovingBody& body, const Vec3& velocity,
                    double duration) {
  BodyMotion motion;
  motion.velocity = velocity;
  move_freely(body.inertia, world.gravity, body.of.damping, duration, motion);
  return motion.velocity;
}

/// A body moved on by the velocity that impulses have given it.
void move_pushed(const MovingBody& body, double duration, BodyMotion& motion) {
  motion.centre += duration * motion.velocity;
  motion.orientation =
      turned_freely(body.inertia, motion.spin_momentum, motion.orientation, duration);
}

/// Applies gravity and damping to the velocities alone.
void accelerate(const BodyWorld& world, const MovingBody& body, double duration,
                BodyMotion& motion) {
  motion.velocity = velocity_after(world, body, motion.velocity, duration);
  if (body.of.damping > 0) motion.spin_momentum *= std::exp(-body.of.damping * duration);
}

void move_all(const BodyWorld& world, BodyWorldState& state, double duration) {
  BodyContacts contacts(world, state);
  double left = duration;
  for (int event = 0; left > 0; ++event) {
    contacts.find(left);
    if (state.near.empty()) {
      for (std::size_t i = 0; i < world.bodies.size(); ++i) {
        if (state.sleep[i].asleep) continue;
        move_freely(world.bodies[i].inertia, world.gravity, world.bodies[i].of.damping, left,
                    state.motion[i]);
      }
      return;
    }
    if (contacts.bounce(left, duration)) contacts.find(left);
    const double next = event < kMostEvents ? contacts.time_to_next(left) : left;
    // Impulses act on the velocities as they will be; what they do not push moves freely.
    contacts.hold_apart(next, {}, {});
    for (std::size_t i = 0; i < world.bodies.size(); ++i) {
      if (state.sleep[i].asleep) continue;
      const MovingBody& body = world.bodies[i];
      if (state.pushed[i]) {
        accelerate(world, body, next, state.motion[i]);
        contacts.add_impulses(i);
        move_pushed(body, next, state.motion[i]);
      } else {
        move_freely(body.inertia, world.gravity, body.of.damping, next, state.motion[i]);
      }
    }
    left -= next;
    if (left < 1e-12 * duration) break;
  }
}

}  // namespace

void step_bodies(const BodyWorld& world, BodyWorldState& state, double duration) {
  if (state.sleeping == world.bodies.size()) return;
  move_all(world, state, duration);
  fall_asleep(world, state, duration);
}

void step_pressed(const BodyWorld& world, BodyWorldState& state, std::span<const char> chosen,
                  std::span<PressingSpring> springs, double duration) {
  BodyContacts contacts(world, state);
  double deepest = 0;  // no spring pushes farther than that
  for (const PressingSpring& spring : springs) deepest = std::max(deepest, spring.depth);
  contacts.find(duration, deepest, chosen);
  contacts.hold_apart(duration, springs, chosen);
  for (std::size_t i = 0; i < world.bodies.size(); ++i) {
    if (!chosen[i]) continue;
    accelerate(world, world.bodies[i], duration, state.motion[i]);
    contacts.add_impulses(i);
    move_pushed(world.bodies[i], duration, state.motion[i]);
  }
}

bool mark_connected(const BodyWorld& world, BodyWorldState& state, double duration, double distance,
                    std::span<char> marked) {
  BodyContacts contacts(world, state);
  contacts.find_near(duration, distance);
  bool touches = false;
  for (bool more = true; more;) {
    more = false;
    for (const BodyWorldState::NearParts& parts : state.near_parts) {
      const BodyPair& pair = world.pairs[parts.pair];
      const bool a = marked[pair.a] != 0, b = !pair.obstacle && marked[pair.b] != 0;
      touches |= a || b;
      if (pair.obstacle || a == b) continue;
      marked[pair.a] = marked[pair.b] = 1;
      more = true;
    }
  }
  return touches;
}

bool touches_nothing(const BodyWorld& world, BodyWorldState& state, std::uint32_t body,
                     double duration, double distance) {
  return !BodyContacts(world, state).may_touch(body, duration, distance);
}

}  // namespace palpate::rendering
