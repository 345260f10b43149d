// The simulated stylus against physics integrated in small steps and against closed forms.

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>

#include "runner/devices/simulated.h"

namespace palpate::runner::devices {
namespace {

constexpr double kStep = 1e-3;

/// x'' = -(k x + b x') / m in 1000 small steps a tick (semi-implicit Euler).
void small_steps(double m, double b, double k, double& x, double& v) {
  constexpr int kSteps = 20000;
  const double h = kStep / kSteps;
  for (int i = 0; i < kSteps; ++i) {
    v += h * -(k * x + b * v) / m;
    x += h * v;
  }
}

TEST(SpringDamper, AgreesWithSmallSteps) {
  const double cases[][3] = {
      {0.25, 10.5, 400}, {0.25, 200, 400}, {0.25, 20, 400}, {0.05, 0, 5e4}, {0.001, 50, 1e6}};
  for (const auto& [m, b, k] : cases) {
    double x = 0.01, v = -0.3;
    Vec3 px(x, 0, 0), pv(v, 0, 0);
    SpringDamper(m, b, k, kStep).advance(px, pv);
    small_steps(m, b, k, x, v);
    EXPECT_NEAR(px.x, x, 2e-4 * (std::abs(x) + 0.01)) << m << " " << b << " " << k;
    EXPECT_NEAR(pv.x, v, 2e-4 * (std::abs(v) + 1)) << m << " " << b << " " << k;
  }
}

TEST(SpringDamper, IsStableForAnyStiffness) {
  for (double k = 1; k < 1e12; k *= 10) {
    const SpringDamper spring(0.1, 1, k, kStep);
    Vec3 x(1, 0, 0), v(0);
    for (int i = 0; i < 100000; ++i) spring.advance(x, v);
    ASSERT_LT(std::abs(x.x), 1e-6) << k;
  }
}

SimulatedDeviceSettings ideal_device() {
  SimulatedDeviceSettings s;
  s.friction = 0;
  s.resolution = 1e-12;
  return s;
}

TEST(SimulatedStylus, SettlesInTheEquilibriumOfHandAndForce) {
  const HandImpedance hand;
  SimulatedStylus stylus(ideal_device(), hand, 0.12, 0.06, kStep);
  stylus.reset({{0, 0, 0.1}, {0, 0, 0}, {0, 0, 1}});
  const Vec3 force1(0.4, 0, 1), force2(-0.2, 0.1, 0.2);
  servo::DeviceReading reading;
  for (int i = 0; i < 5000; ++i) {
    stylus.write(force1, force2);
    reading = stylus.read();
  }
  const Vec3 grip = 0.5 * (reading.stylus.tip + reading.stylus.tail);
  EXPECT_NEAR(glm::length(grip - (Vec3(0, 0, 0.1) + (force1 + force2) / hand.stiffness)), 0, 1e-9);
  // Moments balance too: turn_stiffness * angle = what the ends' forces give about the grip.
  const Vec3 axis = glm::normalize(reading.stylus.tail - reading.stylus.tip);
  const double angle = std::acos(axis.z);
  const Vec3 torque = glm::cross(axis, 0.06 * force2 - 0.06 * force1);
  EXPECT_NEAR(hand.turn_stiffness * angle, glm::length(torque), 1e-6);
  EXPECT_NEAR(glm::length(reading.stylus.tail - reading.stylus.tip), 0.12, 1e-9);
}

/// The stylus after one tick from rest in one direction, with the hand's target in another, in long
/// double.
struct Turned {
  using Vec = glm::vec<3, long double, glm::highp>;
  Vec axis;

  Turned(const Vec& from, const Vec& target, long double share) {
    const Vec c = glm::cross(target, from);
    const long double sine = glm::length(c);
    const long double angle = share * std::atan2(sine, glm::dot(target, from));
    const Vec k = c / sine;
    axis = glm::normalize(std::cos(angle) * target + std::sin(angle) * glm::cross(k, target));
  }
};

// The series for small angles agree with the sines to the last digits, and both branches meet.
TEST(SimulatedStylus, TurnsByRodriguesFormulaToTheLastDigits) {
  SimulatedDeviceSettings device = ideal_device();
  device.resolution = 1e-17;
  const HandImpedance hand;
  const double inertia = device.end_mass * 2 * 0.06 * 0.06;
  Vec3 away(1, 0, 0), spin(0);
  SpringDamper(inertia, hand.turn_damping, hand.turn_stiffness, kStep).advance(away, spin);
  const auto share = static_cast<long double>(away.x);  // of the angle that remains after a tick
  const Vec3 target = glm::normalize(Vec3(0.3, -0.2, 0.9));
  const Vec3 side = glm::normalize(glm::cross(target, Vec3(0.5, 0.8, -0.1)));
  for (double angle = 1e-9; angle < 3; angle *= 1.09) {
    const Vec3 from = std::cos(angle) * target + std::sin(angle) * side;
    SimulatedStylus stylus(device, hand, 0.12, 0.06, kStep);
    stylus.reset({{0, 0, 0}, {0, 0, 0}, from});
    stylus.set_target({{0, 0, 0}, {0, 0, 0}, target});
    const rendering::LineProbe probe = stylus.read().stylus;
    const Turned expected(from, target, share);
    for (int k = 0; k < 3; ++k) {
      EXPECT_NEAR(probe.tail[k], static_cast<double>(0.06L * expected.axis[k]), 3e-17) << angle;
      EXPECT_NEAR(probe.tip[k], static_cast<double>(-0.06L * expected.axis[k]), 3e-17) << angle;
    }
  }
}

TEST(SimulatedStylus, FollowsAMovingTargetWithoutLagByTheHandsDamper) {
  SimulatedDeviceSettings device = ideal_device();
  device.damping = 0;
  SimulatedStylus stylus(device, HandImpedance{}, 0.12, 0.06, kStep);
  stylus.reset({{0, 0, 0}, {0, 0, 0}, {0, 0, 1}});
  Vec3 target(0);
  const Vec3 velocity(0.06, 0, 0);
  for (int i = 0; i < 2000; ++i) {
    target += kStep * velocity;
    stylus.set_target({target, velocity, {0, 0, 1}});
    stylus.read();
  }
  EXPECT_NEAR(stylus.grip().x, target.x, 1e-4);
}

TEST(SimulatedStylus, CoulombFrictionStopsASlowMotion) {
  SimulatedDeviceSettings device = ideal_device();
  device.friction = 0.5;
  SimulatedStylus stylus(device, HandImpedance{}, 0.12, 0.06, kStep);
  stylus.reset({{0, 0, 0}, {0, 0, 0}, {0, 0, 1}});
  stylus.set_target({{0.001, 0, 0}, {0, 0, 0}, {0, 0, 1}});  // 0.4 N pull: less than the friction
  for (int i = 0; i < 2000; ++i) stylus.read();
  EXPECT_NEAR(stylus.grip().x, 0, 1e-6);
}

TEST(SimulatedStylus, EndsAreQuantisedAndStayInTheWorkspace) {
  SimulatedDeviceSettings device;
  SimulatedStylus stylus(device, HandImpedance{}, 0.12, 0.06, kStep);
  stylus.reset({{0.01234567, 0.02, -0.03}, {0, 0, 0}, glm::normalize(Vec3(1, 2, 3))});
  const rendering::LineProbe probe = stylus.read().stylus;
  for (const Vec3& end : {probe.tip, probe.tail}) {
    for (int k = 0; k < 3; ++k) {
      const double steps = end[k] / device.resolution;
      EXPECT_NEAR(steps, std::round(steps), 1e-6);
    }
  }
  stylus.set_target({{1, 0, 0}, {0, 0, 0}, {0, 0, 1}});
  for (int i = 0; i < 5000; ++i) stylus.read();
  EXPECT_LE(glm::length(stylus.grip()), device.workspace_radius + 1e-12);
}

}  // namespace
}  // namespace palpate::runner::devices
