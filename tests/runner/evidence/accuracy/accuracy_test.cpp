// The numbers of `palpate accuracy`: the paths are as described, the sums are right, and the
// methods' errors behave as theory predicts.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <numbers>

#include "runner/evidence/accuracy/analytic_stroke.h"
#include "runner/evidence/accuracy/methods.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/primitives.h"
#include "tests/shared/probe_paths.h"

namespace palpate::runner::evidence {
namespace {

constexpr stimuli::ShapeKind kShapes[] = {stimuli::ShapeKind::sphere, stimuli::ShapeKind::cone,
                                          stimuli::ShapeKind::cylinder, stimuli::ShapeKind::cube,
                                          stimuli::ShapeKind::box};

stimuli::ObjectSpec primitive(stimuli::ShapeKind shape, int fineness = 0) {
  stimuli::ObjectSpec spec;
  spec.shape = shape;
  spec.size = {0.08, 0.05, 0.03};
  spec.subdivisions = fineness;
  spec.segments = 8 << fineness;
  return spec;
}

TEST(AnalyticStroke, ComesFromOutsideAndStaysAtItsDepth) {
  for (const stimuli::ShapeKind shape : kShapes) {
    const stimuli::ObjectSpec spec = primitive(shape);
    for (const double length : {0.0, 0.12}) {
      AnalyticStrokeSettings settings;
      settings.seed = 3;
      settings.length = length;
      settings.contact_ticks = 800;
      const AnalyticStroke path = analytic_stroke(spec, settings);
      ASSERT_EQ(path.poses.size(), path.approach + 800);
      EXPECT_TRUE(local_depths(spec, path.poses[0]).empty());
      double least = 1, most = 0, farthest = 0;
      for (std::size_t i = path.approach; i < path.poses.size(); ++i) {
        const rendering::LineProbe& probe = path.poses[i];
        EXPECT_NEAR(glm::length(probe.tail - probe.tip), length, 1e-15);
        const auto ways = local_depths(spec, probe);
        ASSERT_FALSE(ways.empty());
        least = std::min(least, ways.front().depth);
        most = std::max(most, ways.front().depth);
        if (i > path.approach) {
          const rendering::LineProbe& last = path.poses[i - 1];
          farthest = std::max(
              {farthest, glm::length(probe.tip - last.tip), glm::length(probe.tail - last.tail)});
        }
      }
      EXPECT_GE(least, 1e-3 - 1e-9);
      EXPECT_LE(most, 2e-3 + 1e-9);
      EXPECT_LT(least, 1.01e-3);
      EXPECT_GT(most, 1.99e-3);
      // As a hand would: the ends of the stylus move, by less than 1 mm a tick.
      EXPECT_LT(farthest, 1e-3);
      EXPECT_GT(farthest, 3e-5);
    }
  }
}

TEST(AnalyticStroke, TouchesWithTipAndSide) {
  for (const stimuli::ShapeKind shape :
       {stimuli::ShapeKind::cone, stimuli::ShapeKind::cylinder, stimuli::ShapeKind::cube}) {
    const stimuli::ObjectSpec spec = primitive(shape);
    int tip = 0, side = 0;
    for (std::uint64_t seed = 1; seed <= 8; ++seed) {
      AnalyticStrokeSettings settings;
      settings.seed = seed;
      settings.contact_ticks = 200;
      const AnalyticStroke path = analytic_stroke(spec, settings);
      for (std::size_t i = path.approach; i < path.poses.size(); ++i) {
        const double place = local_depths(spec, path.poses[i]).front().probe_fraction;
        tip += place == 0 ? 1 : 0;
        side += place > 0 && place < 1 ? 1 : 0;
      }
    }
    EXPECT_GT(tip, 100) << static_cast<int>(shape);
    EXPECT_GT(side, 100) << static_cast<int>(shape);
  }
}

TEST(AnalyticStroke, SeedsDiffer) {
  AnalyticStrokeSettings settings;
  settings.contact_ticks = 1;
  const Vec3 first = analytic_stroke(primitive(stimuli::ShapeKind::sphere), settings).poses[0].tip;
  EXPECT_EQ(first, analytic_stroke(primitive(stimuli::ShapeKind::sphere), settings).poses[0].tip);
  settings.seed = 2;
  EXPECT_NE(first, analytic_stroke(primitive(stimuli::ShapeKind::sphere), settings).poses[0].tip);
}

TEST(ErrorTally, SumsUpByHand) {
  // A probe along y, its tip at the origin, held 1 mm deep at its middle, normal +z.
  const rendering::LineProbe probe{Vec3(0, 0, 0), Vec3(0, 0.1, 0)};
  const std::vector<LocalDepth> truth = {{Vec3(0, 0, 1), 1e-3, 0.5, 1.0},
                                         {Vec3(1, 0, 0), 3e-3, 0, 1.0}};
  const Vec3 exact(0, 0.05, 1e-3);
  ErrorTally tally;
  tally.add(probe, truth, {true, 1e-3, Vec3(0, 0, 1), exact});                            // right
  tally.add(probe, truth, {true, 1.5e-3, Vec3(0, 0, 1), exact + Vec3(0, 2e-3, 0.5e-3)});  // off
  tally.add(probe, truth, {false, 0, Vec3(), Vec3()});                                    // lost
  tally.add(probe, truth,
            {true, std::numeric_limits<double>::quiet_NaN(), Vec3(), Vec3()});  // gave up
  tally.add(probe, truth, {true, 3e-3, Vec3(1, 0, 0), Vec3(3e-3, 0, 0)});       // other side
  tally.add(probe, {}, {true, 1e-4, Vec3(0, 0, 1), exact});                     // phantom
  tally.add(probe, {}, {false, 0, Vec3(), Vec3()});                             // right
  const ErrorSummary s = tally.summary();
  EXPECT_EQ(s.ticks, 7u);
  EXPECT_EQ(s.lost, 2u);
  EXPECT_EQ(s.gave_up, 1u);
  EXPECT_EQ(s.deeper, 1u);
  EXPECT_EQ(s.phantom, 1u);
  EXPECT_EQ(s.depth.count, 6u);
  EXPECT_NEAR(s.depth.worst, 1e-3, 1e-18);
  EXPECT_NEAR(s.depth.rms, std::sqrt((0.25e-6 + 1e-6 + 1e-6 + 1e-8) / 6), 1e-12);
  EXPECT_EQ(s.normal.count, 3u);
  EXPECT_NEAR(s.normal.worst, 0, 1e-15);
  EXPECT_EQ(s.point.count, 3u);
  EXPECT_NEAR(s.point.worst, std::sqrt(4e-6 + 0.25e-6), 1e-15);
  // 800 N/m: 0.8 N lost; 0.4 N too much.
  EXPECT_NEAR(s.force.worst, 0.8, 1e-12);
  // 0.052 m x 1.2 N against 0.05 m x 0.8 N.
  EXPECT_NEAR(s.torque.worst, 0.052 * 1.2 - 0.05 * 0.8, 1e-12);
}

TEST(ErrorTally, AProbeThatLiesFlatHasNoContactPointToCompare) {
  const rendering::LineProbe probe{Vec3(0, 0, 0), Vec3(0, 0.1, 0)};
  ErrorTally tally;
  tally.add(probe, {{Vec3(0, 0, 1), 1e-3, 0, 0.9 * kFlat}}, {true, 1e-3, Vec3(0, 0, 1), Vec3()});
  EXPECT_EQ(tally.summary().point.count, 0u);
  EXPECT_EQ(tally.summary().normal.count, 1u);
}

TEST(ErrorTally, AnglesAreAngles) {
  ErrorTally tally;
  const double angle = 0.1;
  tally.add({}, {{Vec3(0, 0, 1), 1e-3, 0, 1}},
            {true, 1e-3, Vec3(std::sin(angle), 0, std::cos(angle)), Vec3()});
  EXPECT_NEAR(tally.summary().normal.worst, angle, 1e-15);
}

TEST(PlainWalk, InDoubleIsTheWalk) {
  constexpr std::uint64_t kSeed = 1;
  Random random(kSeed);
  for (const stimuli::ShapeKind shape : kShapes) {
    const stimuli::ConvexMesh mesh(stimuli::polygons_of(primitive(shape, 2)));
    const PlainWalk<double> plain(mesh);
    testing::ProbePath path = testing::sliding_path(random, mesh, 0.12, 2000, 0.02);
    rendering::ContactFeature facet;
    int compared = 0;
    for (const rendering::LineProbe& probe : path) {
      const Vec3 d = probe.tail - probe.tip;
      if (facet.kind == rendering::ContactFeature::Kind::none) {
        facet = rendering::nearest_feature_segment(mesh, probe.tip, d).feature;
        continue;
      }
      const rendering::WalkResult ours = walk_segment(mesh, facet, probe.tip, d);
      const rendering::WalkResult theirs = plain.walk(facet, probe.tip, d);
      facet = ours.feature;
      ASSERT_EQ(ours.feature.kind, theirs.feature.kind);
      if (facet.kind == rendering::ContactFeature::Kind::none) continue;
      EXPECT_NEAR(ours.depth, theirs.depth, 1e-15);
      EXPECT_NEAR(glm::length(ours.normal - theirs.normal), 0, 1e-9);
      ++compared;
    }
    EXPECT_GT(compared, 500);
  }
}

/// Errors of every method over three short paths, against the shape and against the polyhedron; of
/// a single method, against the shape.
std::map<std::string, std::pair<ErrorSummary, ErrorSummary>> errors(const stimuli::ObjectSpec& spec,
                                                                    const std::string& only = "") {
  std::map<std::string, std::pair<ErrorSummary, ErrorSummary>> result;
  const stimuli::ConvexMesh mesh(stimuli::polygons_of(spec));
  std::vector<AnalyticStroke> paths;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    AnalyticStrokeSettings settings;
    settings.seed = seed;
    settings.contact_ticks = 300;
    paths.push_back(analytic_stroke(spec, settings));
  }
  for (const MethodDefinition& kind : contact_methods()) {
    if (!only.empty() && kind.name != only) continue;
    ErrorTally analytic, polyhedral;
    for (const AnalyticStroke& path : paths) {
      const auto method = kind.make(mesh, true);
      for (std::size_t i = 0; i < path.poses.size(); ++i) {
        const ContactEstimate estimate = method->tick(path.poses[i]);
        if (i < path.approach) continue;
        analytic.add(path.poses[i], local_depths(spec, path.poses[i]), estimate);
        if (only.empty())
          polyhedral.add(path.poses[i], local_depths(mesh, path.poses[i], Vec3(0, 0, 1), 4),
                         estimate);
      }
    }
    result[kind.name] = {analytic.summary(), polyhedral.summary()};
  }
  return result;
}

TEST(Accuracy, OursIsExactOnThePolyhedron) {
  for (const stimuli::ShapeKind shape : kShapes) {
    auto all = errors(primitive(shape, 2));
    for (const char* name : {"tick", "walk", "scan"}) {
      const ErrorSummary& s = all.at(name).second;
      EXPECT_EQ(s.ticks, 900u);
      EXPECT_EQ(s.lost + s.phantom, 0u) << name;
      EXPECT_LE(s.depth.worst, 1e-16) << name;
      EXPECT_LE(s.normal.worst, 1e-13) << name;
      EXPECT_LE(s.point.worst, 1e-14) << name;
      EXPECT_LE(s.torque.worst, 1e-12) << name;
    }
    EXPECT_EQ(all.at("scan").second.deeper, 0u);
    // Single precision: 30 mm to 24 bits is 2 nm. The error is of that order and not larger.
    const ErrorSummary& single = all.at("walk-float").second;
    EXPECT_GT(single.depth.rms, 1e-10);
    EXPECT_LT(single.depth.worst, 1e-6);
    for (const char* peer : {"bullet", "fcl"}) {
      if (!all.count(peer)) continue;
      EXPECT_LE(all.at(peer).second.lost, 20u) << peer;
      EXPECT_LE(all.at(peer).second.depth.p999, all.at(peer).second.lost ? 2e-3 : 1e-6) << peer;
    }
  }
}

TEST(Accuracy, ACubeIsItsOwnPolyhedron) {
  const auto all = errors(primitive(stimuli::ShapeKind::cube));
  EXPECT_LE(all.at("tick").first.depth.worst, 1e-16);
  EXPECT_LE(all.at("tick").first.normal.worst, 1e-13);
  EXPECT_LE(all.at("tick").first.point.worst, 1e-14);
}

TEST(Accuracy, FallsAsTheSquareOfTheTriangles) {
  // An inscribed polyhedron with edges of length a lies a^2 / (8 R) inside: second order in depth,
  // first in direction. Each level halves the edges.
  for (const stimuli::ShapeKind shape :
       {stimuli::ShapeKind::sphere, stimuli::ShapeKind::cone, stimuli::ShapeKind::cylinder}) {
    ErrorSummary last;
    for (const int fineness : {3, 4, 5}) {
      const ErrorSummary now = errors(primitive(shape, fineness), "walk").at("walk").first;
      if (last.ticks > 0) {
        const double depth_order = std::log2(last.depth.rms / now.depth.rms);
        const double normal_order = std::log2(last.normal.rms / now.normal.rms);
        EXPECT_NEAR(depth_order, 2, 0.3) << static_cast<int>(shape) << " at " << fineness;
        EXPECT_NEAR(normal_order, 1, 0.35) << static_cast<int>(shape) << " at " << fineness;
      }
      last = now;
    }
  }
}

TEST(Accuracy, TheErrorOfASphereIsTheSagitta) {
  // From its corners to the middles of its facets, an icosphere is too low by 0 to the sagitta.
  const stimuli::ObjectSpec spec = primitive(stimuli::ShapeKind::sphere, 4);
  const stimuli::ConvexMesh mesh(stimuli::polygons_of(spec));
  double sagitta = 0;
  for (const stimuli::Facet& facet : mesh.facets())
    sagitta = std::max(sagitta, spec.radius - facet.offset);
  const ErrorSummary s = errors(spec).at("walk").first;
  EXPECT_LE(s.depth.worst, sagitta);
  EXPECT_GT(s.depth.worst, 0.8 * sagitta);
}

}  // namespace
}  // namespace palpate::runner::evidence
