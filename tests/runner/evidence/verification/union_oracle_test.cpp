// The oracle of contact with unions of convex parts: against closed forms and other brute force.
// By the definition of an ideal tool: union_oracle_audit_test.cpp.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <numbers>

#include "rendering/renderer.h"
#include "runner/evidence/verification/random_paths.h"
#include "runner/evidence/verification/random_solids.h"
#include "runner/evidence/verification/reference.h"
#include "runner/evidence/verification/union_cases.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/orientation.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"

namespace palpate::runner::evidence {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
const OracleTool kPoint{{Vec3(0), Vec3(0)}};

OracleTool stylus(double length) { return {{Vec3(0), Vec3(0, 0, length)}}; }

/// A frame with this +z.
Mat3 axes_along(const Vec3& z) {
  const Vec3 aside = std::abs(z.x) < 0.5 ? Vec3(1, 0, 0) : Vec3(0, 1, 0);
  const Vec3 x = glm::normalize(glm::cross(aside, z));
  return {x, glm::cross(z, x), z};
}

/// Leads an ideal tool along a path from outside.
class Led {
 public:
  Led(const UnionOracle& oracle, const OraclePose& start) : oracle_(oracle), ideal_(start) {
    EXPECT_LT(oracle.depth(start), 0);
  }

  OracleTick to(const OraclePose& virtual_tool) {
    const OracleTick tick = oracle_.tick(ideal_, virtual_tool);
    EXPECT_FALSE(tick.failed);
    ideal_ = tick.ideal;
    return tick;
  }

  /// In equal steps, without turning.
  /// \return the displacement at the end
  Vec3 straight_to(const Vec3& tip, int steps) {
    const Vec3 from = ideal_.tip;
    for (int i = 1; i <= steps; ++i) to({from + i / double(steps) * (tip - from), ideal_.axes});
    return ideal_.tip - tip;
  }

 private:
  const UnionOracle& oracle_;
  OraclePose ideal_;
};

void expect_near(const Vec3& found, const Vec3& expected, double tolerance, const char* what,
                 double of = 0) {
  EXPECT_LE(glm::length(found - expected), tolerance)
      << what << " " << of << ": " << found.x << " " << found.y << " " << found.z << " for "
      << expected.x << " " << expected.y << " " << expected.z;
}

// The sums are those of the brute-force reference for one part.
TEST(UnionOracle, DepthEqualsReference) {
  for (std::uint64_t seed = 0; seed < 300; ++seed) {
    Random random(seed, {1});
    const auto mesh = std::make_shared<const stimuli::ConvexMesh>(random_solid(random));
    const double size = mesh->size(), length = size * random.unit();
    const UnionOracle oracle({{mesh, Pose{}}}, stylus(length));
    for (int i = 0; i < 20; ++i) {
      const Vec3 axis = stimuli::uniform_rotation(random) * Vec3(0, 0, 1);
      const Vec3 tip =
          mesh->centre() + 0.7 * size * Vec3{random.unit(), random.unit(), random.unit()};
      const double reference = reference_depth(*mesh, {tip, tip + length * axis}).depth;
      if (reference <= 0) continue;
      EXPECT_NEAR(oracle.depth({tip, axes_along(axis)}), reference, 1e-12 * size) << seed;
    }
  }
}

// While the tool does not turn, the descent and the walk of the renderers follow the same facets.
TEST(UnionOracle, EqualsTheRenderersOnOneConvexPart) {
  long in_contact = 0, different = 0;
  for (std::uint64_t seed = 0; seed < 250; ++seed) {
    Random random(seed, {7});
    const auto mesh = std::make_shared<const stimuli::ConvexMesh>(random_solid(random));
    const double length = random.below(3) == 0 ? 0 : (0.05 + random.unit()) * mesh->size();
    const rendering::Renderer& renderer =
        length > 0 ? rendering::ray_renderer() : rendering::point_renderer();
    const auto kind = random.below(2) == 0 ? PathKind::smooth : PathKind::sliding;
    std::vector<rendering::LineProbe> path =
        random_path(random, kind, *mesh, length, length > 0, 200);
    const Vec3 along = path[0].tail - path[0].tip;
    const Mat3 axes = length > 0 ? axes_along(glm::normalize(along)) : Mat3(1);
    rendering::SceneObject object;
    object.mesh = mesh;
    const rendering::Scene scene({object}, true);
    rendering::RenderState state = scene.initial_state();
    const UnionOracle oracle({{mesh, Pose{}}}, stylus(length));
    OraclePose last{path[0].tip, axes};
    if (oracle.depth(last) > 0) continue;
    for (const rendering::LineProbe& pose : path) {
      const rendering::LineProbe probe{pose.tip, pose.tip + along};
      const rendering::Rendering r = renderer.tick(scene, state, probe, 1e-3);
      const OracleTick tick = oracle.tick(last, {probe.tip, axes});
      ASSERT_FALSE(tick.failed);
      in_contact += r.contacts > 0;
      different += glm::length(tick.ideal.tip - r.ideal.tip) > 1e-12 * mesh->size();
      last = {r.ideal.tip, axes};  // the same history
    }
  }
  EXPECT_GT(in_contact, 12'000);
  EXPECT_LE(different, 3) << "of " << in_contact;  // deep presses through a sliver
}

TEST(UnionOracle, GroovesOf2To178Degrees) {
  for (const double degrees : {2.0, 3.0, 5.0, 10.0, 30.0, 60.0, 90.0, 120.0, 150.0, 170.0, 178.0}) {
    const double opening = degrees * kDegree;
    for (const OracleTool& tool : {kPoint, stylus(0.12)}) {
      // The stylus upright in the middle of the groove, where it touches at its tip alone.
      const UnionOracle oracle(groove(opening), tool);
      constexpr std::uint64_t kSeed = 7;
      Random random(kSeed);
      for (int i = 0; i < 40; ++i) {
        const Vec3 bottom{0.002 * (random.unit() - 0.5), 0.02 * random.unit(),
                          -0.003 * random.unit()};
        Led led(oracle, {{0, 0.01, 0.055}, Mat3(1)});
        expect_near(led.straight_to(bottom, 50), groove_displacement(opening, bottom),
                    1e-15 / std::sin(opening / 2) + 1e-15, "opening, degrees", degrees);
      }
    }
  }
}

// The stylus lies in the valley: the same displacement at every opening.
TEST(UnionOracle, AStickInAGrooveRestsOnBothWalls) {
  for (const double degrees : {4.0, 45.0, 90.0, 175.0}) {
    const UnionOracle oracle(groove(degrees * kDegree), stylus(0.08));
    const Mat3 level = axes_along(Vec3(0, 1, 0));
    Led led(oracle, {{0, -0.03, 0.07}, level});
    led.straight_to({1e-5, -0.03, -0.002}, 70);
    const OracleTick tick = led.to({{1e-5, -0.03, -0.002}, level});
    expect_near(tick.ideal.tip, {0, -0.03, 0}, 1e-13, "opening, degrees", degrees);
    ASSERT_EQ(tick.contacts.size(), 2u) << degrees;
    for (const OracleContact& contact : tick.contacts) {
      EXPECT_NEAR(contact.first, 0, 1e-9);
      EXPECT_NEAR(contact.last, 0.08, 1e-9);
      EXPECT_GT(contact.share, 0);
    }
  }
}

TEST(UnionOracle, SeamsAreNotFelt) {
  for (const double overlap : {0.0, 1e-16, 1e-9, 0.003}) {
    OracleParts parts;
    for (int i = 0; i < 16; ++i) {
      parts.push_back(box_part({0.006 * i - 0.048, -0.05, -0.04},
                               {0.006 * (i + 1) - 0.048 + overlap, 0.05, 0}));
    }
    for (const OracleTool& tool : {kPoint, stylus(0.12)}) {
      const UnionOracle oracle(parts, tool);
      const Mat3 axes = axes_along(glm::normalize(Vec3(0.3, 0.1, 1)));
      Led led(oracle, {{-0.04, 0, 0.01}, axes});
      led.to({{-0.04, 0, -0.005}, axes});
      for (double x = -0.04; x < 0.04; x += 0.0007) {
        const OracleTick tick = led.to({{x, 0.3 * x, -0.005}, axes});
        expect_near(tick.ideal.tip, {x, 0.3 * x, 0}, 1e-16, "at x", x);
      }
    }
  }
}

TEST(UnionOracle, InTheCornerOfAStair) {
  const OracleParts parts = stairs(5, 0.02, 0.01);
  const UnionOracle oracle(parts, kPoint);
  for (int step = 1; step < 5; ++step) {
    const double edge = 0.02 * (step - 1), tread = -0.01 * step;
    Led led(oracle, {{edge + 0.01, 0, tread + 0.02}, Mat3(1)});
    led.straight_to({edge + 0.01, 0, tread + 0.005}, 3);
    const Vec3 in(edge - 0.004, 0.001, tread - 0.003);
    expect_near(led.straight_to(in, 20), {0.004, 0, 0.003}, 1e-16, "step", step);
    // Up along the riser and onto the tread above: pressed down there, that tread holds it.
    led.straight_to({edge - 0.004, 0, tread + 0.015}, 20);
    expect_near(led.straight_to({edge - 0.004, 0, tread + 0.008}, 20), {0, 0, 0.002}, 1e-16,
                "above step", step);
  }
}

// Lowered exactly in the plane of an L's wall, the stylus touches the floor alone.
TEST(UnionOracle, InThePlaneOfAWallItIsNotPushedSideways) {
  const OracleParts l{box_part({-0.02, -0.05, -0.02}, {0, 0.05, 0.05}),
                      box_part({-0.02, -0.05, -0.02}, {0.06, 0.05, 0})};
  const UnionOracle oracle(l, stylus(0.08));
  const Mat3 level = axes_along(Vec3(0, 1, 0));
  Led led(oracle, {{0, -0.04, 0.06}, level});
  for (double z = 0.06; z > -0.002; z -= 3e-4) {
    const OracleTick tick = led.to({{0, -0.04, z}, level});
    expect_near(tick.ideal.tip, {0, -0.04, std::max(0.0, z)}, 1e-15, "height", z);
  }
}

// A bar across the stylus lies on a cube, and the tip hangs beside the cube; the tip alone then
// bears the push from the side.
TEST(UnionOracle, AToolOfTwoSegmentsRestsOnBoth) {
  const OracleParts block{box_part({-0.03, -0.03, -0.06}, {0.03, 0.03, 0})};
  const OracleTool tool{{Vec3(0), Vec3(0, 0, 0.1)}, {Vec3(0, 0, 0.02), Vec3(-0.02, 0, 0.02)}};
  const UnionOracle oracle(block, tool);
  Led led(oracle, {{0.035, 0.004, 0.01}, Mat3(1)});
  led.straight_to({0.035, 0.004, -0.015}, 10);
  const Vec3 pressed(0.028, 0.004, -0.023);
  expect_near(led.straight_to(pressed, 10), {0.002, 0, 0.003}, 1e-16, "pressed");
  const OracleTick tick = led.to({pressed, Mat3(1)});
  ASSERT_EQ(tick.contacts.size(), 2u);
  for (const OracleContact& contact : tick.contacts) {
    if (contact.segment == 0) {  // along the side, from the tip to the upper edge
      expect_near(contact.normal, {1, 0, 0}, 1e-15, "upright");
      EXPECT_NEAR(contact.share, 0.002, 1e-16);
      EXPECT_NEAR(contact.first, 0, 1e-9);
      EXPECT_NEAR(contact.last, 0.02, 1e-9);
    } else {
      expect_near(contact.normal, {0, 0, 1}, 1e-15, "bar");
      EXPECT_NEAR(contact.share, 0.003, 1e-16);
      EXPECT_NEAR(contact.first, 0, 1e-9);
      EXPECT_NEAR(contact.last, 0.02, 1e-9);
    }
  }
}

// However a solid is cut, the whole one is felt, also deep inside.
TEST(UnionOracle, CutSolidsEqualWholeOnes) {
  long in_contact = 0;
  for (std::uint64_t seed = 0; seed < 60; ++seed) {
    Random random(seed, {3});
    const stimuli::PolygonSoup cut_once = cut_cube(random, static_cast<int>(random.below(8)));
    const Quat turn = stimuli::uniform_rotation(random);
    const stimuli::PolygonSoup solid = turned_and_moved(cut_once, turn, 0.05, Vec3(0));
    const OracleParts whole{part_of(solid)};
    const OracleParts cut = cut_to_pieces(solid, 1 + static_cast<int>(random.below(2)), random);
    const OracleTool tool = random_tool(random, 1 + static_cast<int>(random.below(3)));
    const UnionOracle of_whole(whole, tool), of_cut(cut, tool);
    const auto path = random_tool_path(random, whole, tool, 1e-3, 300);
    OraclePose last = path[0];
    for (const OraclePose& pose : path) {
      const OracleTick a = of_whole.tick(last, pose), b = of_cut.tick(last, pose);
      ASSERT_FALSE(a.failed || b.failed) << seed;
      // For a cut solid, the steps of a turn may be smaller; without a turn they are equal.
      if (a.lagged || b.lagged) break;
      ASSERT_LE(glm::length(a.ideal.tip - b.ideal.tip), 1e-12 * of_whole.size())
          << "seed " << seed << ", " << cut.size() << " pieces, " << tool.size() << " segments";
      in_contact += glm::length(a.ideal.tip - pose.tip) > 0;
      last = a.ideal;
    }
  }
  EXPECT_GT(in_contact, 3000);
}

}  // namespace
}  // namespace palpate::runner::evidence
