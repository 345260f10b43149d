#include "rendering/bodies/complementarity.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <vector>

#include "data/base/random.h"

namespace palpate::rendering::test {
namespace {

double uniform(Random& random, double low, double high) {
  return low + (high - low) * random.unit();
}

/// A = J J^T of rank at most `rank`, and its solution by definition.
void fill_random(Random& random, std::size_t n, std::size_t rank, ComplementarityProblem& p) {
  std::vector<double> j(n * rank);
  for (double& value : j) value = uniform(random, -1, 1);
  p.clear();
  for (std::size_t i = 0; i < n; ++i) p.add_row(uniform(random, -1, 1), HUGE_VAL);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t k = 0; k < n; ++k) {
      p.a(i, k) = 0;
      for (std::size_t r = 0; r < rank; ++r) p.a(i, k) += j[i * rank + r] * j[k * rank + r];
    }
  }
}

TEST(Complementarity, HoldsByDefinition) {
  constexpr std::uint64_t kSeed = 3;
  Random random(kSeed);
  ComplementarityProblem p;
  for (int trial = 0; trial < 300; ++trial) {
    const std::size_t n = 1 + static_cast<std::size_t>(uniform(random, 0, 30));
    fill_random(random, n, n + 2, p);
    EXPECT_TRUE(p.solve()) << trial;
    EXPECT_LE(p.residual(), 1e-9) << trial;
    for (const double x : p.x()) EXPECT_GE(x, 0);
  }
}

/// More contacts than degrees of freedom, which some motion obeys, as of a wedged body.
TEST(Complementarity, WedgedBodyObeysEveryContact) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    Random random(seed);
    ComplementarityProblem p;
    for (int trial = 0; trial < 300; ++trial) {
      const std::size_t rank = 2 + random.below(5), n = rank + 1 + random.below(14);
      std::vector<double> j(n * rank), motion(rank);
      for (double& value : j) value = uniform(random, -1, 1);
      for (double& value : motion) value = uniform(random, -1, 1);
      p.clear();
      for (std::size_t i = 0; i < n; ++i) {
        double speed = 0;
        for (std::size_t r = 0; r < rank; ++r) speed += j[i * rank + r] * motion[r];
        p.add_row(speed - (random.below(2) == 0 ? 0 : random.unit()), HUGE_VAL);
      }
      for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t k = 0; k < n; ++k) {
          p.a(i, k) = 0;
          for (std::size_t r = 0; r < rank; ++r) p.a(i, k) += j[i * rank + r] * j[k * rank + r];
        }
      }
      EXPECT_TRUE(p.solve()) << seed << ' ' << trial;
      EXPECT_LE(p.residual(), 1e-7) << seed << ' ' << trial;
    }
  }
}

/// Redundant contacts of a face: four contacts of a body with three degrees of freedom.
TEST(Complementarity, RedundantContactsAreHarmless) {
  const double places[4][2] = {{1, 1}, {1, -1}, {-1, 1}, {-1, -1}};
  ComplementarityProblem p;
  for (std::size_t i = 0; i < 4; ++i) p.add_row(1, HUGE_VAL);
  for (std::size_t i = 0; i < 4; ++i)
    for (std::size_t k = 0; k < 4; ++k)
      p.a(i, k) = 1 + 3 * (places[i][0] * places[k][0] + places[i][1] * places[k][1]);
  EXPECT_TRUE(p.solve());
  EXPECT_LE(p.residual(), 1e-12);
  double sum = 0;
  for (const double x : p.x()) sum += x;
  EXPECT_NEAR(sum, 1, 1e-12);  // all four at speed 1: the mass is 1
}

TEST(Complementarity, FrictionNeverExceedsItsShareOfTheNormal) {
  ComplementarityProblem p;
  // A unit mass that falls with speed 1 and slides with speed 2.
  p.add_row(1, HUGE_VAL);
  p.add_row(2, 0.3, 0);
  p.a(0, 0) = p.a(1, 1) = 1;
  p.a(0, 1) = p.a(1, 0) = 0;
  EXPECT_TRUE(p.solve());
  EXPECT_DOUBLE_EQ(p.x()[0], 1);
  EXPECT_DOUBLE_EQ(p.x()[1], 0.3);
  p.clear();
  p.add_row(1, HUGE_VAL);
  p.add_row(0.2, 0.3, 0);
  p.a(0, 0) = p.a(1, 1) = 1;
  p.a(0, 1) = p.a(1, 0) = 0;
  EXPECT_TRUE(p.solve());
  EXPECT_DOUBLE_EQ(p.x()[1], 0.2);  // it sticks
}

}  // namespace
}  // namespace palpate::rendering::test
