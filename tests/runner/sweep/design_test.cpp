#include "runner/sweep/design.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "data/base/sobol.h"

namespace palpate::runner::sweep {
namespace {

std::vector<protocols::SweepParameter> parameters(std::size_t n) {
  return std::vector<protocols::SweepParameter>(n);
}

protocols::SweepParameter choice_of(std::size_t values) {
  protocols::SweepParameter one;
  one.distribution = protocols::DistributionKind::choice;
  for (std::size_t i = 0; i < values; ++i) one.values.emplace_back(i);
  return one;
}

// The first points as published by Joe and Kuo for their direction numbers (new-joe-kuo-6.21201).
TEST(SobolSequence, FirstPointsAreThePublishedOnes) {
  const std::vector<std::vector<double>> published{
      {0, 0, 0, 0, 0, 0, 0, 0, 0, 0},
      {.5, .5, .5, .5, .5, .5, .5, .5, .5, .5},
      {.75, .25, .25, .25, .75, .75, .25, .75, .75, .75},
      {.25, .75, .75, .75, .25, .25, .75, .25, .25, .25},
      {.375, .375, .625, .875, .375, .125, .375, .875, .875, .625},
      {.875, .875, .125, .375, .875, .625, .875, .375, .375, .125}};
  for (std::size_t i = 0; i < published.size(); ++i) {
    const std::vector<std::uint64_t> digits = sobol_digits(i, 10);
    for (std::size_t d = 0; d < 10; ++d)
      EXPECT_EQ(std::ldexp(static_cast<double>(digits[d]), -64), published[i][d]) << i << " " << d;
  }
}

// Each of 2^m equal parts of every dimension holds one of the first 2^m points; so do those of size
// 2^a x 2^b in the first two dimensions, whose quality parameter t is 0.
TEST(SobolSequence, FillsDyadicBoxesEvenly) {
  constexpr std::size_t kDimensions = 60;
  std::vector<std::set<std::uint64_t>> parts(kDimensions);
  std::set<std::pair<std::uint64_t, std::uint64_t>> boxes;
  for (std::uint64_t i = 0; i < 256; ++i) {
    const std::vector<std::uint64_t> digits = sobol_digits(i, kDimensions);
    for (std::size_t d = 0; d < kDimensions; ++d) parts[d].insert(digits[d] >> 56U);
    boxes.insert({digits[0] >> 61U, digits[1] >> 59U});
  }
  for (const auto& part : parts) EXPECT_EQ(part.size(), 256u);
  EXPECT_EQ(boxes.size(), 256u);
  EXPECT_THROW(sobol_digits(1, 0), std::invalid_argument);
  EXPECT_THROW(sobol_digits(1, kMostSobolDimensions + 1), std::invalid_argument);
  EXPECT_EQ(sobol_digits(3, kMostSobolDimensions).size(), kMostSobolDimensions);
}

TEST(Design, PermutationsAreOneToOneAndDiffer) {
  for (const std::uint64_t count : {1u, 2u, 3u, 5u, 8u, 100u, 257u, 1000u}) {
    std::set<std::uint64_t> images;
    for (std::uint64_t i = 0; i < count; ++i) images.insert(permuted(i, count, 7));
    EXPECT_EQ(images.size(), count);
    EXPECT_LT(*images.rbegin(), count);
  }
  // The image of 0 is distributed evenly over keys: 5 cells, 5000 keys, chi squared with 4 degrees
  // of freedom.
  std::vector<double> seen(5);
  for (std::uint64_t key = 0; key < 5000; ++key) ++seen[permuted(0, 5, key)];
  double chi2 = 0;
  for (const double n : seen) chi2 += (n - 1000) * (n - 1000) / 1000;
  EXPECT_LT(chi2, 18.5);  // p = 0.001
}

TEST(Design, LatinHypercubeHasOnePointInEachPart) {
  const Design design(DesignKind::lhs, 50, 3, parameters(4));
  std::vector<std::vector<double>> points;
  for (std::int64_t i = 1; i <= 50; ++i) points.push_back(design.at(i));
  for (std::size_t d = 0; d < 4; ++d) {
    std::set<int> parts;
    for (const auto& point : points) parts.insert(static_cast<int>(point[d] * 50));
    EXPECT_EQ(parts.size(), 50u);
  }
  EXPECT_NE(Design(DesignKind::lhs, 50, 4, parameters(4)).at(1), points[0]);
  EXPECT_EQ(Design(DesignKind::lhs, 50, 3, parameters(4)).at(17), points[16]);
  EXPECT_THROW(design.at(0), std::out_of_range);
  EXPECT_THROW(design.at(51), std::out_of_range);
}

TEST(Design, SobolIsShiftedByTheSeedAndStaysEven) {
  const Design design(DesignKind::sobol, 64, 9, parameters(3));
  for (std::size_t d = 0; d < 3; ++d) {
    std::set<int> parts;
    for (std::int64_t i = 1; i <= 64; ++i) parts.insert(static_cast<int>(design.at(i)[d] * 64));
    EXPECT_EQ(parts.size(), 64u);
  }
  EXPECT_NE(design.at(1), Design(DesignKind::sobol, 64, 10, parameters(3)).at(1));
}

TEST(Design, GridsHaveAllCombinationsWithTheirEnds) {
  std::vector<protocols::SweepParameter> two = parameters(2);
  two.push_back(choice_of(3));
  const Design design(DesignKind::grid, 40, 1, two);
  ASSERT_EQ(design.size(), 36);  // 4 x 3 x 3
  std::set<std::vector<double>> points;
  for (std::int64_t i = 1; i <= design.size(); ++i) points.insert(design.at(i));
  EXPECT_EQ(points.size(), 36u);
  for (const double share : {0.0, 1.0}) EXPECT_TRUE(points.count({share, 1 - share, 0.5}));
  EXPECT_EQ(Design(DesignKind::grid, 3, 1, two).size(), 3);
  EXPECT_THROW(Design(DesignKind::grid, 2, 1, two), std::invalid_argument);
}

TEST(Design, SaltellisSamplesDifferInOneParameterFromTheFirst) {
  constexpr std::size_t kParameters = 3;
  const Design design(DesignKind::saltelli, 101, 5, parameters(kParameters));
  ASSERT_EQ(design.size(), 100);
  for (std::int64_t base = 0; base < design.size(); base += kParameters + 2) {
    const std::vector<double> a = design.at(base + 1), b = design.at(base + 2);
    for (std::size_t i = 0; i < kParameters; ++i) {
      std::vector<double> expected = a;
      expected[i] = b[i];
      EXPECT_EQ(design.at(base + 3 + static_cast<std::int64_t>(i)), expected);
      EXPECT_NE(a[i], b[i]);
    }
  }
  EXPECT_THROW(Design(DesignKind::saltelli, 4, 5, parameters(kParameters)), std::invalid_argument);
}

}  // namespace
}  // namespace palpate::runner::sweep
