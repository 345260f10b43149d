#include "runner/devices/simulated.h"

#include <cmath>
#include <glm/geometric.hpp>

namespace palpate::runner::devices {
namespace {

Vec3 round_to(const Vec3& v, double step) {
  return {std::nearbyint(v.x / step) * step, std::nearbyint(v.y / step) * step,
          std::nearbyint(v.z / step) * step};
}

// Squared angle (rad^2) up to which Taylor series are used, 0.1 rad. The stylus is seldom farther
// from the hand's direction. There the first omitted terms are below 1e-17 of the sum.
constexpr double kSeriesEnd = 0.01;

/// asin(x) / x of x^2 up to kSeriesEnd.
double arc_over_sine(double x2) {
  const double x4 = x2 * x2, x8 = x4 * x4;
  return ((1 + x2 * (1.0 / 6)) + x4 * (3.0 / 40 + x2 * (5.0 / 112))) +
         x8 * ((35.0 / 1152 + x2 * (63.0 / 2816)) + x4 * (231.0 / 13312 + x2 * (143.0 / 10240)));
}

/// The rotation vector (rad) of the smallest rotation from unit `from` to unit `to`.
Vec3 rotation_between(const Vec3& from, const Vec3& to) {
  const Vec3 c = glm::cross(from, to);
  const double sine2 = glm::dot(c, c);
  const double cosine = glm::dot(from, to);
  if (sine2 <= kSeriesEnd && cosine > 0) return arc_over_sine(sine2) * c;
  if (sine2 == 0) return Vec3(0);
  const double sine = std::sqrt(sine2);
  return std::atan2(sine, cosine) / sine * c;
}

/// Rodrigues' formula.
Vec3 rotate(const Vec3& v, const Vec3& rotation) {
  const double angle2 = glm::dot(rotation, rotation);
  if (angle2 <= kSeriesEnd) {
    const double t = angle2, t2 = t * t, t4 = t2 * t2;
    const double cosine = ((1 - t * (1.0 / 2)) + t2 * (1.0 / 24 - t * (1.0 / 720))) +
                          t4 * (1.0 / 40320 - t * (1.0 / 3628800));
    const double sine_over_angle =
        ((1 - t * (1.0 / 6)) + t2 * (1.0 / 120 - t * (1.0 / 5040))) + t4 * (1.0 / 362880);
    // (1 - cos) / angle^2
    const double versine_over_angle2 =
        ((1.0 / 2 - t * (1.0 / 24)) + t2 * (1.0 / 720 - t * (1.0 / 40320))) + t4 * (1.0 / 3628800);
    return cosine * v + sine_over_angle * glm::cross(rotation, v) +
           versine_over_angle2 * glm::dot(rotation, v) * rotation;
  }
  const double angle = std::sqrt(angle2);
  const Vec3 k = rotation / angle;
  return std::cos(angle) * v + std::sin(angle) * glm::cross(k, v) +
         (1 - std::cos(angle)) * glm::dot(k, v) * k;
}

}  // namespace

SpringDamper::SpringDamper(double mass, double damping, double stiffness, double tick) {
  const double decay = damping / (2 * mass);
  const double omega2 = stiffness / mass - decay * decay;  // < 0: overdamped
  const double omega = std::sqrt(std::abs(omega2));
  const double angle = omega * tick;
  double c = std::cos(angle), s = std::sin(angle) / omega;
  if (omega2 < 0) {
    c = std::cosh(angle);
    s = std::sinh(angle) / omega;
  }
  if (angle < 1e-8) {
    c = 1;
    s = tick;
  }
  const double e = std::exp(-decay * tick);
  xx_ = e * (c + decay * s);
  xv_ = e * s;
  vx_ = -e * s * stiffness / mass;
  vv_ = e * (c - decay * s);
}

SimulatedStylus::SimulatedStylus(const SimulatedDeviceSettings& device, const HandImpedance& hand,
                                 double length, double grip, double tick)
    : settings_(device),
      hand_(hand),
      length_(length),
      grip_(grip),
      mass_(2 * device.end_mass + hand.mass),
      friction_step_(device.friction / mass_ * tick),
      shift_(mass_, hand.damping + device.damping, hand.stiffness, tick),
      turn_(device.end_mass * (grip * grip + (length - grip) * (length - grip)), hand.turn_damping,
            hand.turn_stiffness, tick) {
  capabilities_ = {"simulated",
                   5,
                   5,
                   device.max_force,
                   device.max_stiffness,
                   1 / tick,
                   device.workspace_radius,
                   device.resolution,
                   true,
                   "",
                   "",
                   device.damping,
                   device.friction,
                   true};
}

void SimulatedStylus::reset(const HandTarget& target) {
  target_ = target;
  position_ = target.grip;
  axis_ = target.axis;
  velocity_ = spin_ = force_ = torque_ = Vec3(0);
  away_is_known_ = target_turns_ = false;
  find_away();
}

void SimulatedStylus::find_away() noexcept {
  if (away_is_known_) return;
  away_ = rotation_between(target_.axis, axis_);
  away_is_known_ = true;
}

void SimulatedStylus::set_target(const HandTarget& target) {
  target_turns_ = target.axis != target_.axis;
  target_ = target;
  away_is_known_ &= !target_turns_;
  find_away();
}

servo::DeviceReading SimulatedStylus::read() noexcept {
  // Translation, about the equilibrium of the hand's spring, its damper (relative to the moving
  // target) and the force held since the last tick.
  const Vec3 balance = target_.grip + (force_ + hand_.damping * target_.velocity) / hand_.stiffness;
  Vec3 offset = position_ - balance, velocity = velocity_;
  shift_.advance(offset, velocity);
  const double speed = glm::length(velocity);
  if (speed > friction_step_) {
    position_ = balance + offset;
    velocity_ = (1 - friction_step_ / speed) * velocity;
  } else {
    velocity_ = Vec3(0);  // sticks
  }
  const double distance = glm::length(position_);
  if (distance > settings_.workspace_radius) {
    position_ *= settings_.workspace_radius / distance;
    velocity_ = Vec3(0);
  }
  // Rotation likewise, about the target's axis. Roll about the stylus is neither sensed nor
  // actuated.
  const Vec3 turned_balance = torque_ / hand_.turn_stiffness;
  find_away();
  Vec3 turned = away_ - turned_balance;
  turn_.advance(turned, spin_);
  axis_ = glm::normalize(rotate(target_.axis, turned + turned_balance));
  spin_ -= glm::dot(spin_, axis_) * axis_;
  away_is_known_ = false;
  // Compute it for the next tick already: the processor does it while the tick waits for the
  // renderer. A turning target would make it invalid.
  if (!target_turns_) find_away();

  servo::DeviceReading reading;
  reading.stylus.tip = round_to(position_ - grip_ * axis_, settings_.resolution);
  reading.stylus.tail = round_to(position_ + (length_ - grip_) * axis_, settings_.resolution);
  return reading;
}

void SimulatedStylus::write(const Vec3& device1, const Vec3& device2) noexcept {
  force_ = device1 + device2;
  torque_ = glm::cross(axis_, (length_ - grip_) * device2 - grip_ * device1);
}

StrokingStylus::StrokingStylus(double length, double grip, double rate,
                               const StrokeSettings& settings)
    : settings_(settings), grip_(grip), tick_(1 / rate), stylus_({}, {}, length, grip, 1 / rate) {
  stylus_.reset(target_at(0));
}

HandTarget StrokingStylus::target_at(double time) const {
  HandTarget target;
  target.grip = {0, -settings_.distance, grip_};
  if (time < settings_.rest) return target;
  const double turn = 2 * M_PI / settings_.stroke;
  const double phase = turn * (time - settings_.rest);
  const double half = settings_.distance / 2;
  target.grip.y += half * (1 - std::cos(phase));
  target.velocity.y = half * turn * std::sin(phase);
  return target;
}

servo::DeviceReading StrokingStylus::read() noexcept {
  time_ += tick_;
  if (time_ >= settings_.rest + settings_.stroke) time_ = 0;
  stylus_.set_target(target_at(time_));
  return stylus_.read();
}

}  // namespace palpate::runner::devices
