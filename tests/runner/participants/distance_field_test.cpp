#include "runner/participants/distance_field.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <limits>

#include "data/base/random.h"
#include "runner/participants/deepest_point.h"
#include "runner/participants/shape_hypotheses.h"
#include "runner/participants/shape_lines.h"
#include "runner/participants/shape_observer.h"
#include "runner/participants/solid_lines.h"
#include "stimuli/primitives.h"
#include "tests/runner/participants/solids.h"

namespace palpate::runner::participants {
namespace {

const stimuli::solids::Outline kEll{{0, 0},       {0.06, 0},    {0.06, 0.02},
                                    {0.02, 0.02}, {0.02, 0.06}, {0, 0.06}};

Vec3 point_around(Random& random, const Vec3& middle, double reach) {
  Vec3 point = middle;
  for (int axis = 0; axis < 3; ++axis) point[axis] += reach * (2 * random.unit() - 1);
  return point;
}

TEST(DistanceField, IsExactToASpacingOnLShape) {
  const DistanceField field(test::placed(stimuli::solids::prism(kEll, 0.03).soup));
  constexpr std::uint64_t kSeed = 1;
  Random random(kSeed);
  double squares = 0, count = 0;
  for (int i = 0; i < 20000; ++i) {
    const Vec3 p = point_around(random, Vec3(0.03, 0.03, 0.015), 0.06);
    const double exact = test::distance_to_prism(kEll, 0.03, p);
    const double off = test::distance_at(field, p) - exact;
    // Beyond the grid it is an upper bound.
    const double slack = exact < field.margin() ? 0.06 * std::abs(exact) : 0.3 * exact;
    ASSERT_LT(off, 0.6 * field.spacing() + slack) << exact;
    ASSERT_GT(off, -0.6 * field.spacing() - 0.06 * std::abs(exact)) << exact;
    if (std::abs(exact) > 0.006) continue;
    squares += off * off;
    ++count;
  }
  EXPECT_LT(std::sqrt(squares / count), 0.12 * field.spacing());
}

// There is no surface where two parts of a solid meet.
TEST(DistanceField, ASeamIsNotASurface) {
  const DistanceField whole(test::placed(stimuli::box(Vec3(0.06, 0.04, 0.04))));
  for (const double at : {0.0, 0.0071, -0.02}) {
    std::vector<PlacedPart> halves =
        test::placed(stimuli::box(Vec3(0.03 + at, 0.04, 0.04)), Vec3((at - 0.03) / 2, 0, 0));
    halves.push_back(
        test::placed(stimuli::box(Vec3(0.03 - at, 0.04, 0.04)), Vec3((at + 0.03) / 2, 0, 0))[0]);
    const DistanceField cut(halves);
    constexpr std::uint64_t kSeed = 2;
    Random random(kSeed);
    for (int i = 0; i < 5000; ++i) {
      const Vec3 p = point_around(random, Vec3(0), 0.03);
      ASSERT_NEAR(test::distance_at(cut, p), test::distance_at(whole, p), 0.1 * whole.spacing())
          << at;
    }
  }
}

// If the surface has no stiffness, the first layer with stiffness is felt.
TEST(DistanceField, StartsAtFirstFeltLayer) {
  stimuli::ObjectSpec cube;
  cube.shape = stimuli::ShapeKind::cube;
  cube.material.layers = {{0.004, 0, 0, {}}, {0.008, 500, 0, {}}, {0.016, 900, 0, {}}};
  const auto side = [](const stimuli::ObjectSpec& spec) {
    return -test::distance_at(DistanceField(felt_parts(spec)), Vec3(0)) * 2;
  };
  EXPECT_NEAR(side(cube), 0.06, 0.002);
  cube.material.stiffness = 0;
  EXPECT_NEAR(side(cube), 0.044, 0.002);
  cube.material.layers[1].stiffness = 0;
  EXPECT_NEAR(side(cube), 0.028, 0.002);
  EXPECT_TRUE(can_be_felt(cube));
  cube.material.layers[2].stiffness = 0;
  EXPECT_FALSE(can_be_felt(cube));
}

TEST(DistanceField, ItsGradientIsTheNormal) {
  stimuli::ObjectSpec ball;
  ball.subdivisions = 3;
  const DistanceField field(felt_parts(ball));
  constexpr std::uint64_t kSeed = 3;
  Random random(kSeed);
  for (int i = 0; i < 2000; ++i) {
    const Vec3 out = glm::normalize(Vec3(random.normal(), random.normal(), random.normal()));
    const Vec3 p = (0.026 + 0.008 * random.unit()) * out;
    const DistanceField::Value v =
        field.value(static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z));
    const Vec3 slope(v.slope_x, v.slope_y, v.slope_z);
    EXPECT_GT(glm::dot(glm::normalize(slope), out), std::cos(0.15));
    EXPECT_NEAR(glm::length(slope), 1, 0.15);
    EXPECT_FLOAT_EQ(v.distance, static_cast<float>(test::distance_at(field, p)));
  }
}

TEST(DistanceField, FarAwayItGrowsWithSlopeOne) {
  const DistanceField field(test::placed(stimuli::cube(0.06)));
  for (const double far : {0.2, 1.0, 50.0}) {
    EXPECT_NEAR(test::distance_at(field, Vec3(far, 0, 0)), far - 0.03, 0.03 * far);
    EXPECT_NEAR(test::distance_at(field, Vec3(0, far, -far)), std::sqrt(2) * (far - 0.03),
                0.03 * far);
  }
  // NaN must not read beyond the grid.
  test::distance_at(field, Vec3(std::nan(""), 0, std::numeric_limits<double>::infinity()));
}

// What is farther from the stylus than that is surely not felt, whatever its orientation.
TEST(DistanceField, NoPlaceIsNearerThanItsReachSays) {
  stimuli::ObjectSpec box;
  box.shape = stimuli::ShapeKind::box;
  box.size = Vec3(0.09, 0.02, 0.05);
  box.pose.position = Vec3(0.02, 0.01, 0);
  const DistanceField field(felt_parts(box));
  EXPECT_NEAR(field.reach(), glm::length(Vec3(0.065, 0.02, 0.025)), 0.004);
  constexpr std::uint64_t kSeed = 6;
  Random random(kSeed);
  for (int i = 0; i < 20000; ++i) {
    const Vec3 out = glm::normalize(Vec3(random.normal(), random.normal(), random.normal()));
    const double far = 0.3 * random.unit();
    ASSERT_GE(test::distance_at(field, far * out), far - field.reach() - 1e-6);
  }
}

TEST(DistanceField, NoPlaceIsNearerThanThePlanesOfItsBoxSay) {
  const DistanceField field(test::placed(stimuli::solids::prism(kEll, 0.03).soup));
  const DistanceField::Box& box = field.box();
  EXPECT_NEAR(box.half[0], 0.03, 0.001);
  EXPECT_NEAR(box.half[2], 0.015, 0.001);
  constexpr std::uint64_t kSeed = 7;
  Random random(kSeed);
  for (int i = 0; i < 50000; ++i) {
    const Vec3 p = point_around(random, Vec3(0.03, 0.03, 0.015), i % 2 == 0 ? 0.05 : 0.3);
    double beyond = -1;
    for (int a = 0; a < 3; ++a)
      beyond = std::max(beyond, std::abs(p[a] - double{box.middle[a]}) - double{box.half[a]});
    ASSERT_GE(test::distance_at(field, p), beyond);
  }
}

stimuli::ObjectSpec ell_of_boxes() {
  stimuli::ObjectSpec ell;
  ell.shape = stimuli::ShapeKind::compound;
  stimuli::ObjectSpec arm;
  arm.shape = stimuli::ShapeKind::box;
  arm.size = Vec3(0.06, 0.02, 0.03);
  arm.pose.position = Vec3(0.03, 0.01, 0);
  ell.parts.push_back(arm);
  arm.size = Vec3(0.02, 0.06, 0.03);
  arm.pose.position = Vec3(0.01, 0.03, 0);
  ell.parts.push_back(arm);
  return ell;
}

/// A stylus relative to hypotheses of a shape, and the first hypothesis of a block.
struct Touch {
  Vec3 tip, along;
  Line line;
  int first;

  Touch(const ShapeHypotheses::Shape& shape, Random& random)
      : tip(point_around(random, Vec3(0), 0.06)),
        along(glm::normalize(Vec3(random.normal(), random.normal(), random.normal()))),
        line{to_float(tip), to_float(along), 0.12F, to_float(along)},
        first(shape.first + ShapeHypotheses::kBlock * static_cast<int>(random.below(20))) {}
};

// The search advances all hypotheses together; searching each separately gives the same bits.
TEST(SolidLine, HypothesesAreSearchedIndependently) {
  const ShapeHypotheses hypotheses({ell_of_boxes()});
  const ShapeHypotheses::Shape& shape = hypotheses.shapes()[0];
  constexpr std::uint64_t kSeed = 5;
  Random random(kSeed);
  for (int trial = 0; trial < 200; ++trial) {
    const Touch touch(shape, random);
    const SolidLine line(hypotheses, shape, touch.first, touch.line);
    const float length = touch.line.length, step = length / 16;
    Deepest found;
    find_along_line(line, length, found);
    for (int i = 0; i < ShapeHypotheses::kBlock; ++i) {
      float best = 0, least = line.distance(i, 0);
      for (float s = step; s < length + 0.5F * step;) {
        const float place = std::min(s, length);
        const float d = line.distance(i, place);
        if (d < least) {
          least = d;
          best = place;
        }
        s += std::max(step, d - least);
      }
      float reach = 0.5F * step;
      for (int k = 0; k < 5; ++k, reach *= 0.5F) {
        const float before = std::max(best - reach, 0.0F), after = std::min(best + reach, length);
        const float a = line.distance(i, before), b = line.distance(i, after);
        if (a < least && a <= b) {
          least = a;
          best = before;
        } else if (b < least) {
          least = b;
          best = after;
        }
      }
      ASSERT_EQ(found.along[i], best) << trial << " " << i;
      ASSERT_EQ(found.distance[i], line.surface(i, best).distance) << trial << " " << i;
    }
  }
}

TEST(SolidLine, TheFirstHypothesesOfABlockCanBeSearchedAlone) {
  const ShapeHypotheses hypotheses({ell_of_boxes()});
  const ShapeHypotheses::Shape& shape = hypotheses.shapes()[0];
  constexpr std::uint64_t kSeed = 8;
  Random random(kSeed);
  for (int count = 1; count <= ShapeHypotheses::kBlock; ++count) {
    const Touch touch(shape, random);
    const SolidLine line(hypotheses, shape, touch.first, touch.line);
    Deepest all, some;
    find_along_line(line, touch.line.length, all);
    find_along_line(line, touch.line.length, some, count);
    for (int i = 0; i < count; ++i) {
      ASSERT_EQ(some.distance[i], all.distance[i]) << count << " " << i;
      ASSERT_EQ(some.cosine[i], all.cosine[i]) << count << " " << i;
    }
  }
}

/// Mean of the hypotheses' likelihoods, each looked at, as in shape_observer.h.
double plain_likelihood(const ShapeHypotheses& hypotheses, const ShapeHypotheses::Shape& shape,
                        const ObserverSettings& s, const Percept& percept) {
  const double v = s.contact_sd * s.contact_sd + s.model_contact_sd * s.model_contact_sd;
  const double k =
      1 / (s.direction_sd * s.direction_sd + s.model_direction_sd * s.model_direction_sd);
  const Vec3 span = percept.tail - percept.tip;
  const double length = percept.ray ? glm::length(span) : 0;
  const Line line{to_float(percept.tip), to_float(percept.ray ? span / length : Vec3(0)),
                  static_cast<float>(length), to_float(percept.direction)};
  double sum = 0;
  for (int first = shape.first; first < shape.first + shape.count;
       first += ShapeHypotheses::kBlock) {
    const SolidLine solid(hypotheses, shape, first, line);
    Deepest deepest;
    if (percept.ray)
      find_along_line(solid, line.length, deepest);
    else
      find_at_tip(solid, deepest);
    for (int i = 0; i < ShapeHypotheses::kBlock; ++i) {
      if (hypotheses.nearby_order()[first + i] >= shape.first + shape.count) continue;
      const double d = deepest.distance[i];
      double l = 0;
      if (percept.contact) {
        l = -d * d / (2 * v) + k * (deepest.cosine[i] - 1);
        if (percept.along) {
          double weights = 0, fits = 0;
          for (int place = 0; place < s.places_along; ++place) {
            const double along = length * place / (s.places_along - 1);
            const double height = solid.distance(i, static_cast<float>(along)) - d;
            const double error = (along - *percept.along) / s.along_sd;
            weights += std::exp(-height / s.soft_min_scale);
            fits += std::exp(-height / s.soft_min_scale - error * error / 2);
          }
          l += std::log(fits / weights + s.torque_floor);
        }
      } else {
        l = s.free_space_weight * std::log(std::erfc(-d / std::sqrt(2 * v)) / 2);
      }
      sum += std::exp(s.beta * std::max(l, s.floor));
    }
  }
  return sum / shape.count;
}

// The observer leaves out hypotheses whose likelihood is known before they are looked at.
TEST(SolidLine, TheObserverLeavesOutNothingThatCounts) {
  stimuli::ObjectSpec slab;
  slab.shape = stimuli::ShapeKind::box;
  slab.size = Vec3(0.07, 0.045, 0.02);
  const ShapeHypotheses hypotheses({ell_of_boxes(), slab});
  const ObserverSettings settings;
  ShapeObserver observer(hypotheses, settings);
  constexpr std::uint64_t kSeed = 9;
  Random random(kSeed);
  for (int trial = 0; trial < 80; ++trial) {
    const Vec3 along = glm::normalize(Vec3(random.normal(), random.normal(), random.normal()));
    Percept percept;
    percept.contact = trial % 2 == 0;
    percept.ray = trial % 4 < 2;
    percept.tip = point_around(random, Vec3(0), 0.02 + 0.06 * random.unit());
    percept.tail = percept.tip + 0.12 * along;
    percept.direction = glm::normalize(percept.tip);
    if (percept.contact && percept.ray && trial % 8 < 4) percept.along = 0.12 * random.unit();
    observer.reset();
    observer.update(percept);
    const double ell = plain_likelihood(hypotheses, hypotheses.shapes()[0], settings, percept);
    const double box = plain_likelihood(hypotheses, hypotheses.shapes()[1], settings, percept);
    ASSERT_NEAR(observer.probability(0), ell / (ell + box), 1e-5) << trial;
  }
}

// The least distance along a stylus, by exhaustive search.
TEST(SolidLine, FindsTheDeepestPlaceOfAConcaveShape) {
  const ShapeHypotheses hypotheses({ell_of_boxes()});
  const ShapeHypotheses::Shape& shape = hypotheses.shapes()[0];
  ASSERT_TRUE(shape.field);
  constexpr std::uint64_t kSeed = 4;
  Random random(kSeed);
  for (int trial = 0; trial < 60; ++trial) {
    const Touch touch(shape, random);
    const SolidLine to_shape(hypotheses, shape, touch.first, touch.line);
    Deepest deepest;
    find_along_line(to_shape, touch.line.length, deepest);
    for (int i = 0; i < ShapeHypotheses::kBlock; ++i) {
      const Mat3 r = hypotheses.rotation(hypotheses.nearby_order()[touch.first + i]);
      double least = std::numeric_limits<double>::infinity();
      for (int k = 0; k <= 1000; ++k) {
        least = std::min(
            least, test::distance_at(*shape.field,
                                     glm::transpose(r) * (touch.tip + 0.00012 * k * touch.along)));
      }
      ASSERT_NEAR(deepest.distance[i], least, 0.0006);
      const Vec3 n(deepest.x[i], deepest.y[i], deepest.z[i]);
      ASSERT_NEAR(glm::length(n), 1, 1e-3);
      const FloatVec world = to_shape.world(i, {deepest.x[i], deepest.y[i], deepest.z[i]});
      ASSERT_LT(glm::distance(Vec3(world.x, world.y, world.z), r * n), 1e-5);
    }
  }
}

}  // namespace
}  // namespace palpate::runner::participants
