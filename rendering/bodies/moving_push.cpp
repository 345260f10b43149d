// What the probe gives bodies and gets back. Part of moving_bodies.h.

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <utility>

#include "rendering/bodies/moving_bodies.h"
#include "rendering/bodies/spring_pass.h"

namespace palpate::rendering {

/// One spring on a body that touches nothing else: its impulse in closed form, given to the body as
/// a blow at the mean time of that impulse, with the normal and the lever as they are then; before
/// and after it the body moves freely. A bounce within a step so keeps the energy to rounding,
/// however far the body turns in it: where speed, lever and inertia are of different times, it
/// would not. Changes the body's motion.
void MovingBodies::push_freely(BodiesState& state, ProbeContact& contact, double duration) const {
  PressingSpring& spring = contact.spring;
  const MovingBody& body = world_.bodies[spring.body];
  const BodyMotion& before = state.before[spring.body];
  BodiesState::Held& held = state.held[spring.body];
  BodyMotion& motion = state.world.motion[spring.body];
  // As it was at the beginning of the step.
  const Rendering& felt = state.felt[spring.body];
  constexpr double kSame = 1 - 2e-4;  // cosine; beyond it another feature is touched
  const bool known =
      held.holds &&
      (felt.contacts == 0 ||
       (felt.deepest.type == held.type &&
        glm::dot(motion.orientation * held.contact.spring.normal, spring.normal) > kSame));
  const Vec3 first_normal =
      before.orientation *
      (known ? held.contact.spring.normal : glm::conjugate(motion.orientation) * spring.normal);
  const Vec3 first_place =
      known ? out_of({before.centre, before.orientation}, held.contact.spring.place)
            : contact.on_probe - contact.moved;
  SpringStart start;
  start.stiffness = spring.stiffness;
  const double first_closing =
      glm::dot(first_normal, velocity_at(spin_of(body.inertia, before), before, first_place) -
                                 contact.moved / duration);
  start.growth = (spring.closing - first_closing) / duration;
  const Quat out_of_world = glm::conjugate(motion.orientation);
  const Vec3 last_normal = out_of_world * spring.normal;
  const Vec3 from_normal = glm::conjugate(before.orientation) * first_normal;
  const Vec3 from_place = glm::conjugate(before.orientation) * (first_place - before.centre);
  const Vec3 last_place = out_of_world * (spring.place - motion.centre);
  constexpr int kRounds = 2;
  double when = 0.5 * duration;  // s; of the blow
  BodyMotion struck;
  Vec3 normal, moment;
  SpringPass pass;
  for (int round = 1;; ++round) {
    struck = before;
    move_freely(body.inertia, world_.gravity, body.of.damping, when, struck);
    const double share = when / duration;
    normal = struck.orientation * glm::normalize(glm::mix(from_normal, last_normal, share));
    const Vec3 lever = known ? struck.orientation * glm::mix(from_place, last_place, share)
                             : contact.on_probe - (1 - share) * contact.moved - struck.centre;
    moment = glm::cross(lever, normal);
    const Vec3 turn = world_per_inertia(body.inertia, struck.orientation) * moment;
    start.mass = 1 / (body.inertia.per_mass + glm::dot(turn, moment));
    start.speed = glm::dot(normal, struck.velocity - contact.moved / duration) +
                  glm::dot(turn, struck.spin_momentum) - when * start.growth;
    start.depth = spring.depth - duration * (start.speed + 0.5 * duration * start.growth);
    pass = pass_spring(start, duration);
    if (!(pass.impulse > 0) || round == kRounds) break;
    when = std::clamp(duration - pass.double_impulse / pass.impulse, 0.0, duration);
  }
  if (!held.holds) {
    const double depth = std::max(0.0, start.depth);
    held.energy = kinetic_energy(body.inertia, before) + 0.5 * spring.stiffness * depth * depth;
    held.leeway = 0;
    held.balanced = true;
  }
  held.energy += kinetic_energy(body.inertia, motion) - kinetic_energy(body.inertia, before) -
                 glm::dot(world_.gravity, normal) * pass.double_impulse -
                 pass.impulse * glm::dot(normal, contact.moved) / duration;
  spring.impulse = pass.impulse;
  contact.pressing = normal;
  contact.depth_after = pass.depth;
  struck.velocity -= pass.impulse * body.inertia.per_mass * normal;
  struck.spin_momentum -= pass.impulse * moment;
  move_freely(body.inertia, world_.gravity, body.of.damping, duration - when, struck);
  struck.centre -=
      (pass.double_impulse - pass.impulse * (duration - when)) * body.inertia.per_mass * normal;
  motion = struck;
  // Where the spring is in touch over several steps, its depth is exact but for the body's turning
  // in them: of what the spring does along the body's way, the share that normal and lever turn by.
  const double spin = std::max(glm::length(spin_of(body.inertia, before)),
                               glm::length(spin_of(body.inertia, motion)));
  const double speed = std::max(glm::length(before.velocity), glm::length(motion.velocity)) +
                       spin * glm::distance(spring.place, motion.centre);
  held.leeway += pass.impulse * speed * spin * duration;
  balance(state, contact, moment, duration);
}

/// On its way off the probe a body's energy, with the spring's, has to be what it came with and
/// what hand and weight have given it since. What steps of finite length have lost or won of it
/// (some 1e-4, where the body turns on the probe) the impulse makes good, but no more than that:
/// what else the sum is off by comes from the hand's way over edges and corners, and to give that
/// to a heavy body, which hardly moves, would take the whole force of a tick.
void MovingBodies::balance(BodiesState& state, ProbeContact& contact, const Vec3& moment,
                           double duration) const {
  constexpr double kMostShare = 1e-2;  // of the speed: more is no rounding of steps
  PressingSpring& spring = contact.spring;
  BodiesState::Held& held = state.held[spring.body];
  if (contact.tangential != Vec3(0)) held.balanced = false;
  if (!held.balanced) return;
  const BodyInertia& inertia = world_.bodies[spring.body].inertia;
  BodyMotion& motion = state.world.motion[spring.body];
  const double leaving = glm::dot(contact.pressing, motion.velocity - contact.moved / duration) +
                         glm::dot(moment, spin_of(inertia, motion));
  const double per_mass =
      inertia.per_mass + glm::dot(moment, world_per_inertia(inertia, motion.orientation) * moment);
  const double depth = std::max(0.0, contact.depth_after);
  const double surplus = std::clamp(
      kinetic_energy(inertia, motion) + 0.5 * spring.stiffness * depth * depth - held.energy,
      -held.leeway, held.leeway);
  const double under = leaving * leaving - 2 * surplus * per_mass;
  if (!(leaving < 0) || !(under >= 0.25 * leaving * leaving)) return;
  const double impulse = std::max((leaving + std::sqrt(under)) / per_mass, -spring.impulse);
  if (!(std::abs(impulse) * per_mass <= -kMostShare * leaving)) return;
  spring.impulse += impulse;
  held.leeway = std::max(0.0, held.leeway - std::abs(surplus));
  held.energy -= impulse * glm::dot(contact.pressing, contact.moved) / duration;
  motion.velocity -= impulse * inertia.per_mass * contact.pressing;
  motion.spin_momentum -= impulse * moment;
}

/// What presses on a body in a step that holds it apart from other things, too.
void MovingBodies::add_springs(BodiesState& state, std::size_t first, std::size_t end,
                               double duration) const {
  const std::uint32_t body = state.contacts[first].spring.body;
  state.held[body].holds = false;
  state.chosen[body] = 1;
  for (std::size_t k = first; k < end; ++k) {
    PressingSpring& spring = state.contacts[k].spring;
    const BodyMotion &from = state.before[body], &to = state.ahead[body];
    const Vec3 began =
        from.orientation * (glm::conjugate(to.orientation) * (spring.place - to.centre)) +
        from.centre;
    spring.free_speed = -glm::dot(spring.normal, spring.place - began) / duration;
    spring.impulse = 0;
    state.springs.push_back(spring);
  }
}

/// Moves the chosen bodies on from where they began, with the springs.
void MovingBodies::push_pressed(BodiesState& state, double duration) const {
  step_pressed(world_, state.world, state.chosen, state.springs, duration);
  std::size_t next = 0;
  for (ProbeContact& contact : state.contacts) {
    if (next < state.springs.size() && state.springs[next].body == contact.spring.body)
      contact.spring.impulse = state.springs[next++].impulse;
  }
}

/// Gives the bodies what the probe pushes them with.
void MovingBodies::push_held(BodiesState& state, const Stroke& stroke) const {
  const double duration = stroke.duration;
  std::fill(state.chosen.begin(), state.chosen.end(), 0);
  state.springs.clear();
  for (std::size_t first = 0; first < state.contacts.size();) {
    std::size_t end = first + 1;
    const std::uint32_t body = state.contacts[first].spring.body;
    while (end < state.contacts.size() && state.contacts[end].spring.body == body) ++end;
    ProbeContact& only = state.contacts[first];
    bool alone = end == first + 1 && only.spring.damping == 0;
    if (alone) {
      push_freely(state, only, duration);
      state.held[body].holds = false;
      // With that it must not meet anything: seen from where it began.
      const double way = glm::distance(state.world.motion[body].centre, state.ahead[body].centre);
      const BodyMotion pushed = state.world.motion[body];
      std::swap(state.world.motion, state.before);
      std::vector<char>& marked = state.chosen;
      const char was = std::exchange(marked[body], 1);
      alone = !mark_connected(world_, state.world, duration, 2 * way, marked);
      std::swap(state.world.motion, state.before);
      if (alone) marked[body] = was;
      if (alone) {
        hold(state, stroke, only);
        only.spring.normal = only.pressing;
      }
      state.world.motion[body] = alone ? pushed : state.ahead[body];
    }
    if (!alone) add_springs(state, first, end, duration);
    first = end;
  }
  if (!state.springs.empty()) {
    std::swap(state.world.motion, state.before);
    mark_connected(world_, state.world, duration, 0, state.chosen);
    for (std::size_t i = 0; i < world_.bodies.size(); ++i) {
      if (!state.chosen[i]) state.world.motion[i] = state.before[i];
    }
    push_pressed(state, duration);
  }
}

void MovingBodies::remember_depth(BodiesState& state, std::size_t body) const {
  double& deepest = state.held[body].deepest = 0;
  for (const ProbeContact& contact : state.contacts) {
    if (contact.spring.body == body)
      deepest = std::max({deepest, contact.felt_depth, contact.depth_after});
  }
}

/// The mean force of the step, and friction's share of it. Friction is a spring along the surface;
/// it yields as the body would within the step, so that a light body does not ring.
void MovingBodies::push_sideways(BodiesState& state, ProbeContact& contact, double duration) const {
  const PressingSpring& spring = contact.spring;
  const MovingBody& body = world_.bodies[spring.body];
  BodyMotion& motion = state.world.motion[spring.body];
  const double elastic = contact.force;
  contact.force = spring.impulse / duration;
  contact.felt_depth = spring.stiffness > 0 ? contact.force / spring.stiffness : 0;
  const double sideways = glm::length(contact.tangential);
  if (!(sideways > 0)) return;
  const Vec3 direction = contact.tangential / sideways;
  const Vec3 moment = glm::cross(spring.place - motion.centre, direction);
  const Vec3 turn = world_per_inertia(body.inertia, motion.orientation) * moment;
  const double per_mass = body.inertia.per_mass + glm::dot(turn, moment);
  const double yield = 1 + duration * duration * spring.stiffness * per_mass;
  const double share = elastic > 0 ? std::min(1.0, contact.force / elastic) : 0;
  contact.tangential *= share / yield;
  contact.offset *= share / yield;
  const double impulse = sideways * share / yield * duration;
  motion.velocity -= impulse * body.inertia.per_mass * direction;
  motion.spin_momentum -= impulse * moment;
}
}  // namespace palpate::rendering
