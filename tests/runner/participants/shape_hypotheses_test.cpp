#include "runner/participants/shape_hypotheses.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <glm/geometric.hpp>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "data/base/random.h"
#include "stimuli/orientation.h"

namespace palpate::runner::participants {
namespace {

stimuli::ObjectSpec spec(stimuli::ShapeKind kind) {
  stimuli::ObjectSpec made;
  made.shape = kind;
  return made;
}

const std::vector<stimuli::ShapeKind> kKinds{stimuli::ShapeKind::sphere, stimuli::ShapeKind::cone,
                                             stimuli::ShapeKind::cylinder,
                                             stimuli::ShapeKind::cube};

double degrees(double cosine) { return std::acos(std::min(cosine, 1.0)) * 180 / std::numbers::pi; }

/// Angle between two orientations of a shape, modulo its symmetry; degrees.
double angle(stimuli::ShapeKind kind, const Mat3& a, const Mat3& b) {
  if (kind == stimuli::ShapeKind::sphere) return 0;
  if (kind == stimuli::ShapeKind::cone) return degrees(glm::dot(a[2], b[2]));
  if (kind == stimuli::ShapeKind::cylinder) return degrees(std::abs(glm::dot(a[2], b[2])));
  // The 24 rotations of a cube permute its axes and flip them; the trace of a' b s gives the angle.
  double best = -1;
  std::array<int, 3> order{0, 1, 2};
  do {
    for (int flips = 0; flips < 8; ++flips) {
      Mat3 s(0);
      for (int k = 0; k < 3; ++k) {
        s[k][order[static_cast<std::size_t>(k)]] = ((flips >> k) & 1) != 0 ? -1 : 1;
      }
      if (glm::dot(glm::cross(s[0], s[1]), s[2]) < 0) continue;
      const Mat3 bs = b * s;
      const double trace = glm::dot(a[0], bs[0]) + glm::dot(a[1], bs[1]) + glm::dot(a[2], bs[2]);
      best = std::max(best, (trace - 1) / 2);
    }
  } while (std::next_permutation(order.begin(), order.end()));
  return degrees(best);
}

TEST(ShapeHypotheses, CountsAndLayout) {
  const ShapeHypotheses hypotheses(
      {spec(kKinds[0]), spec(kKinds[1]), spec(kKinds[2]), spec(kKinds[3])});
  const std::vector<int> counts{1, 380, 150, 384};
  ASSERT_EQ(hypotheses.shapes().size(), 4u);
  int end = 0;
  for (std::size_t s = 0; s < 4; ++s) {
    const ShapeHypotheses::Shape& shape = hypotheses.shapes()[s];
    EXPECT_EQ(shape.kind, kKinds[s]);
    EXPECT_EQ(shape.count, counts[s]);
    EXPECT_EQ(shape.first % ShapeHypotheses::kBlock, 0);
    EXPECT_GE(shape.first, end);
    end = shape.first + shape.count;
  }
  EXPECT_LE(end, hypotheses.padded_size());
  EXPECT_EQ(hypotheses.padded_size() % ShapeHypotheses::kBlock, 0);
}

TEST(ShapeHypotheses, EveryHypothesisIsARotation) {
  const ShapeHypotheses hypotheses(
      {spec(stimuli::ShapeKind::cone), spec(stimuli::ShapeKind::cube)});
  for (int i = 0; i < hypotheses.padded_size(); ++i) {
    const Mat3 r = hypotheses.rotation(i);
    for (int a = 0; a < 3; ++a) {
      for (int b = 0; b < 3; ++b) ASSERT_NEAR(glm::dot(r[a], r[b]), a == b ? 1 : 0, 1e-6);
    }
    ASSERT_NEAR(glm::dot(glm::cross(r[0], r[1]), r[2]), 1, 1e-6);
  }
}

TEST(ShapeHypotheses, NoOrientationIsFarFromTheGrid) {
  const std::vector<double> bounds{0, 8, 10, 12};  // degrees; the header promises them
  const std::vector<double> typical{0, 4.5, 5, 6.5};
  for (std::size_t k = 1; k < kKinds.size(); ++k) {
    const ShapeHypotheses hypotheses({spec(kKinds[k])});
    constexpr std::uint64_t kSeed = 3;
    Random random(kSeed);
    double worst = 0;
    double sum = 0;
    constexpr int kDraws = 400;
    for (int draw = 0; draw < kDraws; ++draw) {
      const Mat3 wanted = glm::mat3_cast(stimuli::uniform_rotation(random));
      double nearest = 180;
      for (int i = 0; i < hypotheses.shapes()[0].count; ++i) {
        nearest = std::min(nearest, angle(kKinds[k], wanted, hypotheses.rotation(i)));
      }
      worst = std::max(worst, nearest);
      sum += nearest;
    }
    EXPECT_LT(worst, bounds[k]) << k;
    EXPECT_LT(sum / kDraws, typical[k]) << k;
  }
}

TEST(ShapeHypotheses, HypothesesAreDistinct) {
  for (const stimuli::ShapeKind kind :
       {stimuli::ShapeKind::cone, stimuli::ShapeKind::cylinder, stimuli::ShapeKind::cube}) {
    const ShapeHypotheses hypotheses({spec(kind)});
    for (int i = 0; i < hypotheses.shapes()[0].count; i += 7) {
      for (int j = 0; j < i; ++j) {
        ASSERT_GT(angle(kind, hypotheses.rotation(i), hypotheses.rotation(j)), 2) << i << ' ' << j;
      }
    }
  }
}

std::string message_of(const std::vector<stimuli::ObjectSpec>& stimuli) {
  try {
    const ShapeHypotheses hypotheses(stimuli);
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return {};
}

TEST(ShapeHypotheses, NamesEveryStimulusThatCannotBeSimulated) {
  stimuli::ObjectSpec flat = spec(stimuli::ShapeKind::cylinder);
  flat.height = 0;
  stimuli::ObjectSpec air = spec(stimuli::ShapeKind::box);
  air.material.stiffness = 0;
  stimuli::ObjectSpec airy = spec(stimuli::ShapeKind::compound);
  airy.parts = {air, air};
  const std::string message = message_of({air, spec(stimuli::ShapeKind::sphere), airy, flat});
  EXPECT_NE(message.find("stimulus 1: it has no stiffness anywhere"), std::string::npos);
  EXPECT_EQ(message.find("stimulus 2"), std::string::npos);
  EXPECT_NE(message.find("stimulus 3: it has no stiffness"), std::string::npos);
  EXPECT_NE(message.find("stimulus 4: its height"), std::string::npos);
  EXPECT_NE(message_of({}).find("no stimuli"), std::string::npos);
}

// A centred shape with a formula uses it; the formula does not apply to shapes off the centre or
// felt below their surface.
TEST(ShapeHypotheses, OnlyCentredPlainShapesHaveFormulas) {
  stimuli::ObjectSpec moved = spec(stimuli::ShapeKind::cube);
  moved.pose.position = Vec3(0.01, 0, 0);
  const ShapeHypotheses hypotheses(
      {spec(stimuli::ShapeKind::cube), moved, spec(stimuli::ShapeKind::box)});
  EXPECT_FALSE(hypotheses.shapes()[0].field);
  EXPECT_EQ(hypotheses.shapes()[0].count, 384);
  ASSERT_TRUE(hypotheses.shapes()[1].field);
  EXPECT_NEAR(hypotheses.shapes()[1].field->distance(0.05F, 0, 0), 0.01, 1e-4);
  EXPECT_EQ(hypotheses.shapes()[1].count, 9120 / 4) << "four turns about x";
  ASSERT_TRUE(hypotheses.shapes()[2].field) << "a box of 0.06 m";
  EXPECT_EQ(hypotheses.shapes()[2].count, 384) << "as the cube of that edge";
}

// The order in which they are looked at leaves none out, and has similar rotations side by side.
TEST(ShapeHypotheses, TheOrderByRotationHasEachOnceNearItsLikes) {
  const ShapeHypotheses hypotheses({spec(stimuli::ShapeKind::cube), spec(stimuli::ShapeKind::box)});
  for (const ShapeHypotheses::Shape& shape : hypotheses.shapes()) {
    const int* const order = hypotheses.nearby_order() + shape.first;
    std::vector<int> sorted(order, order + shape.count);
    const auto far = [&](int a, int b) {
      const Mat3 turn = glm::transpose(hypotheses.rotation(a)) * hypotheses.rotation(b);
      return std::acos(std::clamp((turn[0][0] + turn[1][1] + turn[2][2] - 1) / 2, -1.0, 1.0));
    };
    double by_order = 0, by_index = 0;
    for (int i = 1; i < shape.count; ++i) {
      by_order += far(order[i - 1], order[i]);
      by_index += far(shape.first + i - 1, shape.first + i);
    }
    if (shape.field) {
      EXPECT_LT(by_order, 0.7 * by_index);
    }
    std::sort(sorted.begin(), sorted.end());
    for (int i = 0; i < shape.count; ++i)
      ASSERT_EQ(sorted[static_cast<std::size_t>(i)], shape.first + i);
  }
}

}  // namespace
}  // namespace palpate::runner::participants
