#include "rendering/bodies/moving_bodies.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <utility>

#include "rendering/bodies/one_sided_spring.h"
#include "rendering/render_fault.h"

namespace palpate::rendering {
namespace {

constexpr double kLongestStep = 1.5e-3;  // s
constexpr double kLongestTick = 1;       // s; bodies do not move in the time beyond it
constexpr double kFarthestPose = 1e6;    // m

bool in_range(const Vec3& v) { return glm::dot(v, v) <= kFarthestPose * kFarthestPose; }

bool is_finite(const BodyMotion& motion) {
  const Vec3 sum = motion.centre + motion.velocity + motion.spin_momentum;
  const Quat& q = motion.orientation;
  return std::isfinite(sum.x + sum.y + sum.z + q.w + q.x + q.y + q.z) && in_range(motion.centre);
}

constexpr double kFarthest = 5e-4;  // m, in a step against the probe
constexpr int kMostSteps = 20;

}  // namespace

std::unique_ptr<MotionState> BodiesState::clone() const {
  auto copy = std::make_unique<BodiesState>(*this);
  copy->world.make_room();
  copy->contacts.reserve(most_contacts);
  copy->springs.reserve(most_contacts);
  copy->means.reserve(inner.size());
  return copy;
}

MovingBodies::MovingBodies(BodyWorld world, Scene fixed, std::vector<Scene> shapes)
    : world_(std::move(world)), fixed_(std::move(fixed)), shapes_(std::move(shapes)) {}

std::unique_ptr<MotionState> MovingBodies::initial_state() const {
  auto state = std::make_unique<BodiesState>();
  state->fixed = fixed_.initial_state();
  std::size_t contacts = 0;
  state->shapes.reserve(shapes_.size());  // growth would copy them without working memory
  for (const Scene& shape : shapes_) {
    state->shapes.push_back(shape.initial_state());
    contacts += std::max<std::size_t>(1, state->shapes.back().unions.contacts.capacity());
  }
  state->world = rendering::initial_state(world_);
  const std::size_t count = world_.bodies.size();
  state->poses.resize(count);
  state->before.resize(count);
  state->ahead.resize(count);
  state->felt.resize(count);
  state->shown.resize(count);
  state->chosen.resize(count);
  state->held.resize(count);
  state->most_contacts = contacts;
  state->contacts.reserve(contacts);
  state->springs.reserve(contacts);
  state->inner.resize(count, 1);
  state->means.reserve(count);
  settle(*state, {});
  return state;
}

Rendering MovingBodies::tick(const Renderer& renderer, RenderState& outer, const LineProbe& probe,
                             double dt) const noexcept {
  auto& state = static_cast<BodiesState&>(*outer.motion.get());
  const bool valid = in_range(probe.tip) && in_range(probe.tail);
  const bool tool = fixed_.tool() != nullptr;
  Mat3 frame = state.last_frame;
  const bool sided = !tool || in_range(outer.measured_side);
  if (valid && sided && tool)
    frame = tool_frame(probe.tail - probe.tip, state.has_last ? &state.last_frame : nullptr,
                       outer.measured_side);
  const bool touches = valid && sided;
  // An invalid reading: the bodies move on without the probe.
  const LineProbe last = state.has_last || !touches ? state.last : probe;
  const Mat3 last_frame = state.has_last || !touches ? state.last_frame : frame;
  const double time = dt > 0 ? std::min(dt, kLongestTick) : 0;
  state.world.dropped = false;
  const int steps = std::max(1, static_cast<int>(std::ceil(time / kLongestStep - 1e-9)));
  const Stroke whole{last, probe, last_frame, frame, time, touches};
  for (int i = 0; i < steps; ++i) step(renderer, state, part_of(whole, i, steps));
  state.fixed.measured_side = tool && touches ? frame[0] : outer.measured_side;
  Rendering fixed = renderer.tick(fixed_, state.fixed, probe, dt);
  if (touches) {
    state.last = outer.last = probe;
    state.last_frame = frame;
    state.has_last = outer.has_last = true;
    return sum(renderer, state, fixed, probe);
  }
  return fixed;
}

/// One of `parts` equally long parts of a stroke.
MovingBodies::Stroke MovingBodies::part_of(const Stroke& stroke, int part, int parts) const {
  if (parts == 1) return stroke;
  const auto at = [&](int k) {
    const double f = static_cast<double>(k) / parts;
    return k == parts ? stroke.to
                      : LineProbe{stroke.from.tip + f * (stroke.to.tip - stroke.from.tip),
                                  stroke.from.tail + f * (stroke.to.tail - stroke.from.tail)};
  };
  const auto frame_at = [&](int k) {
    if (fixed_.tool() == nullptr || k == parts) return stroke.frame_to;
    if (k == 0) return stroke.frame_from;
    const ToolPose from{stroke.from.tip, stroke.from.tail - stroke.from.tip, stroke.frame_from};
    const ToolPose to{stroke.to.tip, stroke.to.tail - stroke.to.tip, stroke.frame_to};
    return between(from, to, static_cast<double>(k) / parts).frame;
  };
  return {at(part),      at(part + 1), frame_at(part), frame_at(part + 1), stroke.duration / parts,
          stroke.touches};
}

void MovingBodies::step(const Renderer& renderer, BodiesState& state, const Stroke& stroke) const {
  if (state.drawn.object >= 0) draw(state, stroke.duration);
  for (std::size_t i = 0; i < world_.bodies.size(); ++i) {
    const int inner = inner_steps(state, i, stroke);
    state.inner[i] = inner > 1 && stays_alone(state, i, stroke) ? inner : 1;
  }
  state.before = state.world.motion;
  if (stroke.duration > 0) step_bodies(world_, state.world, stroke.duration);
  state.means.clear();
  if (stroke.touches) {
    for (std::size_t i = 0; i < world_.bodies.size(); ++i) {
      if (state.world.sleep[i].asleep) state.inner[i] = 1;
      if (state.inner[i] > 1) step_finely(renderer, state, i, stroke);
    }
    state.contacts.clear();
    for (std::size_t i = 0; i < world_.bodies.size(); ++i) {
      if (state.inner[i] > 1) continue;
      feel(renderer, state, i, stroke);
      find_probe_contacts(state, i, stroke);
    }
    for (const ProbeContact& contact : state.contacts) wake(state.world, contact.spring.body);
    if (stroke.duration > 0 && !state.contacts.empty()) {
      state.ahead = state.world.motion;
      push_held(state, stroke);
      for (ProbeContact& contact : state.contacts) push_sideways(state, contact, stroke.duration);
    }
    for (std::size_t i = 0; i < world_.bodies.size(); ++i) {
      if (state.inner[i] == 1) remember_depth(state, i);
    }
    for (const ProbeContact& mean : state.means) {
      if (state.contacts.size() < state.most_contacts) state.contacts.push_back(mean);
    }
  }
  for (std::size_t i = 0; i < world_.bodies.size(); ++i) {
    if (is_finite(state.world.motion[i])) continue;
    // Keep the last pose, at rest: NaN must not propagate.
    state.world.motion[i] = state.before[i];
    state.world.motion[i].velocity = state.world.motion[i].spin_momentum = Vec3(0);
    if (!is_finite(state.world.motion[i])) state.world.motion[i] = world_.bodies[i].start;
  }
  settle(state, stroke);
}

/// Pulls a body by a critically damped spring, of the same period for every mass.
void MovingBodies::draw(BodiesState& state, double duration) const {
  constexpr double kRate = 20, kMost = 100;  // rad/s; m/s^2
  for (std::uint32_t i = 0; i < world_.bodies.size(); ++i) {
    const MovingBody& body = world_.bodies[i];
    if (body.object != state.drawn.object) continue;
    BodyMotion& motion = state.world.motion[i];
    const Quat turn = motion.orientation * glm::conjugate(body.placed.orientation);
    const Vec3 arm = turn * (state.drawn.on_object - body.placed.position);
    const Vec3 speed = motion.velocity + glm::cross(spin_of(body.inertia, motion), arm);
    const Vec3 wanted = kRate * kRate * (state.drawn.to - motion.centre - arm) - 2 * kRate * speed;
    const double size = glm::length(wanted);
    if (!(size > 0) || !std::isfinite(size)) continue;
    const Vec3 direction = wanted / size;
    const Vec3 moment = glm::cross(arm, direction);
    const double per_mass =
        body.inertia.per_mass +
        glm::dot(moment, world_per_inertia(body.inertia, motion.orientation) * moment);
    const double impulse = std::min(size, kMost) / per_mass * duration;
    wake(state.world, i);
    motion.velocity += impulse * body.inertia.per_mass * direction;
    motion.spin_momentum += impulse * moment;
  }
}

/// Renders a body in its frame, at its place without the probe's push.
void MovingBodies::feel(const Renderer& renderer, BodiesState& state, std::size_t body,
                        const Stroke& stroke) const {
  const Pose frame = state.shown[body] = pose_of(state, body);
  RenderState& shape = state.shapes[body];
  if (fixed_.tool() != nullptr)
    shape.measured_side = glm::conjugate(frame.orientation) * stroke.frame_to[0];
  state.felt[body] = renderer.tick(shapes_[body], shape, into(frame, stroke.to), stroke.duration);
}

/// Adds a body's contacts with the probe.
void MovingBodies::find_probe_contacts(BodiesState& state, std::size_t body,
                                       const Stroke& stroke) const {
  const Rendering& felt = state.felt[body];
  const Scene& shape = shapes_[body];
  const Pose frame = pose_of(state, body);
  ProbeContact contact;
  contact.spring.body = static_cast<std::uint32_t>(body);
  if (felt.contacts == 0) {
    if (state.held[body].holds) continue_contact(state, stroke, body);
    return;
  }
  if (!shape.features().unions) {
    const Contact& c = felt.deepest;
    contact.force = glm::dot(felt.force, c.normal);
    contact.tangential = felt.force - contact.force * c.normal;
    contact.spring.stiffness = shape.parts()[0].material.stiffness;
    contact.spring.damping = shape.parts()[0].material.damping;
    contact.spring.depth = c.depth;
    contact.spring.normal = c.normal;
    contact.spring.place = c.point;
    contact.offset = felt.ideal.tip - into(frame, stroke.to.tip) - c.depth * c.normal;
    place_contact(state, stroke, frame, c.depth * c.normal, contact);
    return;
  }
  for (const PlacedContact& c : state.shapes[body].unions.contacts) {
    if (state.contacts.size() == state.most_contacts) return;
    contact.force = c.loaded.force;
    contact.offset = c.loaded.tangential_offset;
    contact.tangential = c.loaded.stiffness * contact.offset;
    contact.segment = c.segment;
    contact.spring.group = static_cast<int>(c.group);
    contact.spring.stiffness = c.loaded.stiffness;
    contact.spring.damping = shape.material_of(c.loaded.part).damping;
    contact.spring.depth = c.loaded.contact.depth;
    contact.spring.normal = c.loaded.contact.normal;
    contact.spring.place = c.place + contact.offset;
    place_contact(state, stroke, frame, c.shift, contact);
  }
}

/// Continues the contact of the last step if the probe is above its plane at the end of this one:
/// it still presses within the step. If the probe is below the plane and is not leaving it, it has
/// passed the border of the touched face, and the contact ends.
void MovingBodies::continue_contact(BodiesState& state, const Stroke& stroke,
                                    std::size_t body) const {
  const BodiesState::Held& held = state.held[body];
  ProbeContact contact = held.contact;
  const Pose frame = pose_of(state, body);
  const bool tool = fixed_.tool() != nullptr;
  const Vec3 on_probe = tool ? stroke.to.tip + stroke.frame_to * held.on_tool
                             : stroke.to.tip + contact.along * (stroke.to.tail - stroke.to.tip);
  PressingSpring& spring = contact.spring;
  const Vec3 shift = glm::dot(spring.normal, spring.place - into(frame, on_probe)) * spring.normal;
  spring.depth = glm::dot(shift, spring.normal);
  spring.place = into(frame, on_probe) + shift;
  contact.force = 0;
  contact.offset = contact.tangential = Vec3(0);
  const std::size_t others = state.contacts.size();
  place_contact(state, stroke, frame, shift, contact);
  if (state.contacts.size() == others) return;
  const PressingSpring& placed = state.contacts.back().spring;
  if (placed.depth <= std::max(0.0, -placed.closing * stroke.duration)) return;
  state.contacts.pop_back();
  state.held[body].holds = false;
}

/// Remembers a body's spring at the end of the step, for continue_contact.
void MovingBodies::hold(BodiesState& state, const Stroke& stroke,
                        const ProbeContact& contact) const {
  const std::uint32_t body = contact.spring.body;
  BodiesState::Held& held = state.held[body];
  held.holds = contact.depth_after > 0;
  if (!held.holds) return;
  // Use the frame in which the body was rendered: there the surface is at the touched place.
  const Pose& frame = state.shown[body];
  const Quat back = glm::conjugate(frame.orientation);
  held.contact = contact;
  held.contact.spring.normal = back * contact.spring.normal;
  held.contact.spring.place = into(frame, contact.spring.place);
  held.on_tool = (contact.on_probe - stroke.to.tip) * stroke.frame_to;
  if (state.felt[body].contacts > 0) held.type = state.felt[body].deepest.type;
}

/// Takes a contact out of its body's frame. \param shift  m, from the virtual to the ideal probe,
/// in the body's frame, without friction
void MovingBodies::place_contact(BodiesState& state, const Stroke& stroke, const Pose& frame,
                                 const Vec3& shift, ProbeContact contact) const {
  PressingSpring& spring = contact.spring;
  const BodyMotion& motion = state.world.motion[spring.body];
  for (Vec3* v : {&spring.normal, &contact.offset, &contact.tangential})
    *v = frame.orientation * *v;
  spring.place = out_of(frame, spring.place);
  contact.on_probe = spring.place - contact.offset - frame.orientation * shift;
  const Vec3 d = stroke.to.tail - stroke.to.tip, from_tip = contact.on_probe - stroke.to.tip;
  const double length2 = glm::dot(d, d);
  contact.along = length2 > 0 ? glm::dot(from_tip, d) / length2 : 0;
  Vec3& moved = contact.moved;
  if (fixed_.tool() != nullptr) {
    moved = contact.on_probe - (stroke.from.tip + stroke.frame_from * (from_tip * stroke.frame_to));
  } else {
    moved = (1 - contact.along) * (stroke.to.tip - stroke.from.tip) +
            contact.along * (stroke.to.tail - stroke.from.tail);
  }
  if (stroke.duration > 0) {
    const Vec3 spin = spin_of(world_.bodies[spring.body].inertia, motion);
    spring.closing =
        glm::dot(spring.normal, velocity_at(spin, motion, spring.place) - moved / stroke.duration);
    // A depth that no work has made must not hold energy: two parts that jam the probe move the
    // ideal tool by centimetres when they approach by micrometres. A body that the force hardly
    // moves gets the full force.
    constexpr double kCreep = 0.01, kHardly = 0.01;  // m/s; m/s^2
    const double way = (spring.closing > 0 ? 2 : 1) * spring.closing + kCreep;
    const double pressed = state.held[spring.body].deepest + way * stroke.duration;
    const double mass = world_.bodies[spring.body].inertia.mass;
    if (spring.stiffness * spring.depth > kHardly * mass)
      spring.depth = std::min(spring.depth, pressed);
  }
  contact.depth_after = 0;
  contact.felt_depth = spring.stiffness > 0 ? contact.force / spring.stiffness : 0;
  if (spring.stiffness > 0 || spring.damping > 0) state.contacts.push_back(contact);
}

/// Updates the bodies' shown poses and remembered states.
void MovingBodies::settle(BodiesState& state, const Stroke& stroke) const {
  for (std::size_t i = 0; i < world_.bodies.size(); ++i) {
    const BodyMotion& motion = state.world.motion[i];
    const MovingBody& body = world_.bodies[i];
    BodyPose& pose = state.poses[i];
    pose.object = body.object;
    pose.centre = motion.centre;
    pose.orientation = motion.orientation;
    pose.velocity = motion.velocity;
    pose.spin = spin_of(body.inertia, motion);
    pose.moved.orientation =
        glm::normalize(motion.orientation * glm::conjugate(body.placed.orientation));
    pose.moved.position = motion.centre - pose.moved.orientation * body.placed.position;
    if (stroke.touches) settle_shape(state, i, stroke);
  }
}

/// The next step's motion counts from here.
void MovingBodies::settle_shape(BodiesState& state, std::size_t body, const Stroke& stroke) const {
  RenderState& shape = state.shapes[body];
  if (!shape.has_last) return;
  const Pose frame = pose_of(state, body);
  shape.last = into(frame, stroke.to);
  if (!(shape.unions.last.d != Vec3(0) || !shape.unions.pairs.empty())) return;
  shape.unions.last = into(frame, stroke.to, stroke.frame_to);
  // Without a tool all poses share one frame: interpolate the stylus by its direction.
  if (fixed_.tool() == nullptr) shape.unions.last.frame = Mat3(1);
}

// A body that moves fast against the probe and touches nothing else makes steps of its own within a
// step.

/// Number of steps that a body makes within a step, so that in each none of its points moves so far
/// against the probe that levers and normals change. 1 if the probe is far or slow, or if the body
/// may touch something else: then it moves with the others.
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

/// Whether a body touches nothing else in a step, however the probe strikes it: in the probe's
/// frame it never has more energy afterwards than before.
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

/// Applies the probe's push to the one body that all of state.contacts belong to.
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

// Impulses between the probe and bodies.

/// Applies one spring to a body that touches nothing else. Its impulse, in closed form, acts as a
/// blow at the mean time of that impulse, with the normal and lever of that time. Before and after
/// the blow the body moves freely. So a bounce within a step keeps the energy to rounding, however
/// far the body turns; with speed, lever and inertia of different times, it would not. Changes the
/// body's motion.
void MovingBodies::push_freely(BodiesState& state, ProbeContact& contact, double duration) const {
  PressingSpring& spring = contact.spring;
  const MovingBody& body = world_.bodies[spring.body];
  const BodyMotion& before = state.before[spring.body];
  BodiesState::Held& held = state.held[spring.body];
  BodyMotion& motion = state.world.motion[spring.body];
  // The contact at the beginning of the step.
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
  // If the spring touches over several steps, the body's turn during them is the only error of its
  // depth: of the spring's work along the body's way, the share by which normal and lever turn.
  const double spin = std::max(glm::length(spin_of(body.inertia, before)),
                               glm::length(spin_of(body.inertia, motion)));
  const double speed = std::max(glm::length(before.velocity), glm::length(motion.velocity)) +
                       spin * glm::distance(spring.place, motion.centre);
  held.leeway += pass.impulse * speed * spin * duration;
  balance(state, contact, moment, duration);
}

/// Corrects the energy of a body that leaves the probe. Its energy, with the spring's, must be its
/// initial one plus the work of the hand and of weight since. The impulse corrects the errors of
/// finite steps (some 1e-4, if the body turns on the probe) alone. Other differences come from the
/// hand's path over edges and corners; to correct them on a heavy body would take the whole force
/// of a tick.
void MovingBodies::balance(BodiesState& state, ProbeContact& contact, const Vec3& moment,
                           double duration) const {
  constexpr double kMostShare = 1e-2;  // of the speed: more is not an error of steps
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

/// Adds the springs on a body for a step that also holds it apart from other things.
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

/// Moves the chosen bodies from their places at the beginning of the step, with the springs.
void MovingBodies::push_pressed(BodiesState& state, double duration) const {
  step_pressed(world_, state.world, state.chosen, state.springs, duration);
  std::size_t next = 0;
  for (ProbeContact& contact : state.contacts) {
    if (next < state.springs.size() && state.springs[next].body == contact.spring.body)
      contact.spring.impulse = state.springs[next++].impulse;
  }
}

/// Applies the probe's push to the bodies.
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
      // With that push the body must not meet anything on its way from the beginning of the step.
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

/// Sets the mean force of the step and friction's share of it. Friction is a spring along the
/// surface; it yields as the body would within the step, so that a light body does not ring.
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

// The wrench of all touched bodies and obstacles.

/// Adds the wrench of one body on the hand.
void MovingBodies::add_body(const Renderer& renderer, const BodiesState& state, std::size_t body,
                            const LineProbe& probe, Rendering& out) const {
  const Rendering& felt = state.felt[body];
  const bool tool = fixed_.tool() != nullptr;
  const Quat& turn = state.shown[body].orientation;
  out.faults |= felt.faults;
  const ProbeContact* deepest = nullptr;
  Vec3 torque(0);
  double along = 0;  // N m, as in sum_unions
  const Vec3 d = probe.tail - probe.tip;
  const double length2 = glm::dot(d, d);
  for (const ProbeContact& c : state.contacts) {
    if (c.spring.body != body || !(c.force > 0)) continue;
    const Vec3 force = c.force * c.spring.normal + c.tangential;
    const Vec3 place = c.on_probe + c.felt_depth * c.spring.normal + c.offset;
    out.force += force;
    ++out.contacts;
    if (renderer.side_contact()) {
      torque += glm::cross(place - probe.tip, force);
      if (tool && length2 > 0)
        along += glm::dot(place - probe.tip, d) * glm::dot(force, d) / length2;
      if (!tool) out.device2 += c.along * force;
    }
    if (deepest == nullptr || c.felt_depth > deepest->felt_depth) deepest = &c;
  }
  out.torque += torque;
  if (tool && renderer.side_contact()) out.device2 += tail_force(torque, along, d);
  if (deepest == nullptr || (out.object >= 0 && deepest->felt_depth <= out.deepest.depth)) return;
  Vec3 shift = deepest->offset;
  for (const ProbeContact& c : state.contacts) {
    if (c.spring.body == body && c.spring.group == deepest->spring.group)
      shift += c.felt_depth * c.spring.normal;
  }
  out.deepest = felt.deepest;
  if (felt.contacts == 0) out.deepest.type = state.held[body].type;
  out.deepest.along = renderer.side_contact() ? deepest->along * std::sqrt(length2) : 0;
  out.deepest.normal = deepest->spring.normal;
  out.deepest.depth = deepest->felt_depth;
  out.deepest.point =
      deepest->on_probe + deepest->felt_depth * deepest->spring.normal + deepest->offset;
  out.ideal.tip = probe.tip + shift;
  out.ideal.tail = out.ideal.tip + turn * (felt.ideal.tail - felt.ideal.tip);
  out.object = world_.bodies[body].object;
  if (tool) {
    out.segment = deepest->segment;
    out.ideal_side = turn * felt.ideal_side;
  }
}

Rendering MovingBodies::sum(const Renderer& renderer, const BodiesState& state,
                            const Rendering& fixed, const LineProbe& probe) const {
  Rendering out = fixed;
  if (state.world.dropped) out.faults |= render_fault::kContactsDropped;
  for (std::size_t i = 0; i < world_.bodies.size(); ++i) add_body(renderer, state, i, probe, out);
  out.device1 = out.force - out.device2;
  const Vec3 all = out.force + out.torque + out.device2;
  if (std::isfinite(all.x + all.y + all.z)) return out;
  Rendering none;
  none.ideal = probe;
  none.faults = out.faults | render_fault::kNonFinite;
  return none;
}

}  // namespace palpate::rendering
