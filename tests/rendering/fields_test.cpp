// Fields and knocks, against closed forms.

#include "rendering/fields.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

#include "data/base/random.h"
#include "rendering/bodies/moving_scene.h"
#include "rendering/renderer.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/primitives.h"
#include "tests/shared/render_checks.h"

namespace palpate::rendering {
namespace {

using stimuli::FieldSpec;
using testing::kTick;
using Kind = FieldSpec::Kind;

constexpr double kLength = 0.12;  // m, of the stylus

FieldSpec field(Kind kind) {
  FieldSpec out;
  out.kind = kind;
  out.low_pass = 0;
  return out;
}

/// Fields alone, or with objects.
class Felt {
 public:
  explicit Felt(std::vector<FieldSpec> fields, const Renderer& renderer = ray_renderer(),
                std::vector<SceneObject> objects = {},
                std::optional<stimuli::TransientSpec> transient = {}, const Pose& pose = {})
      : renderer_(renderer), scene_(std::move(objects)) {
    scene_.set_effects({{{0, pose, false, std::move(fields), transient}}, 0.06});
    state_ = scene_.initial_state();
  }
  Rendering tick(const Vec3& tip, double dt = kTick, const Vec3& along = {0, 0, 1}) {
    return renderer_.tick(scene_, state_, {tip, tip + kLength * along}, dt);
  }
  const Scene& scene() const { return scene_; }

 private:
  const Renderer& renderer_;
  Scene scene_;
  RenderState state_;
};

TEST(Fields, NoneLeavesTheSceneAsItWas) {
  Scene scene(
      {testing::placed_object(std::make_shared<const stimuli::ConvexMesh>(stimuli::cube(0.1)))});
  const std::size_t before = scene.features_index();
  scene.set_effects({{{0, {}, false, {}, stimuli::TransientSpec{0, 100, 0.01}}}, 0.06});
  EXPECT_EQ(scene.effects(), nullptr);
  EXPECT_EQ(scene.features_index(), before);
  EXPECT_TRUE(scene.initial_state().effects.velocities.empty());
}

TEST(Fields, ConstantPushesTheTip) {
  FieldSpec constant = field(Kind::constant);
  constant.force = {0.5, -1, 2};
  Felt felt({constant});
  const Rendering out = felt.tick({0.01, 0.02, 0.03});
  EXPECT_EQ(out.force, constant.force);
  EXPECT_EQ(out.torque, Vec3(0));
  EXPECT_EQ(out.device1, constant.force);
  EXPECT_EQ(out.contacts, 0);
}

TEST(Fields, GripIsHalfTheStylusFromTheTip) {
  FieldSpec constant = field(Kind::constant);
  constant.force = {1, 0, 0};
  constant.at_grip = true;
  const Rendering ray = Felt({constant}).tick({0, 0, 0});
  EXPECT_EQ(ray.device1, Vec3(0.5, 0, 0));
  EXPECT_EQ(ray.device2, Vec3(0.5, 0, 0));
  EXPECT_EQ(ray.torque, Vec3(0, 0.06, 0));
  const Rendering point = Felt({constant}, point_renderer()).tick({0, 0, 0});
  EXPECT_EQ(point.device1, constant.force);
  EXPECT_EQ(point.torque, Vec3(0));
}

TEST(Fields, SpringPullsFromOutsideItsBall) {
  FieldSpec spring = field(Kind::spring);
  spring.centre = {0.01, 0, 0};
  spring.radius = 0.005;
  spring.stiffness = 200;
  Felt felt({spring});
  EXPECT_EQ(felt.tick({0.012, 0.003, 0}).force, Vec3(0));
  const Vec3 force = felt.tick({0.01, 0.025, 0}).force;
  EXPECT_NEAR(glm::length(force - Vec3(0, -200 * 0.02, 0)), 0, 1e-12);
}

TEST(Fields, ChannelPullsToItsSegment) {
  FieldSpec channel = field(Kind::channel);
  channel.centre = {0, 0, 0};
  channel.to = {0.1, 0, 0};
  channel.radius = 0.001;
  channel.stiffness = 1000;
  Felt felt({channel});
  EXPECT_EQ(felt.tick({0.05, 0.0009, 0}).force, Vec3(0));
  EXPECT_NEAR(glm::length(felt.tick({0.05, 0.003, 0}).force - Vec3(0, -2, 0)), 0, 1e-12);
  EXPECT_NEAR(glm::length(felt.tick({-0.003, 0, 0}).force - Vec3(2, 0, 0)), 0, 1e-12);
}

TEST(Fields, ElasticOnesMakeNoEnergy) {
  FieldSpec spring = field(Kind::spring), channel = field(Kind::channel);
  spring.stiffness = channel.stiffness = 300;
  spring.radius = channel.radius = 0.004;
  channel.to = {0.05, 0.01, 0};
  Felt felt({spring, channel});
  double work = 0, way = 0;
  Vec3 last, last_force;
  constexpr int kSteps = 40'000;
  for (int i = 0; i <= kSteps; ++i) {
    const double a = 2 * std::numbers::pi * i / kSteps;
    const Vec3 tip(0.03 * std::cos(a), 0.02 * std::sin(2 * a), 0.02 * std::sin(a));
    const Vec3 force = felt.tick(tip).force;
    if (i > 0) {
      const Vec3 mean = 0.5 * (force + last_force);
      work += glm::dot(mean, tip - last);
      way += glm::length(mean) * glm::length(tip - last);
    }
    last = tip;
    last_force = force;
  }
  EXPECT_NEAR(work, 0, 1e-7 * way);
}

TEST(Fields, ViscousTakesTheSquareOfTheSpeed) {
  FieldSpec viscous = field(Kind::viscous);
  viscous.damping = Mat3(8);
  Felt felt({viscous});
  EXPECT_EQ(felt.tick({0, 0, 0}).force, Vec3(0));
  const Vec3 force = felt.tick({0.0003, 0, 0}).force;
  EXPECT_NEAR(glm::dot(force, Vec3(0.3, 0, 0)), -8 * 0.3 * 0.3, 1e-12);
}

TEST(Fields, LowPassApproachesTheSpeed) {
  FieldSpec viscous = field(Kind::viscous);
  viscous.damping = Mat3(1);
  viscous.low_pass = 0.002;
  Felt felt({viscous});
  double force = 0;
  for (int i = 0; i <= 5; ++i) force = felt.tick({0.0001 * i, 0, 0}).force.x;
  EXPECT_NEAR(force, -0.1 * (1 - std::pow(2.0 / 3, 5)), 1e-12);
}

TEST(Fields, CurlDoesNoWorkStraightAhead) {
  FieldSpec curl = field(Kind::curl);
  curl.damping = Mat3(15);
  curl.low_pass = 0.002;
  Felt felt({curl});
  for (int i = 0; i < 100; ++i) {
    const Vec3 force = felt.tick({0.0003 * i, 0, 0}).force;
    EXPECT_NEAR(force.x, 0, 1e-12);
    if (i > 50) {
      EXPECT_NEAR(force.y, 15 * 0.3, 1e-8);  // right-handed about +z
    }
  }
}

/// W, over whole turns of a circle.
double measured_power(double turn, double low_pass) {
  FieldSpec curl = field(Kind::curl);
  curl.damping = Mat3(15);
  curl.low_pass = low_pass;
  Felt felt({curl});
  const double radius = 0.3 / std::abs(turn);
  const auto at = [&](int i) {
    return radius * Vec3(std::cos(turn * i * kTick), std::sin(turn * i * kTick), 0);
  };
  double work = 0;
  constexpr int kSettle = 2000, kTicks = 2000;
  for (int i = 0; i < kSettle + kTicks; ++i) {
    const Vec3 force = felt.tick(at(i)).force;
    if (i >= kSettle) work += glm::dot(force, at(i + 1) - at(i));
  }
  return work / (kTicks * kTick);
}

TEST(Fields, CurlPowerIsTheClosedForm) {
  for (const double low_pass : {0.0, 0.002, 0.01}) {
    for (const double turn : {6.0, -6.0}) {
      const double expected = curl_power(15, 0.3, turn, kTick, low_pass);
      EXPECT_NEAR(measured_power(turn, low_pass), expected, 1e-12);
    }
  }
  EXPECT_NEAR(std::abs(curl_power(15, 0.3, 6, kTick, 0)), 0.008, 0.0005);
  EXPECT_NEAR(std::abs(curl_power(15, 0.3, 6, kTick, 0.01)), 0.089, 0.001);
}

SceneObject cube() {
  return testing::placed_object(std::make_shared<const stimuli::ConvexMesh>(stimuli::cube(0.1)));
}

TEST(Fields, VibrationWaitsForContact) {
  FieldSpec vibration = field(Kind::vibration);
  vibration.axis = {1, 0, 0};
  vibration.amplitude = 0.5;
  vibration.frequency = 50;
  FieldSpec always = vibration;
  always.always = true;
  Felt waiting({vibration}, point_renderer(), {cube()}), ever({always}, point_renderer(), {cube()});
  for (int i = 0; i < 40; ++i) {
    const double z = i < 20 ? 0.06 : 0.049;
    const double expected = 0.5 * std::sin(2 * std::numbers::pi * 50 * kTick * i);
    EXPECT_NEAR(waiting.tick({0, 0, z}).force.x, i < 20 ? 0 : expected, 1e-12);
    EXPECT_NEAR(ever.tick({0, 0, z}).force.x, expected, 1e-12);
  }
}

TEST(Fields, TurnWithTheirObject) {
  FieldSpec constant = field(Kind::constant);
  constant.force = {1, 0, 0};
  const Pose turned{{0, 0, 0}, Quat(std::sqrt(0.5), 0, 0, std::sqrt(0.5))};
  Felt felt({constant}, point_renderer(), {}, {}, turned);
  EXPECT_NEAR(glm::length(felt.tick({0, 0, 0}).force - Vec3(0, 1, 0)), 0, 1e-15);
}

TEST(Fields, PoseThatIsNotFiniteGivesNoForce) {
  FieldSpec constant = field(Kind::constant);
  constant.force = {1, 0, 0};
  Felt felt({constant});
  felt.tick({0, 0, 0});
  const Rendering out = felt.tick({std::numeric_limits<double>::quiet_NaN(), 0, 0});
  EXPECT_EQ(out.force, Vec3(0));
  EXPECT_NE(out.faults & render_fault::kNonFinite, 0U);
  EXPECT_EQ(felt.tick({0, 0, 0}).force, constant.force);
}

TEST(ContactTransient, ImpulseIsTheClosedForm) {
  const stimuli::TransientSpec knock{10, 100, 0.01};
  constexpr double kStep = 1e-6;
  double impulse = 0, peak = 0;
  for (int i = 0; i < 200'000; ++i) {
    const double force = knock_force(knock, 0.2, i * kStep);
    impulse += force * kStep;
    peak = std::max(peak, force);
  }
  const double w = 2 * std::numbers::pi * 100, tau = 0.01;
  EXPECT_NEAR(impulse, 10 * 0.2 * w / (1 / (tau * tau) + w * w), 1e-8);
  EXPECT_NEAR(impulse, 3.1045e-3, 1e-7);
  EXPECT_NEAR(peak, 1.5774, 1e-4);
}

/// N s, of the knock alone: presses at 0.2 m/s, then holds still at 10 mm.
double held_impulse(double frequency) {
  const stimuli::TransientSpec knock{10, frequency, 0.01};
  SceneObject hard = cube();
  hard.material.stiffness = 5000;  // the knock never pulls
  Felt with({}, point_renderer(), {hard}, knock), without({}, point_renderer(), {hard});
  double impulse = 0;
  for (int i = 0; i < 300; ++i) {
    const Vec3 tip(0, 0, 0.05 - 0.0002 * std::clamp(i - 5, -5, 20));
    impulse += (with.tick(tip).force.z - without.tick(tip).force.z) * kTick;
  }
  return impulse;
}

TEST(ContactTransient, TicksKeepMostOfALowImpulse) {
  for (const auto& [frequency, share] : {std::pair{100.0, 0.966}, {250.0, 0.785}, {300.0, 0.684}}) {
    const double w = 2 * std::numbers::pi * frequency, tau = 0.01;
    const double whole = 10 * 0.2 * w / (1 / (tau * tau) + w * w);
    EXPECT_NEAR(held_impulse(frequency) / whole, share, 0.01) << frequency;
  }
}

TEST(ContactTransient, NeverPullsAndArmsAgain) {
  Felt felt({}, ray_renderer(), {cube()}, stimuli::TransientSpec{100, 100, 0.05});
  const auto knock = [&](int pause) {
    for (int i = 0; i < pause; ++i) felt.tick({0, 0, 0.051});
    double most = 0;
    for (int i = 0; i < 40; ++i) {
      const Rendering out = felt.tick({0, 0, 0.0499});
      EXPECT_GE(out.force.z, 0);
      EXPECT_NEAR(glm::length(out.device1 + out.device2 - out.force), 0, 1e-12);
      most = std::max(most, out.force.z);
    }
    return most;
  };
  EXPECT_GT(knock(30), 10);   // 1 m/s at most
  EXPECT_LT(knock(10), 0.1);  // not armed
  EXPECT_GT(knock(30), 10);
}

}  // namespace
}  // namespace palpate::rendering
