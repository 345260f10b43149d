#include "rendering/fields.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "rendering/renderer.h"
#include "rendering/scene.h"

namespace palpate::rendering {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kFadedKnock = 6.907755278982137;  // of the decay: e^-t/tau is a thousandth

/// A contact with an object.
struct Touch {
  bool touches = false;
  Vec3 normal{0, 0, 0}, point{0, 0, 0};
  double along = 0;  ///< m, from the tip along the probe
  double force = 0;  ///< N, along the normal
};

/// The deepest contact with an object in this tick.
Touch touch_of(const Scene& scene, const RenderState& state, const Rendering& felt, int object) {
  Touch out;
  if (felt.contacts == 0) return out;
  if (felt.object == object) {
    const Contact& c = felt.deepest;
    return {true, c.normal, c.point, c.along, glm::dot(felt.force, c.normal)};
  }
  if (scene.motion() != nullptr || felt.contacts == 1) return out;
  double deepest = 0;
  const auto take = [&](const LoadedContact& c, const Vec3& point) {
    if (c.object != object || c.contact.depth <= deepest) return;
    deepest = c.contact.depth;
    out = {true, c.contact.normal, point, c.contact.along, c.force};
  };
  if (scene.features().unions) {
    for (const PlacedContact& c : state.unions.contacts) take(c.loaded, c.place);
  } else {
    for (const LoadedContact& c : state.contacts) take(c, c.contact.point);
  }
  return out;
}

/// The wrench that fields add to a tick's, as of Rendering.
struct Added {
  Vec3 force, torque, device1, device2;
};

bool vibrates(const ObjectEffects& object) {
  return std::any_of(object.fields.begin(), object.fields.end(), [](const auto& field) {
    return field.kind == stimuli::FieldSpec::Kind::vibration;
  });
}

/// Adds a force on the hand at a point of the stylus.
/// \param along  m, from the tip
void add_force(Added& out, const LineProbe& probe, const Vec3& force, const Vec3& lever,
               double along, bool side_contact) {
  out.force += force;
  if (!side_contact) {
    out.device1 += force;
    return;
  }
  const double length = along > 0 ? glm::distance(probe.tip, probe.tail) : 0;
  const double share = length > 0 ? along / length : 0;
  out.torque += glm::cross(lever, force);
  out.device2 += share * force;
  out.device1 += (1 - share) * force;
}

/// N, along the normal, of this tick.
double sound(const stimuli::TransientSpec& transient, EffectsState::Knock& knock,
             const Touch& touch, double entry_speed, double dt) {
  if (!touch.touches) {
    knock.since = knock.touching ? 0 : knock.since + dt;
    knock.sounding = false;
    knock.armed = knock.armed || knock.since >= kArmedAfter;
    knock.touching = false;
    return 0;
  }
  if (!knock.touching && knock.armed) {
    knock.sounding = true;
    knock.armed = false;
    knock.since = 0;
    knock.speed = std::clamp(entry_speed, 0.0, kFastestEntry);
  } else {
    knock.since += dt;
  }
  knock.touching = true;
  if (!knock.sounding) return 0;
  if (knock.since > kFadedKnock * transient.decay) {
    knock.sounding = false;
    return 0;
  }
  return std::max(-touch.force, knock_force(transient, knock.speed, knock.since));
}

void add_knock(const stimuli::TransientSpec& transient, EffectsState& own, std::size_t index,
               const Touch& touch, const LineProbe& probe, double dt, bool side_contact,
               Added& out) {
  double entry = 0;
  if (own.has_last && dt > 0 && touch.touches) {
    const double length = glm::distance(probe.tip, probe.tail);
    const double at = length > 0 ? touch.along / length : 0;
    const Vec3 motion = (1 - at) * (probe.tip - own.last.tip) + at * (probe.tail - own.last.tail);
    entry = -glm::dot(motion, touch.normal) / dt;
  }
  const double force = sound(transient, own.knocks[index], touch, entry, dt);
  if (force != 0)
    add_force(out, probe, force * touch.normal, touch.point - probe.tip, touch.along, side_contact);
}

Pose pose_of(const RenderState& state, const ObjectEffects& effects) {
  for (const BodyPose& body : state.motion.bodies()) {
    if (body.object == effects.object) return stimuli::compose(body.moved, effects.pose);
  }
  return effects.pose;
}

}  // namespace

Vec3 field_force(const stimuli::FieldSpec& field, const Vec3& place, const Vec3& velocity,
                 double time, bool touching) {
  using Kind = stimuli::FieldSpec::Kind;
  const auto towards = [&](const Vec3& centre) {
    const Vec3 from = place - centre;
    const double distance = glm::length(from);
    if (!(distance > field.radius)) return Vec3(0);
    return -field.stiffness * (1 - field.radius / distance) * from;
  };
  switch (field.kind) {
    case Kind::constant:
      return field.force;
    case Kind::spring:
      return towards(field.centre);
    case Kind::channel: {
      const Vec3 along = field.to - field.centre;
      const double share = glm::dot(place - field.centre, along) / glm::dot(along, along);
      return towards(field.centre + std::clamp(share, 0.0, 1.0) * along);
    }
    case Kind::viscous:
      return -(field.damping * velocity);
    case Kind::curl:
      return field.damping[0][0] * glm::cross(field.axis, velocity);
    case Kind::vibration:
      if (!touching && !field.always) return Vec3(0);
      return field.amplitude * std::sin(kTurn * field.frequency * time) * field.axis;
  }
  return Vec3(0);
}

double knock_force(const stimuli::TransientSpec& transient, double speed, double since) {
  return transient.amplitude * speed * std::exp(-since / transient.decay) *
         std::sin(kTurn * transient.frequency * since);
}

double curl_power(double damping, double speed, double turn, double period, double low_pass) {
  const double share = low_pass_share(period, low_pass);
  const double seen = speed * std::sin(0.5 * turn * period) / (0.5 * turn * period);
  // The low pass is share / (1 - (1 - share) z^-1); the backward difference lags by half a tick.
  const double re = 1 - (1 - share) * std::cos(turn * period),
               im = (1 - share) * std::sin(turn * period);
  const double size = share / std::hypot(re, im), lag = std::atan2(im, re);
  return damping * seen * seen * size * std::sin(turn * period + lag);
}

void add_effects(const Scene& scene, RenderState& state, const LineProbe& probe, double dt,
                 bool side_contact, Rendering& felt) noexcept {
  EffectsState& own = state.effects;
  if ((felt.faults & render_fault::kNonFinite) != 0) {
    own.has_last = false;
    std::fill(own.velocities.begin(), own.velocities.end(), Vec3(0));
    return;
  }
  const SceneEffects& effects = *scene.effects();
  const bool moves = own.has_last && dt > 0;
  if (own.has_last) own.time += dt;
  Added out;
  std::size_t index = 0;
  for (std::size_t i = 0; i < effects.objects.size(); ++i) {
    const ObjectEffects& object = effects.objects[i];
    Touch touch;
    if (object.transient || vibrates(object)) touch = touch_of(scene, state, felt, object.object);
    if (object.transient) add_knock(*object.transient, own, i, touch, probe, dt, side_contact, out);
    if (object.fields.empty()) continue;
    const Pose pose = object.moves ? pose_of(state, object) : object.pose;
    const bool turned = pose.orientation != Quat(1, 0, 0, 0);
    const Mat3 frame = turned ? glm::mat3_cast(pose.orientation) : Mat3(1);
    for (const stimuli::FieldSpec& field : object.fields) {
      Vec3& velocity = own.velocities[index++];
      double along = 0, share = 0;
      if (field.at_grip && side_contact) {
        const double length = glm::distance(probe.tip, probe.tail);
        along = std::min(effects.grip, length);
        share = length > 0 ? along / length : 0;
      }
      const Vec3 place = probe.tip + share * (probe.tail - probe.tip);
      if (moves) {
        const Vec3 last = own.last.tip + share * (own.last.tail - own.last.tip);
        velocity += low_pass_share(dt, field.low_pass) * ((place - last) / dt - velocity);
      }
      Vec3 from = place - pose.position, speed = velocity;
      if (turned) {
        from = from * frame;
        speed = speed * frame;
      }
      Vec3 force = field_force(field, from, speed, own.time, touch.touches);
      if (turned) force = frame * force;
      add_force(out, probe, force, place - probe.tip, along, side_contact);
    }
  }
  own.last = probe;
  own.has_last = true;
  felt.force += out.force;
  felt.torque += out.torque;
  felt.device1 += out.device1;
  felt.device2 += out.device2;
  const Vec3 sum = felt.force + felt.torque + felt.device2;
  if (std::isfinite(sum.x + sum.y + sum.z)) return;
  Rendering none;
  none.ideal = probe;
  none.faults = felt.faults | render_fault::kNonFinite;
  felt = none;
}

}  // namespace palpate::rendering
