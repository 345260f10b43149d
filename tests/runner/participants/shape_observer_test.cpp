#include "runner/participants/shape_observer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <numbers>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "data/base/random.h"
#include "stimuli/orientation.h"
#include "tests/runner/participants/ideal_touches.h"
#include "tests/runner/participants/observer_reference.h"

namespace palpate::runner::participants {
namespace {

using test::four_shapes;
using test::random_direction;
using test::touch;

Percept far_away() {
  Percept percept;
  percept.tip = {1, 0, 0};
  return percept;
}

/// Two spheres have one hypothesis each, so the log odds show the likelihoods as they are.
class TwoSpheres : public ::testing::Test {
 protected:
  static std::vector<stimuli::ObjectSpec> spheres() {
    std::vector<stimuli::ObjectSpec> made(2);
    made[0].radius = 0.030;
    made[1].radius = 0.035;
    return made;
  }
  double log_odds() const { return std::log(observer_.probability(0) / observer_.probability(1)); }

  ShapeHypotheses hypotheses_{spheres()};
  ObserverSettings settings_;
  ShapeObserver observer_{hypotheses_, settings_};
  double variance_ = 2 * 0.003 * 0.003;  // m^2
};

TEST_F(TwoSpheres, ContactOfAPoint) {
  Percept p;
  p.contact = true;
  p.tip = {0.030, 0, 0};
  p.direction = {1, 0, 0};
  observer_.update(p);
  EXPECT_NEAR(log_odds(), 0.25 * 0.005 * 0.005 / (2 * variance_), 1e-5);
}

TEST_F(TwoSpheres, DirectionHasTheSameWeightForBoth) {
  Percept p;
  p.contact = true;
  p.tip = {0.030, 0, 0};
  p.direction = {0.8, 0.6, 0};
  observer_.update(p);
  EXPECT_NEAR(log_odds(), 0.25 * 0.005 * 0.005 / (2 * variance_), 1e-5);
}

TEST_F(TwoSpheres, ContactOfARayIsAtItsDeepestPoint) {
  Percept p;
  p.contact = true;
  p.ray = true;
  p.tip = {0.030, -0.07, 0};
  p.tail = {0.030, 0.05, 0};
  p.direction = {1, 0, 0};
  observer_.update(p);
  EXPECT_NEAR(log_odds(), 0.25 * 0.005 * 0.005 / (2 * variance_), 1e-5);
}

TEST_F(TwoSpheres, FreeSpaceInsideOneAndOutsideTheOther) {
  Percept p;
  p.tip = {0.0325, 0, 0};
  observer_.update(p);
  const double x = 0.0025 / std::sqrt(2 * variance_);
  EXPECT_NEAR(log_odds(), 0.25 * 0.2 * std::log(std::erfc(-x) / std::erfc(x)), 1e-5);
  EXPECT_LT(observer_.probability(1), 0.5);
}

TEST_F(TwoSpheres, RayFreesSpaceOfWholeStylus) {
  Percept p;
  p.ray = true;
  p.tip = {0.0325, -0.07, 0};
  p.tail = {0.0325, 0.05, 0};
  observer_.update(p);
  const double x = 0.0025 / std::sqrt(2 * variance_);
  EXPECT_NEAR(log_odds(), 0.25 * 0.2 * std::log(std::erfc(-x) / std::erfc(x)), 1e-5);
}

TEST_F(TwoSpheres, NoPerceptCountsMoreThanTheFloor) {
  Percept p;
  p.contact = true;
  p.tip = {0.030, 0, 0};
  p.direction = {1, 0, 0};
  for (const double x : {1.0, 100.0, 1e6}) {
    p.tip.x = x;
    observer_.update(p);
    EXPECT_EQ(log_odds(), 0) << x;
  }
}

TEST_F(TwoSpheres, MemoryFadesByLambda) {
  Percept p;
  p.contact = true;
  p.tip = {0.030, 0, 0};
  p.direction = {1, 0, 0};
  observer_.update(p);
  const double before = log_odds();
  for (int i = 0; i < 9; ++i) observer_.update(far_away());
  EXPECT_NEAR(log_odds(), before * std::exp(-9 / (6.0 * 15.0)), 2e-5);
}

TEST(ShapeObserver, StartsWithEqualShapes) {
  const ShapeHypotheses hypotheses(four_shapes());
  const ShapeObserver observer(hypotheses);
  for (int s = 0; s < 4; ++s) EXPECT_NEAR(observer.probability(s), 0.25, 1e-6);
  EXPECT_FALSE(observer.decided());
}

TEST(ShapeObserver, ForgetsBackToThePrior) {
  const ShapeHypotheses hypotheses(four_shapes());
  ShapeObserver observer(hypotheses);
  constexpr std::uint64_t kSeed = 5;
  Random random(kSeed);
  for (int i = 0; i < 60; ++i) {
    observer.update(touch(four_shapes()[3], Mat3(1), true, 0, 0, random));
  }
  EXPECT_GT(observer.probability(3), 0.9);
  for (int i = 0; i < 6 * 15 * 20; ++i) observer.update(far_away());
  for (int s = 0; s < 4; ++s) EXPECT_NEAR(observer.probability(s), 0.25, 1e-3);
}

TEST(ShapeObserver, ResetRestoresThePrior) {
  const ShapeHypotheses hypotheses(four_shapes());
  ShapeObserver observer(hypotheses);
  const ShapeObserver fresh(hypotheses);
  constexpr std::uint64_t kSeed = 5;
  Random random(kSeed);
  observer.update(touch(four_shapes()[1], Mat3(1), false, 0, 0, random));
  EXPECT_NE(observer.probability(1), fresh.probability(1));
  observer.reset();
  for (int s = 0; s < 4; ++s) EXPECT_EQ(observer.probability(s), fresh.probability(s));
}

// Far from a shape its orientation cannot matter and is not evaluated. Checks this bound from near
// to far.
TEST(ShapeObserver, FreeSpaceAgreesWithTheFormulasFromNearToFar) {
  std::vector<stimuli::ObjectSpec> slender = four_shapes();
  slender[1].radius = slender[2].radius = 0.01;
  slender[1].height = 0.12;
  slender[2].height = 0.16;
  const ShapeHypotheses hypotheses(slender);
  ObserverSettings settings;
  settings.free_space_weight = 1;
  constexpr std::uint64_t kSeed = 16;
  Random random(kSeed);
  double least = 1, most = 0;  // of the spheres' probabilities: both near and far are tested
  for (int n = 0; n < 80; ++n) {
    ShapeObserver observer(hypotheses, settings);
    test::ReferenceObserver reference(slender, hypotheses, settings);
    Percept p;
    p.ray = n % 2 == 1;
    p.tip = (0.03 + 0.0009 * n) * random_direction(random);
    p.tail = p.tip + 0.12 * random_direction(random);
    observer.update(p);
    reference.update(p);
    const std::vector<double> expected = reference.probabilities();
    for (int s = 0; s < 4; ++s)
      ASSERT_NEAR(observer.probability(s), expected[static_cast<std::size_t>(s)], 3e-6) << n;
    least = std::min(least, expected[0]);
    most = std::max(most, expected[0]);
  }
  EXPECT_GT(most - least, 0.01);
}

TEST(ShapeObserver, AgreesWithTheFormulasInDoublePrecision) {
  const ShapeHypotheses hypotheses(four_shapes());
  const ObserverSettings settings;
  constexpr std::uint64_t kSeed = 6;
  Random random(kSeed);
  double worst = 0;
  for (int object = 0; object < 4; ++object) {
    ShapeObserver observer(hypotheses, settings);
    test::ReferenceObserver reference(four_shapes(), hypotheses, settings);
    const Mat3 r = glm::mat3_cast(stimuli::uniform_rotation(random));
    for (int n = 0; n < 16; ++n) {
      Percept p =
          touch(four_shapes()[static_cast<std::size_t>(object)], r, n % 4 > 1, 0.003, 0.25, random);
      if (n % 4 == 3) p.along.reset();
      if (n % 5 == 4) p.contact = false;
      observer.update(p);
      reference.update(p);
      const std::vector<double> expected = reference.probabilities();
      double sum = 0;
      for (int s = 0; s < 4; ++s) {
        worst = std::max(worst,
                         std::abs(observer.probability(s) - expected[static_cast<std::size_t>(s)]));
        sum += observer.probability(s);
      }
      ASSERT_NEAR(sum, 1, 1e-12);
    }
  }
  RecordProperty("worst_difference_1e9", static_cast<int>(worst * 1e9));
  EXPECT_LT(worst, 1e-3);
}

/// Share of 20 objects of each shape that are named right after 60 percepts.
double accuracy(bool ray, double place_noise, double direction_noise) {
  const ShapeHypotheses hypotheses(four_shapes());
  constexpr std::uint64_t kSeed = 7;
  Random random(kSeed);
  int right = 0;
  for (int trial = 0; trial < 80; ++trial) {
    ShapeObserver observer(hypotheses);
    const stimuli::ObjectSpec object = four_shapes()[static_cast<std::size_t>(trial % 4)];
    const Mat3 r = glm::mat3_cast(stimuli::uniform_rotation(random));
    for (int n = 0; n < 60; ++n) {
      observer.update(touch(object, r, ray, place_noise, direction_noise, random));
    }
    if (observer.best() == trial % 4) ++right;
  }
  return right / 80.0;
}

TEST(ShapeObserver, IdentifiesShapesWithoutNoise) {
  EXPECT_GE(accuracy(false, 0, 0), 0.98);
  EXPECT_GE(accuracy(true, 0, 0), 0.98);
}

TEST(ShapeObserver, IdentifiesShapesWithNoise) {
  EXPECT_GE(accuracy(false, 0.002, 0.15), 0.95);
  EXPECT_GE(accuracy(true, 0.002, 0.15), 0.95);
}

TEST(ShapeObserver, DecidesAboveTheThreshold) {
  const ShapeHypotheses hypotheses(four_shapes());
  ObserverSettings settings;
  settings.threshold = 0.6;
  ShapeObserver observer(hypotheses, settings);
  constexpr std::uint64_t kSeed = 8;
  Random random(kSeed);
  bool decided = false;
  for (int n = 0; n < 60; ++n) {
    observer.update(touch(four_shapes()[2], Mat3(1), false, 0, 0, random));
    EXPECT_EQ(observer.decided(), observer.probability(observer.best()) > 0.6);
    decided = decided || observer.decided();
  }
  EXPECT_TRUE(decided);
}

TEST(ShapeObserver, FreeSpaceIsEvidenceAgainstShapesThere) {
  const ShapeHypotheses hypotheses(four_shapes());
  ShapeObserver observer(hypotheses);
  constexpr std::uint64_t kSeed = 9;
  Random random(kSeed);
  // 4 mm inside the sphere, all round: a cone has room for that.
  for (int n = 0; n < 200; ++n) {
    Percept p;
    p.tip = 0.026 * random_direction(random);
    if (stimuli::signed_distance(four_shapes()[1], p.tip).distance > 0.003) observer.update(p);
  }
  EXPECT_LT(observer.probability(0), 0.15);
  EXPECT_GT(observer.probability(1), 0.4);
}

// A flat contact has no unique place along the stylus: the place given by torque must not count
// against the cube.
TEST(ShapeObserver, PositionMattersOnASphereButNotOnAFlatFace) {
  std::vector<stimuli::ObjectSpec> stimuli{four_shapes()[0], four_shapes()[3]};
  const ShapeHypotheses hypotheses(stimuli);
  ObserverSettings settings;
  const test::ReferenceObserver reference(stimuli, hypotheses, settings);
  Percept p;
  p.contact = true;
  p.ray = true;
  p.tip = {-0.06, 0, 0.03};
  p.tail = {0.06, 0, 0.03};
  p.direction = {0, 0, 1};
  double odds[2];  // cube over sphere, the contact in the middle and 2 cm from it
  for (int k = 0; k < 2; ++k) {
    p.along = 0.06 + 0.02 * k;
    ShapeObserver observer(hypotheses, settings);
    for (int n = 0; n < 60; ++n) observer.update(p);
    odds[k] = std::log(observer.probability(1) / observer.probability(0));
  }
  const double cube = reference.log_likelihood(stimuli[1], Mat3(1), p);
  p.along = 0.06;
  EXPECT_NEAR(cube, reference.log_likelihood(stimuli[1], Mat3(1), p), 0.25);
  EXPECT_GT(odds[1], odds[0] + 0.1);
}

TEST(ShapeObserver, ThreadsThatShareHypothesesAgreeToTheBit) {
  const ShapeHypotheses hypotheses(four_shapes());
  std::vector<ShapeObserver> observers(3, ShapeObserver(hypotheses));
  const auto watch = [](ShapeObserver& observer) {
    constexpr std::uint64_t kSeed = 10;
    Random random(kSeed);
    for (int n = 0; n < 40; ++n) {
      observer.update(touch(four_shapes()[1], Mat3(1), n % 2 == 0, 0.002, 0.1, random));
    }
  };
  std::thread first(watch, std::ref(observers[0]));
  std::thread second(watch, std::ref(observers[1]));
  first.join();
  second.join();
  watch(observers[2]);
  for (int s = 0; s < 4; ++s) {
    EXPECT_EQ(observers[0].probability(s), observers[2].probability(s));
    EXPECT_EQ(observers[1].probability(s), observers[2].probability(s));
  }
}

TEST(ShapeObserver, AStylusWithoutLengthIsAPoint) {
  const ShapeHypotheses hypotheses(four_shapes());
  ShapeObserver as_ray(hypotheses);
  ShapeObserver as_point(hypotheses);
  constexpr std::uint64_t kSeed = 11;
  Random random(kSeed);
  Percept p = touch(four_shapes()[3], Mat3(1), false, 0.002, 0.1, random);
  as_point.update(p);
  p.ray = true;
  p.tail = p.tip;
  as_ray.update(p);
  for (int s = 0; s < 4; ++s) EXPECT_NEAR(as_ray.probability(s), as_point.probability(s), 1e-5);
}

TEST(ShapeObserver, NamesEverySettingThatIsOutOfRange) {
  const ShapeHypotheses hypotheses(four_shapes());
  ObserverSettings settings;
  settings.places_along = 1;
  settings.memory = 0;
  settings.threshold = 1;
  try {
    const ShapeObserver observer(hypotheses, settings);
    FAIL() << "accepted";
  } catch (const std::invalid_argument& error) {
    const std::string message = error.what();
    EXPECT_NE(message.find("places_along"), std::string::npos);
    EXPECT_NE(message.find("memory"), std::string::npos);
    EXPECT_NE(message.find("threshold"), std::string::npos);
    EXPECT_EQ(message.find("beta"), std::string::npos);
  }
}

}  // namespace
}  // namespace palpate::runner::participants
