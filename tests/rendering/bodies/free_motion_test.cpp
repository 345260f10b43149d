#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "rendering/bodies/body_world.h"
#include "rendering/bodies/one_sided_spring.h"
#include "rendering/bodies/rigid_motion.h"
#include "tests/rendering/bodies/body_fixtures.h"

namespace palpate::rendering::test {
namespace {

BodyInertia brick(double mass = 0.3) {
  const Mesh mesh = box_mesh({0.1, 0.2, 0.03});
  const stimuli::PlacedMesh part{mesh.get(), {}};
  return inertia_of(stimuli::with_mass(stimuli::moments_of_union({&part, 1}), mass));
}

TEST(FreeMotion, TumblingKeepsMomentumToTheBitAndEnergy) {
  const BodyInertia inertia = brick();
  BodyMotion m;
  m.orientation = glm::normalize(Quat(1, 0.2, 0.3, -0.4));
  m.velocity = {0.1, -0.2, 0.3};
  m.spin_momentum =
      spin_momentum_of(inertia, m.orientation, {0.3, 8, 0.2});  // about the middle axis: unstable
  const Vec3 momentum = m.spin_momentum;
  const double energy = kinetic_energy(inertia, m);
  double worst = 0;
  for (int i = 0; i < 10000; ++i) {
    move_freely(inertia, Vec3(0), 0, 1e-3, m);
    worst = std::max(worst, std::abs(kinetic_energy(inertia, m) / energy - 1));
  }
  EXPECT_EQ(m.spin_momentum, momentum);
  EXPECT_LE(worst, 1e-9);
  EXPECT_NEAR(glm::distance(m.centre, 10.0 * m.velocity), 0, 1e-11);
}

/// A coin's axis precesses about its momentum at L / I, with I the moment across the axis: twice
/// the spin rate, for a thin coin and a small angle.
TEST(FreeMotion, CoinPrecessesAtMomentumByMomentAcross) {
  const Mesh coin = mesh_of(stimuli::cylinder(0.012, 0.002, 64));
  const stimuli::PlacedMesh part{coin.get(), {}};
  const BodyInertia inertia =
      inertia_of(stimuli::with_mass(stimuli::moments_of_union({&part, 1}), 0.0075));
  BodyMotion m;
  m.spin_momentum = spin_momentum_of(inertia, m.orientation, {2, 0, 30});
  const Vec3 along = glm::normalize(m.spin_momentum);
  const double rate = glm::length(m.spin_momentum) / inertia.inertia[0][0];
  const double time = 2 * std::numbers::pi / rate;  // once around
  const Vec3 axis = m.orientation * Vec3(0, 0, 1);
  const int steps = 3 * static_cast<int>(time / 1e-3);
  for (int i = 0; i < steps; ++i) move_freely(inertia, Vec3(0), 0, 3 * time / steps, m);
  EXPECT_NEAR(glm::distance(m.orientation * Vec3(0, 0, 1), axis), 0, 1e-6);
  EXPECT_NEAR(glm::dot(m.orientation * Vec3(0, 0, 1), along), glm::dot(axis, along), 1e-9);
}

TEST(FreeMotion, GravityIsAParabolaAndDampingAnExponential) {
  const BodyInertia inertia = brick();
  BodyMotion m;
  m.velocity = {1, 0, 2};
  for (int i = 0; i < 1000; ++i) move_freely(inertia, {0, 0, -9.81}, 0, 1e-3, m);
  EXPECT_NEAR(m.centre.z, 2 - 9.81 / 2, 1e-12);
  EXPECT_NEAR(m.velocity.z, 2 - 9.81, 1e-12);
  BodyMotion damped;
  damped.velocity = {1, 0, 0};
  damped.spin_momentum = {0, 0, 0.001};
  for (int i = 0; i < 500; ++i) move_freely(inertia, Vec3(0), 3, 1e-3, damped);
  EXPECT_NEAR(damped.velocity.x, std::exp(-1.5), 1e-12);
  EXPECT_NEAR(damped.centre.x, (1 - std::exp(-1.5)) / 3, 1e-12);
  EXPECT_NEAR(damped.spin_momentum.z, 0.001 * std::exp(-1.5), 1e-15);
}

TEST(SpringPass, BouncesWithTheSpeedItCameWith) {
  for (const double mass : {1e-3, 0.03, 1.0, 10.0}) {
    for (const double stiffness : {200.0, 3000.0, 5e4}) {
      for (const double dt : {1e-3, 2e-4, 7e-3}) {
        double depth = -0.00123, speed = 0.7;
        bool met = false;
        double impulse = 0;
        for (int i = 0; i < 100000 && !(met && depth < 0); ++i) {
          const SpringPass pass = pass_spring({depth, speed, 0, mass, stiffness}, dt);
          met |= pass.impulse > 0;
          EXPECT_GE(pass.impulse, 0);
          impulse += pass.impulse;
          depth = pass.depth;
          speed = pass.speed;
        }
        EXPECT_NEAR(speed / -0.7, 1, 1e-9) << mass << " " << stiffness << " " << dt;
        EXPECT_NEAR(impulse / (2 * mass * 0.7), 1, 1e-9);
      }
    }
  }
}

/// Against small steps, under a constant load.
TEST(SpringPass, AgreesWithManySmallSteps) {
  const SpringStart start{-0.0002, 0.3, 9.81, 0.01, 2000};
  double depth = start.depth, speed = start.speed, impulse = 0;
  const int steps = 2000000;
  const double duration = 0.02, h = duration / steps;
  for (int i = 0; i < steps; ++i) {
    const double force = depth > 0 ? start.stiffness * depth : 0;
    speed += h * (start.growth - force / start.mass);
    depth += h * speed;
    impulse += h * force;
  }
  const SpringPass pass = pass_spring(start, duration);
  EXPECT_NEAR(pass.depth, depth, 1e-8);
  EXPECT_NEAR(pass.speed, speed, 1e-5);
  EXPECT_NEAR(pass.impulse, impulse, 1e-7);
}

TEST(SpringPass, AnUnmetSpringDoesNotPush) {
  for (const SpringStart& start :
       {SpringStart{-0.01, 0.5, 0, 1, 1000}, SpringStart{-0.01, -0.5, -9.81, 1, 1000},
        SpringStart{0, -1, 0, 1, 1000}}) {
    const SpringPass pass = pass_spring(start, 1e-3);
    EXPECT_EQ(pass.impulse, 0);
    EXPECT_EQ(pass.double_impulse, 0);
  }
}

}  // namespace
}  // namespace palpate::rendering::test
