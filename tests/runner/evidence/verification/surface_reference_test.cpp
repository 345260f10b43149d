// The reference of contact with closed surfaces: against closed forms, and the law against it.

#include "runner/evidence/verification/surface_reference.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <memory>
#include <vector>

#include "rendering/renderer.h"
#include "runner/evidence/verification/surface_stroke.h"
#include "runner/evidence/verification/union_cases.h"
#include "stimuli/closed_surface.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/primitives.h"

namespace palpate::runner::evidence {
namespace {

constexpr double kSoft = 800;  // N/m

std::vector<ReferenceTriangle> triangles_of(const stimuli::PolygonSoup& soup, int shell = 0) {
  std::vector<ReferenceTriangle> all;
  for (const auto& face : soup.faces) {
    for (std::size_t i = 1; i + 1 < face.size(); ++i) {
      all.push_back({{soup.vertices[face[0]], soup.vertices[face[i]], soup.vertices[face[i + 1]]},
                     kSoft,
                     shell});
    }
  }
  return all;
}

const std::vector<ReferenceSegment> kPoint{{Vec3(0), Vec3(0)}};

/// Leads the tip in a straight line, in so many ticks. Returns the last tick.
ReferenceTick led(SurfaceReference& reference, const Vec3& from, const Vec3& to, int ticks,
                  const std::vector<ReferenceSegment>& rods = kPoint) {
  ReferenceTick last;
  for (int i = 0; i <= ticks; ++i) {
    last = reference.tick({from + i / static_cast<double>(ticks) * (to - from), rods});
    EXPECT_TRUE(last.known);
  }
  return last;
}

TEST(SurfaceReference, PushesOutOfABoxByItsFace) {
  SurfaceReference reference(triangles_of(stimuli::box(Vec3(0.06))));
  const ReferenceTick tick = led(reference, Vec3(0.01, 0, 0.032), Vec3(0.01, 0.005, 0.028), 40);
  EXPECT_TRUE(tick.touching);
  EXPECT_NEAR(tick.force.z, kSoft * 0.002, 1e-6);
  EXPECT_LT(glm::length(Vec3(tick.force.x, tick.force.y, 0)), 1e-6);
}

TEST(SurfaceReference, FindsTheDisplacementInAGroove) {
  for (const double opening : {0.3, 1.5, 2.8}) {
    std::vector<ReferenceTriangle> all;
    int shell = 0;
    for (const OraclePart& part : groove(opening)) {
      const auto some = triangles_of(part.mesh->polygons(), shell++);
      for (ReferenceTriangle t : some) {
        for (Vec3& v : t.corners) v = part.pose.orientation * v + part.pose.position;
        all.push_back(t);
      }
    }
    SurfaceReference reference(all);
    for (const Vec3& to : {Vec3(0, 0, -0.002), Vec3(0.001, 0.003, -0.001)}) {
      reference = SurfaceReference(all);
      const ReferenceTick tick = led(reference, Vec3(0, 0, 0.001), to, 60);
      EXPECT_LT(glm::distance(tick.shift, groove_displacement(opening, to)), 1e-7) << opening;
    }
  }
}

TEST(SurfaceReference, SlidesOverTheSeamOfTwoBoxes) {
  std::vector<ReferenceTriangle> all = triangles_of(stimuli::box(Vec3(0.04)), 0);
  for (ReferenceTriangle t : triangles_of(stimuli::box(Vec3(0.04)), 1)) {
    for (Vec3& v : t.corners) v.x += 0.04;
    all.push_back(t);
  }
  SurfaceReference reference(all);
  led(reference, Vec3(0, 0, 0.021), Vec3(0, 0, 0.018), 30);
  for (int i = 0; i <= 400; ++i) {
    const ReferenceTick tick = reference.tick({Vec3(1e-4 * i, 0, 0.018), kPoint});
    ASSERT_TRUE(tick.touching);
    ASSERT_NEAR(tick.shift.z, 0.002, 1e-9);
    ASSERT_NEAR(tick.shift.x, 0, 1e-9);
  }
}

TEST(SurfaceReference, LaysARodOnAnEdge) {
  SurfaceReference reference(triangles_of(stimuli::box(Vec3(0.06))));
  // Across the edge x = z = 30 mm, 45 degrees to both faces.
  const std::vector<ReferenceSegment> rods{{Vec3(-0.02, 0, 0.02), Vec3(0.04, 0, -0.04)}};
  const Vec3 out = glm::normalize(Vec3(1, 0, 1));
  const Vec3 edge(0.03, 0, 0.03);
  const ReferenceTick tick = led(reference, edge + 0.001 * out, edge - 0.001 * out, 20, rods);
  EXPECT_LT(glm::distance(tick.shift, 0.001 * out), 1e-8);
  EXPECT_TRUE(tick.torque_defined);
  EXPECT_LT(glm::length(tick.torque), 1e-6);
}

TEST(SurfaceReference, WindsOnceRoundWhatIsInside) {
  const SurfaceReference reference(triangles_of(stimuli::icosphere(0.03, 3)));
  EXPECT_NEAR(reference.winding(Vec3(0.01, 0, 0)), 1, 1e-9);
  EXPECT_NEAR(reference.winding(Vec3(0.04, 0, 0)), 0, 1e-9);
  const std::vector<ReferenceSegment> rod{{Vec3(-0.05, 0, 0), Vec3(0.05, 0, 0)}};
  EXPECT_TRUE(reference.inside({Vec3(0), rod}));
  EXPECT_FALSE(reference.inside({Vec3(0, 0, 0.031), rod}));
}

/// A ball with bumps and hollows, three tenths of whose edges are concave.
stimuli::PolygonSoup bumpy_ball() {
  stimuli::PolygonSoup soup = stimuli::icosphere(0.03, 3);
  for (Vec3& v : soup.vertices) {
    const Vec3 out = v / 0.03;
    v *= 1 + 0.04 * (std::sin(11 * out.x + 1) + std::sin(9 * out.y + 2) * std::cos(8 * out.z));
  }
  return soup;
}

TEST(SurfaceReference, AgreesWithTheLawOnAConcaveMesh) {
  const stimuli::PolygonSoup soup = bumpy_ball();
  const std::vector<stimuli::SurfaceShell> shells = {
      {std::make_shared<const stimuli::ClosedSurface>(stimuli::closed_surface(soup).surface),
       Pose{}, stimuli::Material{}}};
  const auto surface = std::make_shared<const stimuli::Surface>(shells);
  for (const bool side : {false, true}) {
    const rendering::Renderer& renderer =
        side ? rendering::ray_renderer() : rendering::point_renderer();
    const rendering::Scene scene({}, side, {}, nullptr, {{surface, Pose{}, 0}});
    rendering::RenderState state = scene.initial_state();
    SurfaceStroke hand({.radius = surface->radius(), .side = side});
    SurfaceReference reference(triangles_of(soup));
    double depth = 0;
    int touching = 0, same = 0, inside = 0;
    for (int i = 0; i < 1500; ++i) {
      const rendering::LineProbe probe = hand.next(depth);
      const rendering::Rendering r = renderer.tick(scene, state, probe, 1e-3);
      depth = r.deepest.depth;
      const std::vector<ReferenceSegment> rods{{Vec3(0), side ? probe.tail - probe.tip : Vec3(0)}};
      const ReferenceTick tick = reference.tick({probe.tip, rods});
      ASSERT_TRUE(tick.known) << i;
      if (!tick.touching) continue;
      ++touching;
      same += glm::distance(tick.force, r.force) < 1e-5 ? 1 : 0;
      if (i % 50 == 0) inside += reference.inside({reference.ideal_tip(), rods}) ? 1 : 0;
    }
    EXPECT_GT(touching, 1000);
    EXPECT_EQ(inside, 0);
    EXPECT_GT(same, touching * 98 / 100) << side << " of " << touching;
  }
}

}  // namespace
}  // namespace palpate::runner::evidence
