// The exact local penetration depths, against dense sampling of directions, small changes of
// direction, the distances of stimuli/signed_distance and the brute-force reference.

#include "runner/evidence/accuracy/local_depths.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <numbers>
#include <vector>

#include "runner/evidence/verification/reference.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/primitives.h"
#include "stimuli/signed_distance.h"
#include "tests/shared/probe_paths.h"

namespace palpate::runner::evidence {
namespace {

using testing::probe_at;
using testing::random_direction;
using testing::uniform;

constexpr stimuli::ShapeKind kShapes[] = {stimuli::ShapeKind::sphere, stimuli::ShapeKind::cone,
                                          stimuli::ShapeKind::cylinder, stimuli::ShapeKind::cube,
                                          stimuli::ShapeKind::box};

stimuli::ObjectSpec primitive(stimuli::ShapeKind shape) {
  stimuli::ObjectSpec spec;
  spec.shape = shape;
  spec.size = {0.08, 0.05, 0.03};
  return spec;
}

/// Random poses that overlap the shape, tips and sides, also shallow ones.
std::vector<rendering::LineProbe> inside_poses(const stimuli::ObjectSpec& spec, int count,
                                               std::uint64_t seed) {
  Random random(seed);
  std::vector<rendering::LineProbe> poses;
  while (static_cast<int>(poses.size()) < count) {
    const double length = poses.size() % 4 == 0 ? 0 : uniform(random, 0.01, 0.15);
    const rendering::LineProbe probe =
        probe_at(uniform(random, 0, 0.045) * random_direction(random), random_direction(random),
                 length, random.unit());
    if (!local_depths(spec, probe).empty()) poses.push_back(probe);
  }
  return poses;
}

/// Evenly spread directions (a Fibonacci lattice).
std::vector<Vec3> directions(int count) {
  std::vector<Vec3> all;
  for (int i = 0; i < count; ++i) {
    const double z = 1 - (2 * i + 1.0) / count, out = std::sqrt(1 - z * z);
    const double turn = 2 * std::numbers::pi * i / std::numbers::phi;
    all.emplace_back(out * std::cos(turn), out * std::sin(turn), z);
  }
  return all;
}

TEST(LocalDepths, NoDirectionIsShorterThanTheLeast) {
  const auto sample = directions(4000);
  for (const stimuli::ShapeKind shape : kShapes) {
    const stimuli::ObjectSpec spec = primitive(shape);
    for (const rendering::LineProbe& probe : inside_poses(spec, 200, 1)) {
      double sampled = 1;
      for (const Vec3& n : sample) sampled = std::min(sampled, depth_along(spec, probe, n));
      EXPECT_LE(local_depths(spec, probe).front().depth, sampled + 1e-15)
          << static_cast<int>(shape);
    }
  }
}

TEST(LocalDepths, AreLocalMinimaOfTheReportedDepth) {
  constexpr std::uint64_t kSeed = 2;
  Random random(kSeed);
  for (const stimuli::ShapeKind shape : kShapes) {
    const stimuli::ObjectSpec spec = primitive(shape);
    for (const rendering::LineProbe& probe : inside_poses(spec, 200, 3)) {
      for (const LocalDepth& local : local_depths(spec, probe)) {
        EXPECT_NEAR(glm::length(local.normal), 1, 1e-14);
        EXPECT_NEAR(depth_along(spec, probe, local.normal), local.depth, 1e-14);
        for (const double step : {1e-3, 1e-5}) {
          for (int i = 0; i < 20; ++i) {
            const Vec3 n = glm::normalize(local.normal + step * random_direction(random));
            EXPECT_GE(depth_along(spec, probe, n), local.depth - 1e-15)
                << static_cast<int>(shape) << " step " << step;
          }
        }
        // The contact is on the surface: on the plane, and not outside along any other direction.
        const Vec3 touch = probe.tip + local.probe_fraction * (probe.tail - probe.tip) +
                           local.depth * local.normal;
        EXPECT_NEAR(stimuli::signed_distance(spec, touch).distance, 0, 1e-13)
            << static_cast<int>(shape);
      }
    }
  }
}

TEST(LocalDepths, EqualFinePolyhedron) {
  // Each has a counterpart among the polyhedron's and vice versa, except for a few that are about
  // to appear or vanish.
  for (const stimuli::ShapeKind shape : kShapes) {
    stimuli::ObjectSpec spec = primitive(shape);
    spec.subdivisions = 4;
    spec.segments = 720;
    const stimuli::ConvexMesh mesh(stimuli::polygons_of(spec));
    int all = 0, made_up = 0, missing = 0;
    const auto alone = [](const LocalDepth& local, const std::vector<LocalDepth>& others) {
      for (const LocalDepth& other : others) {
        if (glm::dot(local.normal, other.normal) > std::cos(0.05) &&
            std::abs(local.depth - other.depth) < 1e-4) {
          return 0;
        }
      }
      return 1;
    };
    for (const rendering::LineProbe& probe : inside_poses(spec, 300, 5)) {
      if (reference_depth(mesh, probe).depth < 1e-3) continue;
      const auto analytic = local_depths(spec, probe);
      const auto polyhedral = local_depths(mesh, probe, Vec3(0, 0, 1), 4);
      for (const LocalDepth& local : analytic) made_up += alone(local, polyhedral);
      // Near the middle, a fine polyhedron has a local minimum at every other facet.
      for (const LocalDepth& local : polyhedral)
        missing += local.depth < 5e-3 ? alone(local, analytic) : 0;
      all += static_cast<int>(analytic.size());
    }
    EXPECT_LE(made_up, all / 50) << static_cast<int>(shape) << " of " << all;
    EXPECT_LE(missing, all / 50) << static_cast<int>(shape) << " of " << all;
  }
}

TEST(LocalDepths, LeastEqualsSignedDistanceOfPoint) {
  constexpr std::uint64_t kSeed = 6;
  Random random(kSeed);
  for (const stimuli::ShapeKind shape : kShapes) {
    const stimuli::ObjectSpec spec = primitive(shape);
    for (int i = 0; i < 500; ++i) {
      const Vec3 p = uniform(random, 0, 0.06) * random_direction(random);
      const stimuli::SurfaceDistance distance = stimuli::signed_distance(spec, p);
      const auto ways = local_depths(spec, {p, p});
      ASSERT_EQ(ways.empty(), distance.distance > 0);
      if (ways.empty()) continue;
      EXPECT_NEAR(ways.front().depth, -distance.distance, 1e-15);
      EXPECT_NEAR(glm::dot(ways.front().normal, distance.normal), 1, 1e-12);
    }
  }
}

TEST(LocalDepths, SegmentsThatStayOutHaveNone) {
  constexpr std::uint64_t kSeed = 7;
  // The reference on a fine mesh inside the shape finds the probes that certainly overlap.
  Random random(kSeed);
  for (const stimuli::ShapeKind shape : kShapes) {
    stimuli::ObjectSpec spec = primitive(shape);
    spec.subdivisions = 4;
    spec.segments = 500;
    const stimuli::ConvexMesh mesh(stimuli::polygons_of(spec));
    int out = 0;
    for (int i = 0; i < 2000; ++i) {
      const rendering::LineProbe probe =
          probe_at(uniform(random, 0, 0.09) * random_direction(random), random_direction(random),
                   0.1, random.unit());
      const bool inside = !local_depths(spec, probe).empty();
      const double depth = reference_depth(mesh, probe).depth;
      if (depth > 0) {
        EXPECT_TRUE(inside);
      }
      // Mesh and shape are at most 0.02 mm apart.
      if (inside && local_depths(spec, probe).front().depth > 5e-5) {
        EXPECT_GT(depth, 0);
      }
      out += inside ? 0 : 1;
    }
    EXPECT_GT(out, 200);
  }
}

TEST(LocalDepths, LeastEqualsReferenceOfPolyhedron) {
  constexpr std::uint64_t kSeed = 8;
  Random random(kSeed);
  for (const stimuli::ShapeKind shape : kShapes) {
    stimuli::ObjectSpec spec = primitive(shape);
    spec.subdivisions = 2;
    spec.segments = 12;
    const stimuli::ConvexMesh mesh(stimuli::polygons_of(spec));
    for (const rendering::LineProbe& probe : inside_poses(spec, 300, 9)) {
      const ReferenceDepth reference = reference_depth(mesh, probe);
      if (reference.depth <= 0) continue;
      const auto all = local_depths(mesh, probe, Vec3(0, 0, 1), 4);
      ASSERT_FALSE(all.empty());
      EXPECT_NEAR(all.front().depth, reference.depth, 1e-16);
      const auto near = local_depths(mesh, probe, reference.normal, 0.1);
      ASSERT_FALSE(near.empty());
      EXPECT_NEAR(glm::dot(near.front().normal, reference.normal), 1, 1e-12);
      for (const LocalDepth& local : all) {
        // Moved out, the probe touches: it neither penetrates nor floats.
        const rendering::LineProbe ideal = testing::moved(probe, local.depth * local.normal);
        EXPECT_LE(reference_depth(mesh, ideal).depth, 1e-14);
        EXPECT_LE(reference_gap(mesh, ideal), 1e-14);
        const Vec3 touch = ideal.tip + local.probe_fraction * (ideal.tail - ideal.tip);
        EXPECT_LE(reference_gap(mesh, {touch, touch}), 1e-13);
      }
    }
  }
}

TEST(LocalDepths, PolyhedronAgreesWithTheAnalyticBox) {
  for (const stimuli::ShapeKind shape : {stimuli::ShapeKind::cube, stimuli::ShapeKind::box}) {
    const stimuli::ObjectSpec spec = primitive(shape);
    const stimuli::ConvexMesh mesh(stimuli::polygons_of(spec));
    for (const rendering::LineProbe& probe : inside_poses(spec, 300, 10)) {
      const auto analytic = local_depths(spec, probe);
      const auto polyhedral = local_depths(mesh, probe, Vec3(0, 0, 1), 4);
      ASSERT_EQ(analytic.size(), polyhedral.size());
      for (std::size_t i = 0; i < analytic.size(); ++i) {
        EXPECT_NEAR(analytic[i].depth, polyhedral[i].depth, 1e-16);
        EXPECT_NEAR(analytic[i].probe_fraction, polyhedral[i].probe_fraction, 1e-12);
        EXPECT_NEAR(analytic[i].flat_angle, polyhedral[i].flat_angle, 1e-9);
      }
    }
  }
}

TEST(LocalDepths, RefuseMeshesAndCompounds) {
  EXPECT_THROW(local_depths(primitive(stimuli::ShapeKind::mesh), rendering::LineProbe()),
               std::invalid_argument);
  EXPECT_THROW(local_depths(primitive(stimuli::ShapeKind::compound), rendering::LineProbe()),
               std::invalid_argument);
}

}  // namespace
}  // namespace palpate::runner::evidence
