// A body that goes fast at the probe and touches nothing else: steps of its own within a step. Part
// of moving_bodies.h.

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "rendering/bodies/body_sleep.h"
#include "rendering/bodies/moving_bodies.h"

namespace palpate::rendering {
namespace {

constexpr double kFarthest = 5e-4;  // m, in a step against the probe
constexpr int kMostSteps = 20;

}  // namespace

/// Steps that a body makes within a step, so that against the probe none of its points goes farther
/// in one than levers and normals stay what they are; 1 where the probe is far or slow, or where it
/// may touch something else: then it goes with the others.
int MovingBodies::inner_steps(const BodiesState& state, std::size_t body,
                              const Stroke& stroke) const {
  const double duration = stroke.duration;
  if (!(duration > 0) || !stroke.touches || state.world.sleep[body].asleep) return 1;
  const BodyMotion& motion = state.world.motion[body];
  const MovingBody& of = world_.bodies[body];
  const Vec3 way = duration * motion.velocity;
  const double turn = glm::length(spin_of(of.inertia, motion)) * of.radius * duration;
  const Vec3 tip = stroke.to.tip - stroke.from.tip, tail = stroke.to.tail - stroke.from.tail;
  const double moved = turn + std::max(glm::distance(tip, way), glm::distance(tail, way));
  if (!(moved > kFarthest)) return 1;
  double reach = 0;
  if (fixed_.tool() != nullptr) {
    for (const ToolSegment& segment : fixed_.tool()->segments)
      reach = std::max({reach, glm::length(segment.from), glm::length(segment.to)});
  }
  const int steps = static_cast<int>(std::min(std::ceil(moved / kFarthest), double{kMostSteps}));
  const double near = of.radius + reach + moved / steps;
  for (int k = 0; k <= steps; ++k) {
    const double share = static_cast<double>(k) / steps;
    const Vec3 d =
        glm::mix(stroke.from.tail - stroke.from.tip, stroke.to.tail - stroke.to.tip, share);
    const Vec3 off = motion.centre + share * (way - tip) - stroke.from.tip;
    const double length2 = glm::dot(d, d);
    const double along = length2 > 0 ? std::clamp(glm::dot(off, d) / length2, 0.0, 1.0) : 0;
    if (glm::distance(off, along * d) <= near) return steps;
  }
  return 1;
}

/// Whether it touches nothing else in a step, however the probe may strike it: in the probe's frame
/// it has no more energy afterwards than it came with.
bool MovingBodies::stays_alone(BodiesState& state, std::size_t body, const Stroke& stroke) const {
  const BodyMotion& motion = state.world.motion[body];
  const MovingBody& of = world_.bodies[body];
  const double hand = std::max(glm::distance(stroke.to.tip, stroke.from.tip),
                               glm::distance(stroke.to.tail, stroke.from.tail)) /
                      stroke.duration;
  const double speed = glm::length(motion.velocity) + hand;
  const double turning = 0.5 * glm::dot(motion.spin_momentum, spin_of(of.inertia, motion));
  const BodiesState::Held& held = state.held[body];
  const double depth = held.holds ? held.contact.depth_after : 0;
  const double energy = 0.5 * of.inertia.mass * speed * speed + turning +
                        0.5 * held.contact.spring.stiffness * depth * depth;
  const double farthest = speed + std::sqrt(2 * energy * of.inertia.per_mass) +
                          of.radius * std::sqrt(2 * energy * of.inertia.most_per_inertia);
  return touches_nothing(world_, state.world, static_cast<std::uint32_t>(body), stroke.duration,
                         stroke.duration * farthest);
}

/// Gives a body what the probe pushes it with, which are all contacts there are.
void MovingBodies::push_alone(BodiesState& state, std::size_t body, const Stroke& stroke) const {
  ProbeContact& only = state.contacts.front();
  if (state.contacts.size() == 1 && only.spring.damping == 0) {
    push_freely(state, only, stroke.duration);
    hold(state, stroke, only);
    only.spring.normal = only.pressing;
    return;
  }
  state.springs.clear();
  std::fill(state.chosen.begin(), state.chosen.end(), 0);
  add_springs(state, 0, state.contacts.size(), stroke.duration);
  state.world.motion[body] = state.before[body];
  push_pressed(state, stroke.duration);
}

void MovingBodies::step_finely(const Renderer& renderer, BodiesState& state, std::size_t body,
                               const Stroke& stroke) const {
  const int steps = state.inner[body];
  const MovingBody& of = world_.bodies[body];
  BodyMotion& motion = state.world.motion[body];
  motion = state.before[body];
  const BodyMotion began = motion;
  ProbeContact mean;
  mean.spring.body = static_cast<std::uint32_t>(body);
  double weight = 0, most = -1;
  Vec3 push(0);
  Rendering felt;
  Pose shown;
  std::uint32_t faults = 0;
  for (int part = 0; part < steps; ++part) {
    const Stroke inner = part_of(stroke, part, steps);
    state.before[body] = motion;
    move_freely(of.inertia, world_.gravity, of.of.damping, inner.duration, motion);
    state.contacts.clear();
    feel(renderer, state, body, inner);
    faults |= state.felt[body].faults;
    find_probe_contacts(state, body, inner);
    if (!state.contacts.empty()) {
      wake(state.world, static_cast<std::uint32_t>(body));
      state.ahead[body] = motion;
      push_alone(state, body, inner);
      for (ProbeContact& contact : state.contacts) push_sideways(state, contact, inner.duration);
    }
    remember_depth(state, body);
    settle_shape(state, body, inner);
    for (const ProbeContact& contact : state.contacts) {
      if (!(contact.force > 0)) continue;
      push += contact.force * contact.spring.normal;
      mean.tangential += contact.tangential;
      mean.on_probe += contact.force * (contact.on_probe - inner.to.tip);
      mean.along += contact.force * contact.along;
      mean.offset += contact.force * contact.offset;
      weight += contact.force;
      if (contact.force > most) {
        most = contact.force;
        mean.segment = contact.segment;
        mean.spring.group = contact.spring.group;
        mean.spring.stiffness = contact.spring.stiffness;
        felt = state.felt[body];
        shown = state.shown[body];
      }
    }
  }
  state.contacts.clear();
  state.before[body] = began;
  if (weight > 0) {
    state.felt[body] = felt;
    state.shown[body] = shown;
    mean.force = glm::length(push) / steps;
    mean.spring.normal = mean.force > 0 ? glm::normalize(push) : Vec3(0);
    mean.tangential /= steps;
    mean.on_probe = stroke.to.tip + mean.on_probe / weight;
    mean.along /= weight;
    mean.offset /= weight;
    mean.felt_depth = mean.spring.stiffness > 0 ? mean.force / mean.spring.stiffness : 0;
    state.means.push_back(mean);
  }
  state.felt[body].faults = faults;
}

}  // namespace palpate::rendering
