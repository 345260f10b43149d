// Accumulation of evidence: by percept or by movement, with and without forgetting, and draws from
// the resulting posterior.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "runner/participants/shape_observer.h"
#include "tests/runner/participants/ideal_touches.h"

namespace palpate::runner::participants {
namespace {

using test::by_movement;
using test::four_shapes;

Percept touch_of_a_cube(Random& random) {
  return test::touch(four_shapes()[3], Mat3(1), false, 0.003, 0.2, random);
}

Percept free_space() {
  Percept percept;
  percept.tip = {0.02, 0.02, 0.02};
  return percept;
}

void expect_same(const ShapeObserver& a, const ShapeObserver& b) {
  for (int shape = 0; shape < 4; ++shape) {
    EXPECT_NEAR(a.probability(shape), b.probability(shape), 1e-5) << "shape " << shape;
  }
}

// A percept with weight 1 - exp(-(moved + turn_length turned) / movement_scale) equals one with
// that beta.
TEST(ObserverEvidence, GrowsWithMovementAndTurn) {
  const ShapeHypotheses hypotheses(four_shapes());
  struct {
    double moved, turned, weight;
  } const cases[] = {{0.03, 0, 1 - std::exp(-1.0)},
                     {0, 1, 1 - std::exp(-1.0)},
                     {0.015, 0.5, 1 - std::exp(-1.0)},
                     {0.003, 0.1, 1 - std::exp(-0.2)},
                     {std::numeric_limits<double>::infinity(), 0, 1}};
  for (const auto& c : cases) {
    constexpr std::uint64_t kSeed = 7;
    Random random(kSeed);
    Percept percept = touch_of_a_cube(random);
    percept.moved = c.moved;
    percept.turned = c.turned;
    ShapeObserver observer(hypotheses, by_movement());
    observer.update(percept);
    ObserverSettings weighed;
    weighed.forgetting = false;
    weighed.beta = c.weight;
    ShapeObserver same(hypotheses, weighed);
    same.update(percept);
    expect_same(observer, same);
    EXPECT_GT(std::abs(observer.probability(3) - 0.25), 1e-3) << "it tells nothing";
  }
}

TEST(ObserverEvidence, DoesNotGrowWithoutMovement) {
  const ShapeHypotheses hypotheses(four_shapes());
  ShapeObserver observer(hypotheses, by_movement()), once(hypotheses, by_movement());
  constexpr std::uint64_t kSeed = 8;
  Random random(kSeed);
  Percept percept = touch_of_a_cube(random);
  once.update(percept);
  observer.update(percept);
  percept.moved = percept.turned = 0;
  for (int i = 0; i < 50; ++i) observer.update(percept);
  expect_same(observer, once);
}

TEST(ObserverEvidence, GivesFreeSpaceFullWeight) {
  const ShapeHypotheses hypotheses(four_shapes());
  ShapeObserver observer(hypotheses, by_movement());
  observer.update(free_space());
  ObserverSettings full;
  full.forgetting = false;
  full.beta = 1;
  ShapeObserver same(hypotheses, full);
  same.update(free_space());
  expect_same(observer, same);
}

// Without forgetting, percepts of weight b sum up: two of them are one of weight 2 b.
TEST(ObserverEvidence, DoesNotFadeWithoutForgetting) {
  const ShapeHypotheses hypotheses(four_shapes());
  ObserverSettings settings;
  settings.forgetting = false;
  settings.memory = 1;  // without effect
  ShapeObserver observer(hypotheses, settings);
  settings.beta = 0.5;
  ShapeObserver one(hypotheses, settings);
  constexpr std::uint64_t kSeed = 9;
  Random random(kSeed);
  const Percept percept = touch_of_a_cube(random);
  one.update(percept);
  observer.update(percept);
  observer.update(percept);
  expect_same(observer, one);
}

// One draw from each of n equal parts of the mass: a shape with probability p gets n p draws, apart
// from the two parts shared with its neighbours.
TEST(ObserverEvidence, DrawsFollowThePosterior) {
  const ShapeHypotheses hypotheses(four_shapes());
  ShapeObserver observer(hypotheses, by_movement());
  constexpr std::uint64_t kSeed = 10;
  Random random(kSeed);
  for (int percepts = 0; percepts < 6; ++percepts) {
    for (const int n : {1, 32, 1000}) {
      std::vector<int> drawn(static_cast<std::size_t>(n));
      observer.draw(random, drawn);
      EXPECT_TRUE(std::is_sorted(drawn.begin(), drawn.end()));
      for (std::size_t s = 0; s < 4; ++s) {
        const ShapeHypotheses::Shape& shape = hypotheses.shapes()[s];
        const auto of_shape = std::count_if(drawn.begin(), drawn.end(), [&](int h) {
          return h >= shape.first && h < shape.first + shape.count;
        });
        EXPECT_NEAR(static_cast<double>(of_shape), n * observer.probability(static_cast<int>(s)), 2)
            << "shape " << s << ", " << n << " draws";
      }
    }
    observer.update(touch_of_a_cube(random));
  }
}

// The true orientation is drawn more often than its share of the grid.
TEST(ObserverEvidence, DrawsFollowThePosteriorWithinAShape) {
  const ShapeHypotheses hypotheses(four_shapes());
  ShapeObserver observer(hypotheses, by_movement());
  constexpr std::uint64_t kSeed = 11;
  Random random(kSeed);
  const ShapeHypotheses::Shape& cone = hypotheses.shapes()[1];
  for (int i = 0; i < 40; ++i) {
    observer.update(test::touch(four_shapes()[1], Mat3(1), false, 0.001, 0.05, random));
  }
  std::vector<int> drawn(100);
  observer.draw(random, drawn);
  for (const int h : drawn) {
    ASSERT_GE(h, cone.first);
    ASSERT_LT(h, cone.first + cone.count);
    EXPECT_GT(hypotheses.rotation(h)[2].z, std::cos(0.3)) << "axis of the cone, which is z";
  }
}

TEST(ObserverEvidence, NamesSettingsOutOfRange) {
  const ShapeHypotheses hypotheses(four_shapes());
  ObserverSettings settings;
  settings.movement_scale = 0;
  settings.turn_length = -1;
  try {
    const ShapeObserver observer(hypotheses, settings);
    FAIL() << "was taken";
  } catch (const std::invalid_argument& error) {
    const std::string what = error.what();
    EXPECT_NE(what.find("movement_scale"), std::string::npos) << what;
    EXPECT_NE(what.find("turn_length"), std::string::npos) << what;
  }
}

}  // namespace
}  // namespace palpate::runner::participants
