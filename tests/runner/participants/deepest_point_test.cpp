#include "runner/participants/deepest_point.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "data/base/random.h"
#include "runner/participants/shape_lines.h"
#include "tests/runner/participants/ideal_touches.h"
#include "tests/runner/participants/observer_reference.h"

namespace palpate::runner::participants {
namespace {

using test::deepest_on_segment;
using test::random_direction;
using test::turned_distance;

/// Calls `check` with the line in the frames of the only stimulus's first block.
template <class Check>
void for_block(const stimuli::ObjectSpec& object, const ShapeHypotheses& hypotheses,
               const Line& line, Check check) {
  const ShapeHypotheses::Shape& shape = hypotheses.shapes()[0];
  switch (object.shape) {
    case stimuli::ShapeKind::cone:
      return check(AxialLine<ConeProfile>(hypotheses, shape, 0, line));
    case stimuli::ShapeKind::cylinder:
      return check(AxialLine<CylinderProfile>(hypotheses, shape, 0, line));
    case stimuli::ShapeKind::cube:
      return check(CubeLine(hypotheses, shape, 0, line));
    case stimuli::ShapeKind::sphere:
      return check(SphereLine(hypotheses, shape, 0, line));
    case stimuli::ShapeKind::box:
    case stimuli::ShapeKind::mesh:
    case stimuli::ShapeKind::compound:
      break;
  }
  throw std::invalid_argument("no analytic shape");
}

struct Case {
  Line line;
  Vec3 tip, tail, direction;
};

/// A stylus of 12 cm that passes the centre at up to 6 cm.
Case random_case(Random& random) {
  Case made;
  made.direction = random_direction(random);
  const Vec3 along = random_direction(random);
  const Vec3 passes = 0.06 * random.unit() * random_direction(random);
  made.tip = passes - 0.12 * random.unit() * along;
  made.tail = made.tip + 0.12 * along;
  made.line = {to_float(made.tip), to_float(along), 0.12f, to_float(made.direction)};
  return made;
}

class DeepestPoint : public ::testing::TestWithParam<stimuli::ShapeKind> {
 protected:
  DeepestPoint() { object_.shape = GetParam(); }
  stimuli::ObjectSpec object_;
};

TEST_P(DeepestPoint, DistancesAreExactToAMicrometre) {
  const ShapeHypotheses hypotheses({object_});
  constexpr std::uint64_t kSeed = 11;
  Random random(kSeed);
  for (int n = 0; n < 200; ++n) {
    const Case c = random_case(random);
    const double s = 0.12 * random.unit();
    const Vec3 point = c.tip + s / 0.12 * (c.tail - c.tip);
    for_block(object_, hypotheses, c.line, [&](const auto& line) {
      for (int i = 0; i < ShapeHypotheses::kBlock; ++i) {
        const double exact = turned_distance(object_, hypotheses.rotation(i), point).distance;
        ASSERT_NEAR(line.distance(i, static_cast<float>(s)), exact, 1e-6);
        ASSERT_NEAR(line.surface(i, static_cast<float>(s)).distance, exact, 1e-6);
      }
    });
  }
}

TEST_P(DeepestPoint, WithoutLengthItIsDistanceAndNormalOfTheTip) {
  const ShapeHypotheses hypotheses({object_});
  constexpr std::uint64_t kSeed = 12;
  Random random(kSeed);
  int far_normals = 0;
  for (int n = 0; n < 200; ++n) {
    const Case c = random_case(random);
    const Line at_tip{c.line.start, {0, 0, 0}, 0, c.line.direction};
    for_block(object_, hypotheses, at_tip, [&](const auto& line) {
      Deepest found;
      find_at_tip(line, found);
      for (int i = 0; i < ShapeHypotheses::kBlock; ++i) {
        const stimuli::SurfaceDistance exact =
            turned_distance(object_, hypotheses.rotation(i), c.tip);
        ASSERT_NEAR(found.distance[i], exact.distance, 1e-6);
        if (std::abs(found.cosine[i] - glm::dot(exact.normal, c.direction)) > 1e-3) ++far_normals;
      }
    });
  }
  // Rounding decides the normal where two faces are equally near.
  EXPECT_LE(far_normals, 6);
}

TEST_P(DeepestPoint, MinimumOverTheStylusIsExactToThirtyMicrometres) {
  const ShapeHypotheses hypotheses({object_});
  constexpr std::uint64_t kSeed = 13;
  Random random(kSeed);
  double worst = 0;
  int turned_normals = 0;
  int checked = 0;
  for (int n = 0; n < 60; ++n) {
    const Case c = random_case(random);
    for_block(object_, hypotheses, c.line, [&](const auto& line) {
      Deepest found;
      find_along_line(line, c.line.length, found);
      for (int i = 0; i < ShapeHypotheses::kBlock; ++i) {
        const test::DeepestReference exact =
            deepest_on_segment(object_, hypotheses.rotation(i), c.tip, c.tail);
        worst = std::max(worst, std::abs(found.distance[i] - exact.distance));
        // Deep inside, opposite faces are equally near and their normals cancel.
        if (exact.distance < -0.01) continue;
        ++checked;
        if (std::abs(found.cosine[i] - glm::dot(exact.normal, c.direction)) > 0.02) {
          ++turned_normals;
        }
      }
    });
  }
  RecordProperty("worst_distance_nm", static_cast<int>(worst * 1e9));
  RecordProperty("turned_normals", turned_normals);
  EXPECT_LT(worst, 3e-5);
  EXPECT_GT(checked, 500);
  EXPECT_LE(turned_normals, checked / 200);
}

TEST_P(DeepestPoint, EndsOfTheStylusAreFound) {
  // The stylus points at the centre from outside, so its tip is deepest; reversed, its tail.
  const ShapeHypotheses hypotheses({object_});
  constexpr std::uint64_t kSeed = 14;
  Random random(kSeed);
  for (int n = 0; n < 50; ++n) {
    const Vec3 out = random_direction(random);
    const Vec3 near = 0.06 * out;
    const Vec3 far = 0.18 * out;
    for (const bool tail_first : {false, true}) {
      const Vec3 along = tail_first ? -out : out;
      const Line stylus{to_float(tail_first ? far : near), to_float(along), 0.12f, to_float(out)};
      for_block(object_, hypotheses, stylus, [&](const auto& line) {
        Deepest found;
        find_along_line(line, stylus.length, found);
        for (int i = 0; i < ShapeHypotheses::kBlock; ++i) {
          const stimuli::SurfaceDistance exact =
              turned_distance(object_, hypotheses.rotation(i), near);
          ASSERT_NEAR(found.distance[i], exact.distance, 1e-6);
          ASSERT_NEAR(found.cosine[i], glm::dot(exact.normal, out), 1e-3);
        }
      });
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Shapes, DeepestPoint,
                         ::testing::Values(stimuli::ShapeKind::sphere, stimuli::ShapeKind::cone,
                                           stimuli::ShapeKind::cylinder, stimuli::ShapeKind::cube));

// A stylus that cuts through an edge of a cube: both faces are equally near at the deepest place,
// and the force is perpendicular to the stylus.
TEST(DeepestPointOnAKink, NormalIsPerpendicularToTheStylus) {
  stimuli::ObjectSpec cube;
  cube.shape = stimuli::ShapeKind::cube;
  const ShapeHypotheses hypotheses({cube});
  const Mat3 r = hypotheses.rotation(0);
  const Vec3 edge_normal = r * glm::normalize(Vec3(1, 1, 0));
  const Vec3 along = r * glm::normalize(Vec3(1, -1, 0));
  const Vec3 middle = r * Vec3(0.029, 0.029, 0);
  const Line stylus{to_float(middle - 0.05 * along), to_float(along), 0.12f, to_float(edge_normal)};
  const CubeLine line(hypotheses, hypotheses.shapes()[0], 0, stylus);
  Deepest found;
  find_along_line(line, stylus.length, found);
  EXPECT_NEAR(found.distance[0], -0.001, 1e-6);
  EXPECT_NEAR(found.cosine[0], 1, 1e-5);
}

}  // namespace
}  // namespace palpate::runner::participants
