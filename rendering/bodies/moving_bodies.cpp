#include "rendering/bodies/moving_bodies.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <utility>

#include "rendering/bodies/body_sleep.h"

namespace palpate::rendering {
namespace {

constexpr double kLongestStep = 1.5e-3;  // s
constexpr double kLongestTick = 1;       // s; time beyond it is lost to what moves
constexpr double kFarthestPose = 1e6;    // m

bool in_range(const Vec3& v) { return glm::dot(v, v) <= kFarthestPose * kFarthestPose; }

bool is_finite(const BodyMotion& motion) {
  const Vec3 sum = motion.centre + motion.velocity + motion.spin_momentum;
  const Quat& q = motion.orientation;
  return std::isfinite(sum.x + sum.y + sum.z + q.w + q.x + q.y + q.z) && in_range(motion.centre);
}

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
  state->shapes.reserve(shapes_.size());  // growing would copy them, and copies lose their room
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
  // A reading that is none: the bodies go on untouched.
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

/// One of so many parts of a stroke, equally long.
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
    // It stays where it was last, at rest: no number that is none goes on from here.
    state.world.motion[i] = state.before[i];
    state.world.motion[i].velocity = state.world.motion[i].spin_momentum = Vec3(0);
    if (!is_finite(state.world.motion[i])) state.world.motion[i] = world_.bodies[i].start;
  }
  settle(state, stroke);
}

/// A critically damped spring of the same period for every mass.
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

/// Renders a body in its frame, where it will be unless the probe holds it up.
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
    if (state.held[body].holds) go_on(state, stroke, body);
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
    contact.spring.damping = shape.parts()[c.loaded.part].material.damping;
    contact.spring.depth = c.loaded.contact.depth;
    contact.spring.normal = c.loaded.contact.normal;
    contact.spring.place = c.place + contact.offset;
    place_contact(state, stroke, frame, c.shift, contact);
  }
}

/// The contact of the last step, where the probe is beyond its plane at the end of this one: within
/// the step it still presses. A probe that is still below the plane and not about to come out has
/// gone past the border of what it touched: the plane ends there, and so does the contact.
void MovingBodies::go_on(BodiesState& state, const Stroke& stroke, std::size_t body) const {
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

/// Remembers the spring that a body ends the step with, for go_on.
void MovingBodies::hold(BodiesState& state, const Stroke& stroke,
                        const ProbeContact& contact) const {
  const std::uint32_t body = contact.spring.body;
  BodiesState::Held& held = state.held[body];
  held.holds = contact.depth_after > 0;
  if (!held.holds) return;
  // In the frame in which the renderer saw the body: there the surface is where it was touched.
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
    // What nobody has pressed holds no energy: two parts that the probe is jammed between can move
    // the ideal tool by centimetres where they have come nearer by micrometres. What hardly moves
    // for it has its force nonetheless.
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

/// What is shown and remembered of the bodies where they have come to.
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

/// From there the next step's motion counts.
void MovingBodies::settle_shape(BodiesState& state, std::size_t body, const Stroke& stroke) const {
  RenderState& shape = state.shapes[body];
  if (!shape.has_last) return;
  const Pose frame = pose_of(state, body);
  shape.last = into(frame, stroke.to);
  if (shape.unions.last.d != Vec3(0) || !shape.unions.pairs.empty())
    shape.unions.last = into(frame, stroke.to, stroke.frame_to);
}

}  // namespace palpate::rendering
