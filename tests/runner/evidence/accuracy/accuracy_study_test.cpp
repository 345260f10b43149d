#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "runner/evidence/accuracy/study.h"
#include "stimuli/primitives.h"

namespace palpate::runner::evidence {
namespace {

TEST(AccuracyStudy, CountsTrianglesAsTheMeshesHaveThem) {
  for (const stimuli::ShapeKind shape :
       {stimuli::ShapeKind::sphere, stimuli::ShapeKind::cone, stimuli::ShapeKind::cylinder,
        stimuli::ShapeKind::cube, stimuli::ShapeKind::box}) {
    int last = 0;
    for (const stimuli::ObjectSpec& spec : tessellations(shape, 5000)) {
      int triangles = 0;
      for (const auto& face : stimuli::polygons_of(spec).faces)
        triangles += static_cast<int>(face.size()) - 2;
      EXPECT_EQ(triangles_of(spec), triangles);
      EXPECT_GT(triangles, last);
      EXPECT_LE(triangles, 5000);
      last = triangles;
    }
    const bool exact = shape == stimuli::ShapeKind::cube || shape == stimuli::ShapeKind::box;
    EXPECT_GT(last, exact ? 0 : 900);
  }
}

AccuracySettings tiny() {
  AccuracySettings settings;
  settings.paths = 1;
  settings.contact_ticks = 60;
  settings.most_triangles = 80;
  settings.timings = 1;
  settings.visits = 2000;
  return settings;
}

TEST(AccuracyStudy, MeasuresEveryMethodOnEveryTessellationWithBothProbes) {
  double time = 0, share = -1;
  const auto rows = accuracy_study(
      tiny(), [&] { return time += 1000; },
      [&](double done) {
        EXPECT_GE(done, share);
        share = done;
      });
  EXPECT_EQ(share, 1);
  std::set<std::string> seen;
  for (const AccuracyRow& row : rows) {
    EXPECT_TRUE(
        seen.insert(row.shape + std::to_string(row.triangles) + row.probe + row.method).second);
    EXPECT_GT(row.shape_errors.ticks, 0u);
    EXPECT_GT(row.polyhedron_errors.ticks, 0u);
    EXPECT_LE(row.polyhedron_errors.ticks, row.shape_errors.ticks);
    // The clock is read once before and once after: 1000 ns over the ticks between.
    EXPECT_DOUBLE_EQ(row.ns_per_tick, 1000.0 / static_cast<double>(row.shape_errors.ticks));
  }
  // 2 spheres, 3 cones, 2 cylinders, 1 cube, 1 box.
  EXPECT_EQ(rows.size(), 9 * 2 * contact_methods().size());
}

TEST(AccuracyStudy, EveryNthTickGivesTheSameAnswersThere) {
  AccuracySettings all = tiny(), some = tiny();
  all.visits = 1e9;
  const auto clock = [] { return 0.0; };
  const auto a = accuracy_study(all, clock, [](double) {});
  const auto b = accuracy_study(some, clock, [](double) {});
  ASSERT_EQ(a.size(), b.size());
  bool fewer = false;
  for (std::size_t i = 0; i < a.size(); ++i) {
    fewer |= b[i].polyhedron_errors.ticks < a[i].polyhedron_errors.ticks;
    EXPECT_LE(b[i].polyhedron_errors.depth.worst, a[i].polyhedron_errors.depth.worst + 1e-15);
  }
  EXPECT_TRUE(fewer);
}

/// Every comparison with the polyhedron visits all its facets and edges; a path may end within a
/// stride.
TEST(AccuracyStudy, KeepsToTheBudgetOfVisitsAndUsesIt) {
  AccuracySettings settings = tiny();
  settings.paths = 3;
  settings.most_triangles = 20;
  for (const double visits : {1000.0, 1500.0, 3000.0}) {
    settings.visits = visits;
    for (const AccuracyRow& row : accuracy_study(
             settings, [] { return 0.0; }, [](double) {})) {
      const auto features = static_cast<double>(row.facets + row.edges);
      const auto ticks = static_cast<double>(row.polyhedron_errors.ticks);
      EXPECT_LE(ticks * features, visits + settings.paths * features) << row.shape << row.method;
      EXPECT_GE(ticks * features, 0.5 * std::min(visits, 180 * features)) << row.shape;
    }
  }
}

AccuracyRow row(int triangles, const char* probe, double depth, double normal, std::size_t lost) {
  AccuracyRow r;
  r.shape = "sphere";
  r.triangles = triangles;
  r.probe = probe;
  r.method = "tick";
  r.shape_errors.depth.p999 = depth;
  r.shape_errors.normal.p999 = normal;
  r.shape_errors.lost = lost;
  return r;
}

TEST(AccuracyStudy, ChoosesTheCoarsestThatIsGoodEnoughForBothProbes) {
  std::vector<AccuracyRow> rows;
  for (const char* probe : {"ray", "point"}) {
    rows.push_back(row(20, probe, 2e-3, 0.5, 0));
    rows.push_back(row(80, probe, 5e-4, 0.1, probe[0] == 'p' ? 1 : 0));
    rows.push_back(row(320, probe, 1e-4, probe[0] == 'p' ? 0.15 : 0.05, 0));
    rows.push_back(row(1280, probe, 1e-5, 0.01, 0));
  }
  EXPECT_EQ(triangles_for(rows, "sphere", {1e-3, 0.2}), 320);    // 80 loses a contact
  EXPECT_EQ(triangles_for(rows, "sphere", {1e-3, 0.12}), 1280);  // the point's direction
  EXPECT_EQ(triangles_for(rows, "sphere", {3e-5, kNoLimit}), 1280);
  EXPECT_EQ(triangles_for(rows, "sphere", {1e-6, kNoLimit}), 0);
  EXPECT_EQ(triangles_for(rows, "cube", {1, 1}), 0);
  // A finer one fails: the coarser passed by chance, so it does not count either.
  rows.push_back(row(5120, "ray", 2e-3, 0.01, 0));
  rows.push_back(row(20480, "ray", 1e-6, 0.001, 0));
  EXPECT_EQ(triangles_for(rows, "sphere", {1e-3, 0.2}), 20480);
  // Other methods do not decide.
  rows.push_back(row(81920, "ray", 1, 1, 5));
  rows.back().method = "bullet";
  EXPECT_EQ(triangles_for(rows, "sphere", {1e-3, 0.2}), 20480);
}

}  // namespace
}  // namespace palpate::runner::evidence
