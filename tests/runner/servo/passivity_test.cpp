// The passivity controller: dissipates the energy of sampling, never pushes, and forgets the
// previous trial.

#include "runner/servo/passivity.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <functional>
#include <glm/geometric.hpp>
#include <limits>

#include "data/base/random.h"
#include "runner/servo/servo.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/primitives.h"
#include "tests/runner/fake_device.h"

namespace palpate::runner::servo {
namespace {

constexpr double kTick = 1e-3;

/// A mass of 0.1 kg on a sampled and held spring: without damping its oscillation must grow.
double swing_after(double stiffness, bool controlled, int ticks) {
  PassivityController control({}, kTick);
  constexpr double kMass = 0.1;
  double x = 1e-3, v = 0, most = 0;
  for (int i = 0; i < ticks; ++i) {
    const DeviceForces scene{Vec3(0, 0, -stiffness * x), Vec3(0), false};
    double force = scene.device1.z;
    if (controlled) {
      const Vec3 at(0, 0, x);
      force += control.damping({at, at}, scene).device1.z;
      control.commanded({Vec3(0, 0, force), Vec3(0), false});
    }
    x += v * kTick + 0.5 * force / kMass * kTick * kTick;
    v += force / kMass * kTick;
    if (i > ticks - 200) most = std::max(most, std::abs(x));
  }
  return most;
}

TEST(Passivity, ASampledSpringGrowsOnlyWithoutTheController) {
  for (const double stiffness : {300.0, 3000.0, 10000.0}) {
    EXPECT_GT(swing_after(stiffness, false, 1000), 2e-3) << stiffness;
    EXPECT_LT(swing_after(stiffness, true, 1000), 1.01e-3) << stiffness;
  }
}

TEST(Passivity, NeverPushesAlongTheMotion) {
  PassivityController control({}, kTick);
  constexpr std::uint64_t kSeed = 7;
  Random random(kSeed);
  const auto any = [&random] {
    return Vec3(random.unit() - 0.5, random.unit() - 0.5, random.unit() - 0.5);
  };
  Vec3 tip, tail;
  int acted = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vec3 step1 = 1e-3 * any(), step2 = 1e-3 * any();
    tip += step1;
    tail += step2;
    const DeviceForces scene{5.0 * any(), i % 3 == 0 ? Vec3(0) : 5.0 * any(), false};
    const DeviceForces damping = control.damping({tip, tail}, scene);
    ASSERT_LE(glm::dot(damping.device1, step1), 0);
    ASSERT_LE(glm::dot(damping.device2, step2), 0);
    const double most = PassivitySettings{}.most_damping / kTick;
    ASSERT_LE(glm::length(damping.device1), most * glm::length(step1) * (1 + 1e-12));
    acted += damping.device1 != Vec3(0) ? 1 : 0;
    control.commanded({scene.device1 + damping.device1, scene.device2 + damping.device2, false});
  }
  EXPECT_GT(acted, 1000);
}

TEST(Passivity, LeavesConstantForcesAndSlidesUndamped) {
  PassivityController control({}, kTick);
  const DeviceForces weight{Vec3(0, 0, -1), Vec3(0, 0, 2), false};
  for (int i = 0; i < 1000; ++i) {
    const Vec3 tip(1e-4 * i, 0, 1e-3 * std::sin(0.05 * i)), tail(0, 0, 1e-3 * std::cos(0.03 * i));
    const DeviceForces damping = control.damping({tip, tail}, weight);
    EXPECT_LT(glm::length(damping.device1) + glm::length(damping.device2), 1e-9) << i;
    control.commanded(weight);
  }
  control.reset();
  for (int i = 0; i < 1000; ++i) {  // across the normal of a deepening spring
    const double depth = 1e-6 * i;
    const DeviceForces scene{Vec3(0, 0, 2000 * depth), Vec3(0), false};
    const DeviceForces damping = control.damping({Vec3(1e-4 * i, 0, -depth), Vec3(0)}, scene);
    EXPECT_EQ(damping.device1.x, 0) << i;
    control.commanded({scene.device1 + damping.device1, Vec3(0), false});
  }
}

TEST(Passivity, ResetsItsAccount) {
  PassivityController control({}, kTick);
  const DeviceForces scene{Vec3(0, 0, 3), Vec3(0), false};
  (void)control.damping({Vec3(0), Vec3(0)}, {});
  control.commanded(scene);
  (void)control.damping({Vec3(0, 0, 1e-3), Vec3(0)}, {});  // excess energy of 3 mJ
  EXPECT_NEAR(control.excess(), 3e-3, 1e-12);
  control.reset();
  EXPECT_EQ(control.excess(), 0);
  EXPECT_EQ(control.damping({Vec3(5, 5, 5), Vec3(0)}, scene).device1, Vec3(0));  // no jump

  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(control.damping({Vec3(nan, 0, 0), Vec3(0)}, scene).device1, Vec3(0));
  EXPECT_EQ(control.excess(), 0);
  EXPECT_EQ(control.damping({Vec3(1, 0, 0), Vec3(0)}, scene).device1, Vec3(0));
  EXPECT_TRUE(std::isfinite(control.excess()));
}

/// Rests 0.6 s in the home zone, then moves up and down through the cube's face at 30 Hz.
DeviceReading knock(int tick) {
  const double z = tick < 600 ? 0.1
                              : std::max(0.0305, 0.1 - 1e-4 * (tick - 600)) +
                                    (tick > 1400 ? 1e-3 * std::sin(0.2 * (tick - 1400)) : 0);
  return {{{0, 0, z}, {0, 0, z + 0.12}}, 0, false};
}

double most_force(bool controlled, double limit, double* most_change = nullptr) {
  runner::testing::FakeDevice device(knock);
  VirtualClock clock;
  Servo servo(device, clock, 1000, {limit, 0.5, 0.2});
  if (controlled) servo.control_passivity();
  stimuli::Material material;
  material.stiffness = 3000;
  servo.prepare(rendering::Scene({{std::make_shared<const stimuli::ConvexMesh>(stimuli::cube(0.06)),
                                   Pose{}, material, 0, nullptr}}),
                rendering::point_renderer(), HomeZone{});
  double most = 0, sum = 0;
  Vec3 last;
  for (int tick = 0; tick < 3000; ++tick) {
    const Sample& sample = servo.tick();
    most = std::max(most, glm::length(sample.device1));
    if (most_change != nullptr)
      *most_change = std::max(*most_change, glm::length(sample.device1 - last));
    last = sample.device1;
    sum += glm::length(sample.device1);
  }
  servo.stop();
  return most_change != nullptr ? most : sum;
}

TEST(Passivity, TheServoKeepsItsLimitsWithTheController) {
  double change = 0;
  EXPECT_LE(most_force(true, 1.0, &change), 1.0 + 1e-12);
  EXPECT_GT(change, 0.05);
  EXPECT_LE(change, 0.5 + 1e-12);
  EXPECT_NE(most_force(true, 6.0), most_force(false, 6.0));  // it does act
}

}  // namespace
}  // namespace palpate::runner::servo
