#include "runner/participants/lane_math.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace palpate::runner::participants {
namespace {

TEST(LaneMath, ExpIsWithin3e7OfTheStandardLibrary) {
  double worst = 0;
  for (float x = -87.0f; x < 88.0f; x += 0.0037f) {
    const double exact = std::exp(static_cast<double>(x));
    worst = std::max(worst, std::abs(lane::exp(x) - exact) / exact);
  }
  EXPECT_LT(worst, 3e-7);
  EXPECT_EQ(lane::exp(0.0f), 1.0f);
}

TEST(LaneMath, ExpIsTinyAndNormalFarBelowItsRange) {
  for (const float x : {-88.0f, -1e4f, -std::numeric_limits<float>::infinity()}) {
    EXPECT_GE(lane::exp(x), std::numeric_limits<float>::min());
    EXPECT_LT(lane::exp(x), 1e-37f);
  }
}

TEST(LaneMath, LogIsWithinItsBoundOfTheStandardLibrary) {
  for (float x = 1e-36f; x < 1e36f; x *= 1.0013f) {
    const double exact = std::log(static_cast<double>(x));
    ASSERT_NEAR(lane::log(x), exact, 2e-7 + 1.2e-7 * std::abs(exact)) << x;
  }
  EXPECT_EQ(lane::log(1.0f), 0.0f);
}

TEST(LaneMath, LogNormalCdfIsWithinItsBound) {
  for (float x = -30.0f; x < 30.0f; x += 0.0031f) {
    const double exact = x < 5.0f
                             ? std::log(std::erfc(-static_cast<double>(x) / std::sqrt(2.0)) / 2)
                             : std::log1p(-std::erfc(static_cast<double>(x) / std::sqrt(2.0)) / 2);
    ASSERT_NEAR(lane::log_normal_cdf(x), exact, std::max(5e-6, 1e-6 * std::abs(exact))) << x;
  }
}

TEST(LaneMath, LogNormalCdfIsZeroFromTheStatedBound) {
  EXPECT_NE(lane::log_normal_cdf(5.0f), 0.0f);
  for (float x = lane::kLogNormalCdfIsZero; x < 1e6f; x *= 1.000001f)
    ASSERT_EQ(lane::log_normal_cdf(x), 0.0f) << x;
}

}  // namespace
}  // namespace palpate::runner::participants
