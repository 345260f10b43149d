// Force and torque are continuous where the physics is.
//
// Let m be the larger of the two ends' motions in a tick. Within one facet of M the depth changes
// by m at most: for a face it is offset - n.end; for an edge its rate is -n.((1 - place) tip' +
// place tail'), as n stays at right angles to edge and probe. Over the ridge between two facets of
// M with an angle phi between their normals, the ideal probe slides on; its shift changes from
// depth n to depth cos(phi) n', a jump of depth sin(phi) along the surface. So over a tick from one
// facet to an adjacent one
//   |change of force| <= k (m + depth sin(phi)), and k m where normals do not change. The normal of
//   an edge turns with the probe: by |change of d| / (|d| sin(e, d)) at most, within one facet.

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>

#include "stimuli/convex_mesh.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"
#include "tests/shared/probe_paths.h"
#include "tests/shared/random_mesh.h"
#include "tests/shared/render_checks.h"

namespace palpate::rendering {
namespace {

using testing::Bench;
using testing::kBlendAngle;

constexpr double kStiffness = 800;  // N/m
constexpr double kRounding = 1e-11;

double way(const LineProbe& a, const LineProbe& b) {
  return std::max(glm::length(b.tip - a.tip), glm::length(b.tail - a.tail));
}

struct Seen {
  int same = 0, adjacent = 0, farther = 0;
};

bool adjacent(const stimuli::ConvexMesh& mesh, ContactFeature a, ContactFeature b) {
  using Of = ContactFeature::Kind;
  if (a.kind == Of::edge && b.kind == Of::facet) std::swap(a, b);
  if (a.kind == Of::facet) {
    if (b.kind == Of::edge) {
      const stimuli::Edge& edge = mesh.edges()[b.index];
      return edge.left == a.index || edge.right == a.index;
    }
    for (const stimuli::Edge& edge : mesh.edges()) {
      if ((edge.left == a.index && edge.right == b.index) ||
          (edge.left == b.index && edge.right == a.index)) {
        return true;
      }
    }
    return false;
  }
  const stimuli::Edge &e = mesh.edges()[a.index], &f = mesh.edges()[b.index];
  return e.v0 == f.v0 || e.v0 == f.v1 || e.v1 == f.v0 || e.v1 == f.v1;
}

/// Slides over the mesh and checks the bound of every change of force between ticks in contact.
void slide_and_bound(const Renderer& renderer,
                     const std::shared_ptr<const stimuli::ConvexMesh>& mesh,
                     const testing::ProbePath& path, Seen& seen) {
  Bench bench(renderer, mesh);
  Rendering last;
  ContactFeature last_facet;
  for (std::size_t i = 0; i < path.size(); ++i) {
    const Rendering r = bench.tick(path[i]);
    const ContactFeature facet = bench.state().parts[0].feature;
    if (i > 0 && last.contacts == 1 && r.contacts == 1) {
      const double m = way(path[i - 1], path[i]);
      const double depth = std::max(last.deepest.depth, r.deepest.depth);
      const double change = glm::length(r.force - last.force);
      const double sine =
          std::min(1.0, glm::length(glm::cross(last.deepest.normal, r.deepest.normal)));
      const bool obtuse = glm::dot(last.deepest.normal, r.deepest.normal) < 0;
      const bool same = facet.kind == last_facet.kind && facet.index == last_facet.index;
      if (same || adjacent(*mesh, facet, last_facet)) {
        ++(same ? seen.same : seen.adjacent);
        // Within a facet the normal turns smoothly: its chord, not a fold.
        const double turned = glm::length(r.deepest.normal - last.deepest.normal);
        const double fold = same ? turned : obtuse ? 1 : sine;
        ASSERT_LE(change, kStiffness * (m + depth * fold) + kRounding)
            << "tick " << i << " depth " << depth << " m " << m << " fold " << fold;
        if (same && facet.kind == ContactFeature::Kind::facet) {
          ASSERT_LE(change, kStiffness * m + kRounding) << "tick " << i;
        }
        if (same && facet.kind == ContactFeature::Kind::edge) {
          const stimuli::Edge& edge = mesh->edges()[facet.index];
          const Vec3 e = mesh->vertices()[edge.v1] - mesh->vertices()[edge.v0];
          const Vec3 d = path[i].tail - path[i].tip, d0 = path[i - 1].tail - path[i - 1].tip;
          const auto sine_to = [&](const Vec3& v) {
            return glm::length(glm::cross(e, v)) / (glm::length(e) * glm::length(v));
          };
          const double most = glm::length(d - d0) / (std::min(glm::length(d), glm::length(d0)) *
                                                     std::min(sine_to(d), sine_to(d0)));
          ASSERT_LE(turned, 1.05 * most + kRounding) << "tick " << i;
        }
      } else {
        ++seen.farther;
      }
    }
    last = r;
    last_facet = facet;
  }
}

class Continuity : public ::testing::TestWithParam<const Renderer*> {};

TEST_P(Continuity, ForceIsContinuousOverFacets) {
  Seen seen;
  for (std::uint64_t seed = 0; seed < 60 && !HasFatalFailure(); ++seed) {
    Random random(seed, {81});
    const stimuli::PolygonSoup soups[] = {stimuli::cube(0.06), stimuli::icosphere(0.03, 3),
                                          stimuli::cone(0.03, 0.06, 64),
                                          stimuli::cylinder(0.03, 0.06, 64)};
    const auto mesh = std::make_shared<const stimuli::ConvexMesh>(soups[seed % 4]);
    SCOPED_TRACE("seed " + std::to_string(seed));
    slide_and_bound(
        *GetParam(), mesh,
        testing::sliding_path(random, *mesh, 0.12, 1000, 2e-3, 0.2, GetParam()->side_contact()),
        seen);
  }
  EXPECT_GT(seen.same, 30'000);
  EXPECT_GT(seen.adjacent, 300);
  EXPECT_LT(seen.farther, seen.adjacent / 5);
}

INSTANTIATE_TEST_SUITE_P(Both, Continuity, ::testing::Values(&point_renderer(), &ray_renderer()),
                         [](const auto& parameter) {
                           return std::string(parameter.param->name());
                         });

// A stick over the square top of a cube of edge 2 h, across two of its sides; turned about y from 3
// degrees to -3. Equation (2) in its slope: the contact moves by (x2 - x1) / (2 epsilon) for each
// radian, and with the ends x1, x2 of the touching portion. These are 0 and L where the stick's
// ends lie over the face, else (+-h - tip.x) / cos(theta): they move by |change of tip.x| / cos +
// x tan(theta) |change of theta|.
TEST(ContinuityOfTorque, ThroughSegmentFaceOnEachSideOfEpsilon) {
  constexpr double kHalf = 0.025, kSunk = 0.001;
  struct Rod {
    double start, length;  // m
  };
  for (const Rod rod : {Rod{-0.06, 0.12}, Rod{-0.01, 0.12}, Rod{-0.1, 0.12}, Rod{-0.02, 0.12},
                        Rod{-0.01, 0.03}, Rod{-0.04, 0.03}}) {
    const double start = rod.start, length = rod.length;
    for (const double direction : {1.0, -1.0}) {
      Bench bench(ray_renderer(),
                  std::make_shared<const stimuli::ConvexMesh>(stimuli::cube(2 * kHalf)));
      const auto probe_at = [&](double theta) {
        const Vec3 u(std::cos(theta), 0, std::sin(theta));
        // Turned about its middle; the depth of the portion over the top is kSunk at theta = 0.
        const Vec3 middle(start + length / 2, 0.004, kHalf - kSunk);
        return LineProbe{middle - length / 2 * u, middle + length / 2 * u};
      };
      bench.tick(testing::moved(probe_at(0.05 * direction), {0, 0, 0.02}));
      constexpr int kSteps = 6000;
      Rendering last;
      LineProbe last_probe;
      double last_theta = 0;
      int blended = 0, beyond = 0;
      for (int i = 0; i <= kSteps; ++i) {
        const double theta = direction * 3 * kBlendAngle * (1 - 2.0 * i / kSteps);
        const LineProbe probe = probe_at(theta);
        const Rendering r = bench.tick(probe);
        const bool face_up = r.contacts == 1 && r.deepest.normal.z > 0.999;
        if (i > 0 && face_up && last.contacts == 1 && last.deepest.normal.z > 0.999) {
          const double m = way(last_probe, probe), turned = std::abs(theta - last_theta);
          const double portion = std::min(length, 2 * kHalf / std::cos(3 * kBlendAngle));
          const double ends =
              m / std::cos(theta) + length * std::tan(3 * kBlendAngle) * (turned + m / kHalf);
          const double moved = portion / (2 * kBlendAngle) * turned + ends;
          ASSERT_LE(std::abs(r.deepest.along - last.deepest.along), moved + kRounding)
              << "start " << start << " length " << length << " theta/epsilon "
              << theta / kBlendAngle << " type " << to_string(r.deepest.type);
          // The edge's normal differs from the face's by the tilt across the stick: none here.
          const double force = std::max(glm::length(r.force), glm::length(last.force));
          ASSERT_LE(glm::length(r.force - last.force), kStiffness * m + force * turned + kRounding);
          ASSERT_LE(glm::length(r.torque - last.torque),
                    force * (moved + length * turned + m) +
                        length * (kStiffness * m + force * turned) + kRounding);
          blended += r.deepest.type == ContactType::segment_face;
          beyond += r.deepest.type != ContactType::segment_face;
        }
        last = r;
        last_probe = probe;
        last_theta = theta;
      }
      EXPECT_GT(blended, 1000);
      EXPECT_GT(beyond, 100) << "start " << start << " length " << length;
    }
  }
}

}  // namespace
}  // namespace palpate::rendering
