#include "protocols/procedures/psychometric.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "protocols/procedures/portable_math.h"

namespace palpate::protocols {
namespace {

TEST(PortableMath, AgreesWithTheStandardLibrary) {
  for (double x = -700; x < 700; x += 0.37)
    EXPECT_NEAR(portable_exp(x) / std::exp(x), 1, 1e-15) << x;
  for (double x = 1e-300; x < 1e300; x *= 1.37)
    EXPECT_NEAR(portable_log(x), std::log(x), 1e-15 * std::max(1.0, std::abs(std::log(x)))) << x;
  for (double x = -9; x < 9; x += 0.0137)
    EXPECT_NEAR(portable_normal_cdf(x), 0.5 * std::erfc(-x / std::sqrt(2.0)), 2e-15) << x;
}

TEST(PortableMath, IsRightAtTheEndsOfItsRange) {
  const double infinity = std::numeric_limits<double>::infinity();
  EXPECT_EQ(portable_exp(-infinity), 0);
  EXPECT_EQ(portable_exp(infinity), infinity);
  EXPECT_EQ(portable_exp(0), 1);
  EXPECT_EQ(portable_log(0), -infinity);
  EXPECT_EQ(portable_log(1), 0);
  EXPECT_EQ(portable_normal_cdf(-infinity), 0);
  EXPECT_EQ(portable_normal_cdf(infinity), 1);
  EXPECT_TRUE(std::isnan(portable_log(-1)));
}

constexpr PsychometricShape kShapes[] = {PsychometricShape::logistic, PsychometricShape::normal,
                                         PsychometricShape::weibull};
constexpr LevelScale kScales[] = {LevelScale::linear, LevelScale::log10, LevelScale::decibel};

TEST(Psychometric, WeibullHasOneExponentOnBothLogarithmicScales) {
  const PsychometricParameters parameters{3, 2.5, 0.5, 0.02};
  for (const double level : {0.5, 3.0, 4.0, 20.0}) {
    const double expected = 0.5 + 0.48 * (1 - std::exp(-std::pow(level / 3, 2.5)));
    for (const LevelScale scale : {LevelScale::log10, LevelScale::decibel}) {
      EXPECT_NEAR(psychometric_probability({PsychometricShape::weibull, scale}, parameters, level),
                  expected, 1e-14);
    }
  }
}

TEST(Psychometric, SlopesAreMeasuredOnTheScale) {
  const PsychometricParameters parameters{10, 2, 0, 0};
  const auto p = [&](LevelScale scale, double level) {
    return psychometric_probability({PsychometricShape::logistic, scale}, parameters, level);
  };
  EXPECT_NEAR(p(LevelScale::linear, 10.5), 1 / (1 + std::exp(-1.0)), 1e-14);
  EXPECT_NEAR(p(LevelScale::log10, 100), 1 / (1 + std::exp(-2.0)), 1e-14);
  EXPECT_NEAR(p(LevelScale::decibel, 11), 1 / (1 + std::exp(-2 * 20 * std::log10(1.1))), 1e-13);
}

TEST(Psychometric, LevelOfAShareIsTheInverse) {
  for (const PsychometricShape shape : kShapes) {
    for (const LevelScale scale : kScales) {
      if (shape == PsychometricShape::weibull && scale == LevelScale::linear) continue;
      for (const Easier easier : {Easier::higher, Easier::lower}) {
        const PsychometricFunction function{shape, scale, easier};
        for (const double share : {0.02, 0.5, 0.9}) {
          const double level = psychometric_level(function, {5, 1.5}, share);
          EXPECT_NEAR(psychometric_core(function, level, 5, 1.5), share, 1e-10);
        }
      }
    }
  }
}

TEST(Psychometric, LogarithmicLevelZeroGivesTheGuessRate) {
  for (const PsychometricShape shape : kShapes) {
    const PsychometricFunction function{shape, LevelScale::log10};
    EXPECT_EQ(psychometric_probability(function, {1, 3, 0.25, 0.1}, 0), 0.25);
    EXPECT_NEAR(psychometric_probability(function, {1, 3, 0.25, 0.1}, 1e12), 0.9, 1e-12);
  }
}

TEST(Psychometric, LowerIsEasierMirrors) {
  PsychometricFunction function{PsychometricShape::normal, LevelScale::linear, Easier::lower};
  EXPECT_NEAR(psychometric_core(function, 4, 5, 1), 0.8413447460685429, 1e-14);
  EXPECT_NEAR(psychometric_core(function, 6, 5, 1), 0.1586552539314571, 1e-14);
}

TEST(Psychometric, ParticipantAnswersAsOftenAsTheFunctionSays) {
  const PsychometricParticipant participant{{}, {10, 1, 0.5, 0.1}};
  constexpr std::uint64_t kSeed = 3;
  Random random(kSeed);
  int successes = 0;
  for (int i = 0; i < 100000; ++i) successes += participant.succeeds(11, random) ? 1 : 0;
  const double p = 0.5 + 0.4 / (1 + std::exp(-1.0));
  EXPECT_NEAR(successes / 1e5, p, 4 * std::sqrt(p * (1 - p) / 1e5));
}

}  // namespace
}  // namespace palpate::protocols
