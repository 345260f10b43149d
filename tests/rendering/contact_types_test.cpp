// The three contact types in constructed places, and the blend of equation (2) between them.

#include <gtest/gtest.h>

#include <cstdint>
#include <numbers>

#include "stimuli/convex_mesh.h"
#include "tests/shared/random_mesh.h"
#include "tests/shared/render_checks.h"

namespace palpate::rendering {
namespace {

using testing::Bench;
using testing::kBlendAngle;

constexpr double kHalfEdge = 0.025;  // m, half edge of the cube
constexpr double kDepth = 0.001;     // m

Bench cube_bench(const Renderer& renderer) {
  return Bench(renderer, std::make_shared<const stimuli::ConvexMesh>(
                             testing::triangulated(stimuli::cube(2 * kHalfEdge))));
}

/// Comes down onto the cube from 10 mm above the final place.
Rendering lowered(Bench& bench, const LineProbe& end) {
  bench.tick(testing::moved(end, Vec3(0, 0, 0.01)));
  return bench.tick(end);
}

void expect_vector(const Vec3& a, const Vec3& b, double tolerance) {
  EXPECT_LE(glm::length(a - b), tolerance) << "(" << a.x << " " << a.y << " " << a.z << ") is not ("
                                           << b.x << " " << b.y << " " << b.z << ")";
}

TEST(ContactTypes, TipOnAFace) {
  for (const Renderer* renderer : {&point_renderer(), &ray_renderer()}) {
    Bench bench = cube_bench(*renderer);
    const LineProbe probe{{0.004, 0.003, kHalfEdge - kDepth}, {0.02, 0.05, 0.12}};
    const Rendering r = lowered(bench, probe);
    EXPECT_EQ(r.deepest.type, ContactType::point_polygon);
    EXPECT_NEAR(r.deepest.depth, kDepth, 1e-16);
    EXPECT_EQ(r.deepest.along, 0);
    expect_vector(r.deepest.normal, {0, 0, 1}, 1e-15);
    expect_vector(r.deepest.point, {0.004, 0.003, kHalfEdge}, 1e-16);
    expect_vector(r.force, {0, 0, 800 * kDepth}, 1e-12);
    expect_vector(r.torque, Vec3(), 1e-16);
    expect_vector(r.device1, r.force, 1e-15);
    expect_vector(r.device2, Vec3(), 1e-15);
    EXPECT_EQ(testing::faults_of_tick(bench, probe, r), "");
  }
}

TEST(ContactTypes, TailOnAFaceLoadsTheOtherDevice) {
  Bench bench = cube_bench(ray_renderer());
  const LineProbe probe{{0.004, 0.003, 0.1}, {0.002, -0.005, kHalfEdge - kDepth}};
  const Rendering r = lowered(bench, probe);
  EXPECT_EQ(r.deepest.type, ContactType::point_polygon);
  EXPECT_NEAR(r.deepest.along, glm::length(probe.tail - probe.tip), 1e-16);
  expect_vector(r.deepest.point, {0.002, -0.005, kHalfEdge}, 1e-16);
  expect_vector(r.device1, Vec3(), 1e-15);
  expect_vector(r.device2, {0, 0, 800 * kDepth}, 1e-12);
  expect_vector(r.torque, glm::cross(probe.tail - probe.tip, r.force), 1e-15);
  Bench blunt = cube_bench(point_renderer());
  EXPECT_EQ(lowered(blunt, probe).contacts, 0) << "the point renderer feels the tip only";
}

TEST(ContactTypes, SideAcrossAnEdge) {
  Bench bench = cube_bench(ray_renderer());
  const Vec3 out = glm::normalize(Vec3(1, 0, 1));
  const Vec3 touch = Vec3(kHalfEdge, 0.003, kHalfEdge);
  const Vec3 u = glm::normalize(Vec3(-1, 0, 1));
  const double along = 0.03;
  const LineProbe ideal{touch - along * u, touch + 0.07 * u};
  bench.tick(testing::moved(ideal, 0.01 * out));
  const LineProbe probe = testing::moved(ideal, -kDepth * out);
  const Rendering r = bench.tick(probe);
  EXPECT_EQ(r.deepest.type, ContactType::segment_edge);
  EXPECT_NEAR(r.deepest.depth, kDepth, 1e-16);
  EXPECT_NEAR(r.deepest.along, along, 1e-15);
  expect_vector(r.deepest.normal, out, 1e-14);
  expect_vector(r.deepest.point, touch, 1e-15);
  expect_vector(r.force, 800 * kDepth * out, 1e-12);
  expect_vector(r.torque, glm::cross(touch - probe.tip, r.force), 1e-15);
  expect_vector(r.device1, 0.7 * r.force, 1e-13);
  expect_vector(r.device2, 0.3 * r.force, 1e-13);
}

TEST(ContactTypes, ZeroLengthProbeIsPointLoadingDeviceOne) {
  Bench bench = cube_bench(ray_renderer());
  const Vec3 p(0.001, 0.002, kHalfEdge - kDepth);
  const Rendering r = lowered(bench, {p, p});
  EXPECT_EQ(r.deepest.type, ContactType::point_polygon);
  expect_vector(r.force, {0, 0, 800 * kDepth}, 1e-12);
  expect_vector(r.device1, r.force, 0);
  expect_vector(r.device2, Vec3(), 0);
  expect_vector(r.torque, Vec3(), 1e-16);
}

// A stick over the cube's top, its tip to the left; positive theta has the tip deeper.
struct Stick {
  double from, length;  // m, x of the tip (at theta = 0), length of the stick
};

LineProbe tilted(const Stick& stick, double theta) {
  const Vec3 middle(0, 0.004, kHalfEdge);
  const Vec3 u(std::cos(theta), 0, std::sin(theta));
  const double centre = stick.from + stick.length / 2;
  const Vec3 at = middle + Vec3(centre, 0, 0);
  return {at - stick.length / 2 * u, at + stick.length / 2 * u};
}

/// Where the ideal probe enters and leaves the square top, from the tip; m.
std::pair<double, double> touching_portion(const LineProbe& ideal, double theta, double length) {
  const auto at = [&](double x) {
    return std::clamp((x - ideal.tip.x) / std::cos(theta), 0.0, length);
  };
  return {at(-kHalfEdge), at(kHalfEdge)};
}

TEST(SegmentFace, ContactFollowsEquationTwo) {
  const Stick sticks[] = {{-0.06, 0.12}, {-0.01, 0.02}, {-0.01, 0.12}, {-0.1, 0.11}};
  for (const Stick& stick : sticks) {
    for (const double share : {0.9999, 0.75, 0.3, 0.0, -0.2, -0.6, -0.9999}) {
      SCOPED_TRACE("stick from " + std::to_string(stick.from) + ", theta/epsilon " +
                   std::to_string(share));
      const double theta = share * kBlendAngle;
      Bench bench = cube_bench(ray_renderer());
      LineProbe probe = tilted(stick, theta);
      // The same depth under the top at every tilt: no part of the stick is above the top.
      probe = testing::moved(probe, {0, 0, -0.003});
      const Rendering r = lowered(bench, probe);
      ASSERT_EQ(r.contacts, 1);
      EXPECT_EQ(r.deepest.type, ContactType::segment_face);
      const auto [x1, x2] = touching_portion(r.ideal, theta, stick.length);
      EXPECT_NEAR(r.deepest.along, (x1 + x2) / 2 + share * (x1 - x2) / 2, 1e-4 * (x2 - x1));
      EXPECT_EQ(testing::faults_of_tick(bench, probe, r), "");
    }
  }
}

TEST(SegmentFace, FlatStickIsHeldMidwayAlongWhatTouches) {
  Bench bench = cube_bench(ray_renderer());
  const LineProbe probe = testing::moved(tilted({-0.01, 0.12}, 0), {0, 0, -kDepth});
  const Rendering r = lowered(bench, probe);
  EXPECT_NEAR(r.deepest.along, (0 + 0.01 + kHalfEdge) / 2, 1e-15);
  expect_vector(r.force, {0, 0, 800 * kDepth}, 1e-12);
  expect_vector(r.deepest.point, {(-0.01 + kHalfEdge) / 2, 0.004, kHalfEdge}, 1e-15);
}

TEST(SegmentFace, HasTheCornersTypesOutsideTheBlend) {
  for (const double sign : {1.0, -1.0}) {
    const double theta = sign * 1.001 * kBlendAngle;
    {
      Bench bench = cube_bench(ray_renderer());
      const Rendering r =
          lowered(bench, testing::moved(tilted({-0.01, 0.02}, theta), {0, 0, -kDepth}));
      EXPECT_EQ(r.deepest.type, ContactType::point_polygon);
      EXPECT_NEAR(r.deepest.along, sign > 0 ? 0 : 0.02, 1e-15);
    }
    {
      Bench bench = cube_bench(ray_renderer());
      const Rendering r =
          lowered(bench, testing::moved(tilted({-0.06, 0.12}, theta), {0, 0, -0.003}));
      EXPECT_EQ(r.deepest.type, ContactType::segment_edge);
      EXPECT_NEAR(r.deepest.point.x, -sign * kHalfEdge, 1e-12);
    }
  }
}

TEST(SegmentFace, ContactMovesWithoutJumpsThroughTheBlend) {
  for (const Stick& stick : {Stick{-0.06, 0.12}, Stick{-0.01, 0.02}, Stick{-0.01, 0.12}}) {
    Bench bench = cube_bench(ray_renderer());
    double last_along = 0, last_depth = 0;
    int of_blend = 0;
    const int steps = 4000;
    bench.tick(testing::moved(tilted(stick, -2 * kBlendAngle), {0, 0, 0.01}));
    for (int i = 0; i <= steps; ++i) {
      const double theta = kBlendAngle * (-2 + 4.0 * i / steps);
      const LineProbe probe = testing::moved(tilted(stick, theta), {0, 0, -0.004});
      const Rendering r = bench.tick(probe);
      ASSERT_EQ(r.contacts, 1) << "step " << i;
      ASSERT_EQ(testing::faults_of_tick(bench, probe, r), "") << "step " << i;
      of_blend += r.deepest.type == ContactType::segment_face;
      if (i > 0) {
        // The whole portion is passed in half the steps.
        ASSERT_LE(std::abs(r.deepest.along - last_along), 1.05 * 0.05 / (steps / 2.0))
            << "step " << i;
        ASSERT_LE(std::abs(r.deepest.depth - last_depth), 0.12 * 4 * kBlendAngle / steps)
            << "step " << i;
      }
      last_along = r.deepest.along;
      last_depth = r.deepest.depth;
    }
    EXPECT_NEAR(of_blend, steps / 2, 2);
  }
}

/// Fractions of the probe at which the line of the ideal probe enters and leaves the triangle that
/// holds it, computed in the triangle's plane from its corners.
std::pair<double, double> over_triangle(const stimuli::ConvexMesh& mesh,
                                        const stimuli::Facet& facet, const LineProbe& ideal) {
  double enter = 0, leave = 1;
  for (std::uint32_t i = facet.first_side; i < facet.first_side + 3; ++i) {
    const stimuli::Edge& edge = mesh.edges()[mesh.sides()[i].edge];
    const bool with_it = &mesh.facets()[edge.left] == &facet;
    const Vec3 from = with_it ? edge.from : edge.to, to = with_it ? edge.to : edge.from;
    // Area of the triangle that a point spans with the side: positive inside.
    const auto area = [&](const Vec3& point) {
      return glm::dot(glm::cross(to - from, point - from), facet.normal);
    };
    const double at_tip = area(ideal.tip), at_tail = area(ideal.tail);
    const double crossing = at_tip / (at_tip - at_tail);
    if (at_tail > at_tip) enter = std::max(enter, crossing);
    if (at_tail < at_tip) leave = std::min(leave, crossing);
  }
  return {enter, leave};
}

/// The side slides over a sphere of 30 mm, sometimes parallel to it within the blend angle.
testing::ProbePath along_sphere(Random& random, int ticks) {
  const testing::Wave3 place(random), turn(random);
  testing::ProbePath path;
  for (int tick = 0; tick < ticks; ++tick) {
    const Vec3 out = testing::safe_direction(place(1e-3 * tick));
    const Vec3 level = testing::safe_direction(glm::cross(out, turn(1e-3 * tick)));
    const Vec3 direction = glm::normalize(level + 0.03 * std::sin(0.02 * tick) * out);
    path.push_back(testing::probe_at((tick == 0 ? 0.1 : 0.0285) * out, direction, 0.12,
                                     0.5 + 0.6 * std::sin(0.003 * tick)));
  }
  return path;
}

// Along edges and faces of fine meshes, in every direction.
TEST(SegmentFace, EquationTwoHoldsOverTriangles) {
  constexpr std::uint64_t kSeed = 5;
  Random random(kSeed);
  int from_edges = 0, from_faces = 0;
  for (const int subdivisions : {2, 3, 4, 5}) {
    const auto mesh =
        std::make_shared<const stimuli::ConvexMesh>(stimuli::icosphere(0.03, subdivisions));
    for (int path = 0; path < 8; ++path) {
      Bench bench(ray_renderer(), mesh);
      for (const LineProbe& probe : along_sphere(random, 2000)) {
        const Rendering r = bench.tick(probe);
        if (r.deepest.type != ContactType::segment_face) continue;
        const ContactFeature held = bench.state().parts[0].feature;
        const bool edge = held.kind == ContactFeature::Kind::edge;
        const Vec3 d = r.ideal.tail - r.ideal.tip;
        std::uint32_t face = held.index;
        if (edge) {
          const stimuli::Edge& e = mesh->edges()[held.index];
          const auto rise = [&](std::uint32_t f) {
            return std::abs(glm::dot(mesh->facets()[f].normal, d));
          };
          if (std::abs(rise(e.left) - rise(e.right)) < 1e-12 * glm::length(d)) continue;
          face = rise(e.left) < rise(e.right) ? e.left : e.right;
        }
        const stimuli::Facet& facet = mesh->facets()[face];
        const auto [enter, leave] = over_triangle(*mesh, facet, r.ideal);
        const double theta = std::asin(glm::dot(facet.normal, d) / glm::length(d));
        const double place = (enter + leave) / 2 + theta / kBlendAngle * (enter - leave) / 2;
        ASSERT_NEAR(r.deepest.along, place * glm::length(d), 1e-9 * glm::length(d))
            << (edge ? "edge " : "face ") << held.index << " of " << subdivisions;
        ++(edge ? from_edges : from_faces);
      }
    }
  }
  EXPECT_GT(from_edges, 5000);
  EXPECT_GT(from_faces, 100);
}

}  // namespace
}  // namespace palpate::rendering
