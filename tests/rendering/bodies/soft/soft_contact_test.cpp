// A tool on a soft body: Hertz, several contacts, the two rates, and the rules of a servo.

#include "rendering/bodies/soft/soft_contact.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <vector>

#include "data/base/random.h"
#include "rendering/bodies/soft/segment_triangle.h"
#include "rendering/bodies/soft/soft_object.h"
#include "runner/evidence/tick_meters.h"

namespace palpate::rendering {
namespace {

PlacedTool one_segment(const Vec3& along) {
  PlacedTool tool;
  tool.count = 1;
  tool.segments[0] = {Vec3(0), along};
  return tool;
}

SoftObject slab(double young, double rate, const SoftContactSettings& contact, int resolution = 6) {
  const int half = std::max(2, resolution / 2);
  stimuli::SolidMesh mesh =
      stimuli::mesh_of_box({0.06, 0.06, 0.03}, {resolution, resolution, half});
  std::vector<std::uint32_t> held;
  for (std::uint32_t i = 0; i < mesh.nodes.size(); ++i) {
    if (mesh.nodes[i].z < -0.01499) held.push_back(i);
  }
  return {std::make_shared<const SoftBody>(
              mesh, held, SoftSettings{.material = {.young = young}, .step = 1 / rate}),
          contact, 0};
}

/// Presses from above the surface to a depth, at 20 mm/s, and holds.
class Press {
 public:
  Press(const SoftObject& object, const PlacedTool& tool, const Vec3& above)
      : object_(object), state_(initial_state(object)), tool_(tool), at_(above) {
    at_.z = 0.015 + object.contact.radius + 0.001;
  }

  Vec3 to_depth(double depth, int ticks) {
    Vec3 force(0);
    for (int i = 0; i < ticks; ++i) {
      const double goal = 0.015 + object_.contact.radius - depth;
      const double step = std::clamp(goal - at_.z, -2e-5, 2e-5);
      at_.z += step;
      force = advance(object_, state_, at_, tool_, std::abs(step), 0.001);
    }
    return force;
  }
  const SoftObjectState& state() const { return state_; }

 private:
  const SoftObject& object_;
  SoftObjectState state_;
  PlacedTool tool_;
  Vec3 at_;
};

TEST(SegmentDistance, IsTheLeastOverAFineGrid) {
  constexpr std::uint64_t kSeed = 11;
  Random random(kSeed);
  const auto place = [&] { return Vec3(random.unit(), random.unit(), random.unit()); };
  for (int n = 0; n < 200; ++n) {
    const Vec3 a = place(), b = place(), c = place();
    const Segment own{place(), place() - Vec3(0.5)}, other{place(), place() - Vec3(0.5)};
    const NearestOnSegments at = nearest_on_segments(own, other);
    const double least =
        glm::distance(own.from + at.own * own.along, other.from + at.other * other.along);
    const double to_triangle = distance_to_triangle(own, a, b, c);
    for (int i = 0; i <= 20; ++i) {
      const Vec3 p = own.from + i / 20.0 * own.along;
      for (int k = 0; k <= 20; ++k) {
        EXPECT_LE(least, glm::distance(p, other.from + k / 20.0 * other.along) + 1e-12);
        for (int l = 0; k + l <= 20; ++l) {
          const Vec3 q = a + k / 20.0 * (b - a) + l / 20.0 * (c - a);
          ASSERT_LE(to_triangle, glm::distance(p, q) + 1e-12);
        }
      }
    }
  }
}

TEST(SoftContact, SpringBetweenVirtualAndIdealToolGivesForce) {
  const SoftObject object = slab(20000, 250, {});
  Press press(object, one_segment(Vec3(0, 0, 0.1)), {0.0003, 0.0002, 0});
  const Vec3 force = press.to_depth(0.004, 800);
  EXPECT_GT(force.z, 0.1);
  EXPECT_LT(glm::length(force - 800.0 * press.state().contact.shift), 1e-12);
  Vec3 sum(0), on_body(0);
  for (const SoftContact& c : press.state().contact.contacts) sum += c.force * c.normal;
  for (const NodeForce& f : press.state().contact.forces) on_body += f.force;
  EXPECT_LT(glm::length(force - sum), 1e-12);
  EXPECT_LT(glm::length(force + on_body), 1e-12);
}

TEST(SoftContact, BodyBearsFeltForceUnderTheRestingTool) {
  const SoftObject object = slab(20000, 250, {});
  Press press(object, one_segment(Vec3(0, 0, 0.1)), {0.0003, 0.0002, 0});
  const Vec3 force = press.to_depth(0.004, 1500);
  // The body's own equilibrium: the fixed nodes bear the tool's force.
  const SoftState& body = press.state().body;
  Vec3 held(0);
  for (std::size_t i = 0; i < body.x.size(); ++i) {
    if (object.body->mesh().nodes[i].z < -0.01499) held += body.gradient[i];
  }
  EXPECT_LT(glm::length(held - force), 1e-4 * glm::length(force));
  // No edge of the surface is inside the ideal tool by more than 1 % of its radius.
  const Vec3 tip = Vec3(0.0003, 0.0002, 0.013) + press.state().contact.shift;
  for (const auto& [a, b, c] : object.body->surface()) {
    EXPECT_GT(distance_to_triangle({tip, Vec3(0, 0, 0.1)}, body.x[a], body.x[b], body.x[c]),
              0.99 * 0.002);
  }
}

/// Force of a ball pressed into a slab, divided by that of Hertz with the slab's thickness
/// (Dimitriadis et al. 2002, bonded, incompressible).
double ball_against_theory(int resolution) {
  constexpr double kRadius = 0.02;
  const SoftObject object =
      slab(20000, 250, {.radius = kRadius, .stiffness = 1e5, .most = 128}, resolution);
  Press press(object, one_segment(Vec3(0)), {0.0003, 0.0002, 0});
  const double force = press.to_depth(0.002, 600).z;
  const double depth = 0.002 - press.state().contact.shift.z;
  const double x = std::sqrt(kRadius * depth) / 0.03;
  const double thin = 1 + x * (1.133 + x * (1.283 + x * (0.769 + x * 0.0975)));
  const double modulus = 20000 / (1 - 0.45 * 0.45);
  return force / (4.0 / 3 * modulus * std::sqrt(kRadius) * std::pow(depth, 1.5) * thin);
}

TEST(SoftContact, FinerMeshesBringABallNearerToHertz) {
  const double coarse = ball_against_theory(4), fine = ball_against_theory(10);
  EXPECT_GT(fine, 0.9);
  EXPECT_LT(fine, 1.25);
  EXPECT_LT(fine - 1, 0.5 * (coarse - 1));
}

TEST(SoftContact, SettlesWhateverTheStiffnessAndTheRates) {
  for (const double young : {1e3, 1e5, 1e7}) {
    for (const double rate : {62.5, 250.0, 1000.0}) {
      for (const double stiffness : {200.0, 3000.0}) {
        const SoftObject object = slab(young, rate, {.stiffness = stiffness}, 4);
        Press press(object, one_segment(Vec3(0, 0, 0.1)), {0.0003, 0.0002, 0});
        press.to_depth(0.003, 1500);
        double low = INFINITY, high = 0;
        for (int i = 0; i < 200; ++i) {
          const double force = press.to_depth(0.003, 1).z;
          low = std::min(low, force);
          high = std::max(high, force);
        }
        EXPECT_GT(low, 0);
        EXPECT_LT(high - low, 5e-3 * high) << young << " Pa " << rate << " Hz " << stiffness;
      }
    }
  }
}

/// Presses straight down to far below the base, at `speed`, and checks every tick.
void press_through(double thickness, double radius, double stiffness, double speed) {
  stimuli::SolidMesh mesh = stimuli::mesh_of_box({0.06, 0.06, thickness}, {6, 6, 3});
  std::vector<std::uint32_t> held;
  for (std::uint32_t i = 0; i < mesh.nodes.size(); ++i) {
    if (mesh.nodes[i].z < -0.499 * thickness) held.push_back(i);
  }
  const SoftObject object(
      std::make_shared<const SoftBody>(mesh, held,
                                       SoftSettings{.material = {.young = 20000}, .step = 0.004}),
      {.radius = radius, .stiffness = stiffness}, 0);
  SoftObjectState state = initial_state(object);
  Vec3 at(0.0003, 0.0002, thickness / 2 + radius + 0.001), last(0);
  const double goal = radius - thickness / 2 - 0.02;
  const double fall = speed * 0.001;
  const int ticks = static_cast<int>((at.z - goal) / fall) + 200;
  for (int i = 0; i < ticks; ++i) {
    const double step = std::max(-fall, goal - at.z);
    at.z += step;
    const Vec3 force = advance(object, state, at, one_segment(Vec3(0, 0, 0.1)), -step, 0.001);
    ASSERT_GE(force.z, -1e-9) << "pulled in at " << at.z;
    ASSERT_LE(std::hypot(force.x, force.y), 0.25 * force.z + 0.05) << "at " << at.z;
    // A spring pushed by a step, plus the body's response within a tick.
    ASSERT_LE(glm::length(force - last), stiffness * fall + 0.08 * glm::length(force) + 0.05);
    ASSERT_GE(at.z + state.contact.shift.z, 0.98 * radius - thickness / 2) << "through the base";
    last = force;
  }
  EXPECT_GT(last.z, 0.8 * stiffness * 0.02);  // rests on the base
}

TEST(SoftContact, PushesBackAndHoldsPressedToItsBase) {
  for (const double speed : {0.01, 0.08, 0.5}) {
    SCOPED_TRACE(speed);
    press_through(0.03, 0.004, 2000, speed);
    press_through(0.003, 0.002, 800, speed);
  }
}

TEST(SoftContact, SeveralSegmentsOfOneToolPressAtOnce) {
  const SoftObject object = slab(20000, 250, {});
  PlacedTool fork;
  fork.count = 3;
  for (int i = 0; i < 3; ++i)
    fork.segments[static_cast<std::size_t>(i)] = {Vec3(0.015 * (i - 1), 0, 0), Vec3(0, 0, 0.05)};
  Press press(object, fork, {0.0003, 0.0002, 0});
  const Vec3 all = press.to_depth(0.003, 800);
  double share[3] = {};
  for (const SoftContact& c : press.state().contact.contacts) share[c.segment] += c.force;
  for (const double s : share) EXPECT_GT(s, 0.2 * all.z);
  Press alone(object, one_segment(Vec3(0, 0, 0.05)), {0.0003, 0.0002, 0});
  const double one = alone.to_depth(0.003, 800).z;
  EXPECT_GT(all.z, 1.2 * one);
  EXPECT_LT(all.z, 3 * one);  // each lowers the surface for the others
}

TEST(SoftContact, StartInsideHasNoForceUntilItLeaves) {
  const SoftObject object = slab(20000, 250, {});
  SoftObjectState state = initial_state(object);
  const PlacedTool tool = one_segment(Vec3(0, 0, 0.1));
  const auto force_at = [&](double z) {
    return glm::length(advance(object, state, {0, 0, z}, tool, 0.001, 0.001));
  };
  EXPECT_EQ(force_at(0), 0);
  EXPECT_EQ(force_at(0.01), 0);
  EXPECT_EQ(force_at(0.018), 0);
  for (double z = 0.018; z > 0.014; z -= 0.0005) force_at(z);
  EXPECT_GT(force_at(0.014), 0);
}

TEST(SoftContact, ATickNeitherAllocatesNorGivesNaN) {
  const SoftObject object = slab(5000, 250, {.most = 16});
  SoftObjectState state = initial_state(object);
  const PlacedTool tool = one_segment(Vec3(0.06, 0.01, 0.0));
  constexpr std::uint64_t kSeed = 19;
  Random random(kSeed);
  Vec3 tip(-0.03, 0, 0.03);
  const std::uint64_t before = runner::evidence::allocations();
  for (int i = 0; i < 3000; ++i) {
    const Vec3 step = 0.001 * Vec3(random.unit() - 0.5, random.unit() - 0.5, random.unit() - 0.55);
    tip += step;
    if (tip.z < -0.02) tip.z = 0.03;
    const Vec3 force = advance(object, state, tip, tool, glm::length(step), 0.001);
    ASSERT_TRUE(std::isfinite(force.x + force.y + force.z));
  }
  EXPECT_EQ(runner::evidence::allocations(), before);
}

TEST(SoftContact, SamePathGivesSameForcesToTheBit) {
  const SoftObject object = slab(20000, 250, {});
  Press first(object, one_segment(Vec3(0, 0, 0.1)), {0.0003, 0.0002, 0});
  Press second(object, one_segment(Vec3(0, 0, 0.1)), {0.0003, 0.0002, 0});
  for (int i = 0; i < 50; ++i) EXPECT_EQ(first.to_depth(0.003, 7), second.to_depth(0.003, 7));
}

}  // namespace
}  // namespace palpate::rendering
