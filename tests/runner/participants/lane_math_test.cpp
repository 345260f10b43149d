#include "runner/participants/lane_math.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <vector>

#include "data/base/random.h"

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

// Whatever the width of the processor's registers, each lane has the bits of a single float.
TEST(Lanes, HaveTheBitsOfSingleFloats) {
  constexpr std::uint64_t kSeed = 1;
  Random random(kSeed);
  std::vector<float> x(lane::kWidth), y(lane::kWidth), root(lane::kWidth), mixed(lane::kWidth);
  for (int trial = 0; trial < 200; ++trial) {
    for (float& value : x) value = static_cast<float>(random.unit());
    for (float& value : y) value = static_cast<float>(random.normal());
    const lane::Floats a = lane::load(x.data()), b = lane::load(y.data());
    lane::store(lane::sqrt(a), root.data());
    lane::store(lane::mix(a, b, lane::max(lane::abs(b), lane::all(0.5F))), mixed.data());
    for (std::size_t i = 0; i < x.size(); ++i) {
      ASSERT_EQ(root[i], std::sqrt(x[i]));
      ASSERT_EQ(mixed[i], x[i] + lane::max(std::abs(y[i]), 0.5F) * (y[i] - x[i]));
    }
  }
}

TEST(Lanes, HaveTheFunctionsOfASingleFloat) {
  constexpr std::uint64_t kSeed = 3;
  Random random(kSeed);
  for (int trial = 0; trial < 2000; ++trial) {
    lane::Floats x{};
    for (int i = 0; i < lane::kWidth; ++i) x[i] = static_cast<float>(20 * random.unit() - 12);
    const lane::Floats exp = lane::exp(8.0f * x), log = lane::log(lane::abs(x) + 1e-6f),
                       cdf = lane::log_normal_cdf(x);
    for (int i = 0; i < lane::kWidth; ++i) {
      ASSERT_EQ(exp[i], lane::exp(8.0f * x[i]));
      ASSERT_EQ(log[i], lane::log(std::abs(x[i]) + 1e-6f));
      ASSERT_EQ(cdf[i], lane::log_normal_cdf(x[i]));
    }
  }
}

TEST(Lanes, AreWithinOnlyIfAllAre) {
  const float end[3] = {1, 2, 3};
  for (int axis = 0; axis < 3; ++axis) {
    for (int i = 0; i < lane::kWidth; ++i) {
      lane::Floats x[3] = {lane::all(0), lane::all(1.5f), lane::all(2.999f)};
      ASSERT_TRUE(lane::all_within(x, end));
      for (const float out : {-1e-9f, -5.0f, end[axis], 1e9f, std::nanf("")}) {
        x[axis][i] = out;
        ASSERT_FALSE(lane::all_within(x, end)) << axis << ' ' << i << ' ' << out;
      }
    }
  }
}

TEST(Lanes, CountTheFirst) {
  for (int count = -1; count <= lane::kWidth + 1; ++count) {
    const lane::Ints flags = lane::first_lanes(count);
    for (int i = 0; i < lane::kWidth; ++i) ASSERT_EQ(flags[i], i < count ? -1 : 0);
  }
}

TEST(Lanes, LookUpNeighboursAnywhere) {
  std::vector<float> table(1000);
  std::iota(table.begin(), table.end(), 0.0F);
  constexpr std::uint64_t kSeed = 2;
  Random random(kSeed);
  for (int trial = 0; trial < 200; ++trial) {
    lane::Ints at{};
    for (int i = 0; i < lane::kWidth; ++i)
      at[i] = static_cast<std::int32_t>(random.below(table.size() - 1));
    const lane::Pairs found = lane::pairs(table.data(), at);
    for (int i = 0; i < lane::kWidth; ++i) {
      ASSERT_EQ(found.first[i], static_cast<float>(at[i]));
      ASSERT_EQ(found.second[i], static_cast<float>(at[i] + 1));
    }
  }
}

TEST(Lanes, StoreTheFlaggedOnesSideBySide) {
  lane::Ints numbers{};
  for (int i = 0; i < lane::kWidth; ++i) numbers[i] = i;
  for (unsigned pattern = 0; pattern<1U << lane::kWidth; pattern += lane::kWidth> 8 ? 7 : 1) {
    lane::Ints flags{};
    std::vector<int> expected, stored(lane::kWidth);
    for (int i = 0; i < lane::kWidth; ++i) {
      if ((pattern >> i & 1U) == 0) continue;
      flags[i] = -1;
      expected.push_back(i);
    }
    ASSERT_EQ(lane::any(flags), pattern != 0);
    stored.resize(static_cast<std::size_t>(lane::store_flagged(numbers, flags, stored.data())));
    ASSERT_EQ(stored, expected);
  }
}

}  // namespace
}  // namespace palpate::runner::participants
