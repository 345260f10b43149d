#include "analysis/statistics/sensitivity.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <cstdint>
#include <limits>

#include "analysis/statistics/quantiles.h"
#include "data/base/random.h"
#include "tests/analysis/sweep_table_fixture.h"

namespace palpate::analysis {
namespace {

constexpr double kUndefined = std::numeric_limits<double>::quiet_NaN();

// Published values: Newcombe (1998), Stat. Med. 17, 857-872, table I, method 3 (score).
TEST(Wilson, IntervalsAreThePublishedOnes) {
  const struct {
    std::size_t r, n;
    double low, high;
  } cases[] = {{81, 263, 0.2553, 0.3662},
               {15, 148, 0.0624, 0.1605},
               {0, 20, 0, 0.1611},
               {1, 29, 0.0061, 0.1718}};
  for (const auto& one : cases) {
    const Interval ci = wilson_interval(one.r, one.n);
    EXPECT_NEAR(ci.low, one.low, 5e-5);
    EXPECT_NEAR(ci.high, one.high, 5e-5);
    const Interval mirrored = wilson_interval(one.n - one.r, one.n);
    EXPECT_NEAR(mirrored.low, 1 - one.high, 5e-5);
  }
  EXPECT_EQ(wilson_interval(0, 5).low, 0);
  EXPECT_EQ(wilson_interval(5, 5).high, 1);
}

TEST(RankCorrelations, MidranksShareTies) {
  EXPECT_EQ(midranks({3, 1, 3, 2, 3}), (std::vector<double>{4, 1, 4, 2, 4}));
  const double infinite = std::numeric_limits<double>::infinity();
  EXPECT_EQ(midranks({infinite, 0, -infinite, infinite}), (std::vector<double>{3.5, 2, 1, 3.5}));
  EXPECT_EQ(midranks({1, 1.1, 1.2, 1.3}, 0.25), (std::vector<double>{2, 2, 2, 4}));
}

// Kendall's example (ranks of ten students), with 1 - 6 sum d^2 / (n^3 - n) where nothing is tied.
TEST(RankCorrelations, SpearmansIsTheFormulaOfRankDifferences) {
  const std::vector<double> x{2, 13, 6, 5, 10, 3, 8, 4, 1, 9},
      y{30, 20, 40, 10, 60, 70, 50, 90, 80, 100};
  const std::vector<double> rx = midranks(x), ry = midranks(y);
  double squares = 0;
  for (std::size_t i = 0; i < x.size(); ++i) squares += (rx[i] - ry[i]) * (rx[i] - ry[i]);
  const auto found = rank_correlations({x}, y);
  EXPECT_NEAR(*found[0].spearman, 1 - 6 * squares / (1000 - 10), 1e-12);
  EXPECT_NEAR(*found[0].partial, *found[0].spearman, 1e-12);  // nothing else to take out
  // Monotonic, however curved: 1.
  std::vector<double> curved;
  for (const double one : x) curved.push_back(std::exp(one));
  EXPECT_NEAR(*rank_correlations({x}, curved)[0].spearman, 1, 1e-12);
}

/// What linear regression on the other columns leaves of one, with a constant.
Eigen::VectorXd residual(const std::vector<std::vector<double>>& others,
                         const std::vector<double>& of) {
  const auto n = static_cast<Eigen::Index>(of.size());
  Eigen::MatrixXd design(n, static_cast<Eigen::Index>(others.size()) + 1);
  design.col(0).setOnes();
  Eigen::VectorXd y(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    y[i] = of[static_cast<std::size_t>(i)];
    for (std::size_t c = 0; c < others.size(); ++c)
      design(i, static_cast<Eigen::Index>(c) + 1) = others[c][static_cast<std::size_t>(i)];
  }
  return y - design * design.colPivHouseholderQr().solve(y);
}

TEST(RankCorrelations, PartialOnesEqualThoseOfResiduals) {
  constexpr std::uint64_t kSeed = 3;
  Random random(kSeed);
  std::vector<std::vector<double>> inputs(4, std::vector<double>(60));
  std::vector<double> output(60);
  for (std::size_t i = 0; i < 60; ++i) {
    for (auto& input : inputs) input[i] = random.unit();
    inputs[1][i] += inputs[0][i];  // not independent
    inputs[3][i] = inputs[3][i] < 0.5 ? 0 : 1;
    output[i] =
        3 * inputs[0][i] - inputs[1][i] * inputs[1][i] + inputs[3][i] + 0.3 * random.normal();
  }
  output[7] = kUndefined;  // left out
  const auto found = rank_correlations(inputs, output);
  for (auto& input : inputs) input.erase(input.begin() + 7);
  output.erase(output.begin() + 7);
  std::vector<std::vector<double>> ranks;
  for (const auto& input : inputs) ranks.push_back(midranks(input));
  for (std::size_t p = 0; p < 4; ++p) {
    std::vector<std::vector<double>> others = ranks;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(p));
    const Eigen::VectorXd a = residual(others, ranks[p]), b = residual(others, midranks(output));
    EXPECT_NEAR(*found[p].partial, a.dot(b) / a.norm() / b.norm(), 1e-10) << p;
    EXPECT_LT(found[p].partial_ci95->low, *found[p].partial);
    EXPECT_GT(found[p].partial_ci95->high, *found[p].partial);
  }
}

// In 95 % of samples Fisher's interval holds the correlation that they were drawn from: none, here.
TEST(RankCorrelations, IntervalsHoldTheTruthAtTheirRate) {
  constexpr std::uint64_t kSeed = 11;
  Random random(kSeed);
  int spearman = 0, partial = 0;
  constexpr int kSamples = 1000;
  for (int s = 0; s < kSamples; ++s) {
    std::vector<std::vector<double>> inputs(3, std::vector<double>(40));
    std::vector<double> output(40);
    for (std::size_t i = 0; i < 40; ++i) {
      for (auto& input : inputs) input[i] = random.unit();
      output[i] = inputs[1][i] + random.normal();
    }
    const RankCorrelation one = rank_correlations(inputs, output)[0];
    spearman += one.spearman_ci95->low < 0 && one.spearman_ci95->high > 0;
    partial += one.partial_ci95->low < 0 && one.partial_ci95->high > 0;
  }
  EXPECT_NEAR(spearman, 0.95 * kSamples, 25);  // 3.6 standard errors
  EXPECT_NEAR(partial, 0.95 * kSamples, 25);
}

/// Half the interval's length on the scale of Fisher's z, in standard errors of one point.
double half_on_z(const Interval& ci) { return (std::atanh(ci.high) - std::atanh(ci.low)) / 2; }

// Fisher (1924): h variables that are held constant take h points away. Each of p parameters' rank
// correlations holds p - 1 others constant; with one it is Spearman's, with the same interval.
TEST(RankCorrelations, EachParameterHeldConstantTakesOnePointAway) {
  constexpr std::uint64_t kSeed = 21;
  Random random(kSeed);
  for (const std::size_t parameters : {1U, 2U, 3U, 5U}) {
    constexpr std::size_t n = 10;
    std::vector<std::vector<double>> inputs(parameters, std::vector<double>(n));
    std::vector<double> output(n);
    for (std::size_t i = 0; i < n; ++i) {
      for (auto& input : inputs) input[i] = random.unit();
      output[i] = inputs[0][i] + 0.3 * random.normal();
    }
    const auto found = rank_correlations(inputs, output);
    for (const RankCorrelation& one : found) {
      ASSERT_TRUE(one.partial_ci95);
      const double held = static_cast<double>(parameters) - 1, r = *one.partial, s = *one.spearman;
      EXPECT_NEAR(half_on_z(*one.partial_ci95),
                  1.959964 * std::sqrt((1 + r * r / 2) / (n - held - 3)), 1e-5);
      EXPECT_NEAR(half_on_z(*one.spearman_ci95), 1.959964 * std::sqrt((1 + s * s / 2) / (n - 3)),
                  1e-5);
    }
    if (parameters > 1) continue;
    EXPECT_NEAR(found[0].partial_ci95->low, found[0].spearman_ci95->low, 1e-9);
    EXPECT_NEAR(found[0].partial_ci95->high, found[0].spearman_ci95->high, 1e-9);
  }
}

// A strong correlation, few points.
TEST(RankCorrelations, IntervalsOfStrongOnesCoverAtTheirRate) {
  constexpr std::uint64_t kSeed = 12;
  Random random(kSeed);
  const auto sample = [&](std::size_t n) {
    std::vector<std::vector<double>> inputs(3, std::vector<double>(n));
    std::vector<double> output(n);
    for (std::size_t i = 0; i < n; ++i) {
      for (auto& input : inputs) input[i] = random.unit();
      output[i] = inputs[0][i] + 0.5 * inputs[1][i] + 0.3 * random.normal();
    }
    return rank_correlations(inputs, output)[0];
  };
  const double truth = *sample(100000).partial;
  EXPECT_NEAR(truth, 0.7, 0.02);
  int held = 0;
  constexpr int kSamples = 2000;
  for (int s = 0; s < kSamples; ++s) {
    const Interval ci = *sample(14).partial_ci95;
    held += ci.low < truth && truth < ci.high;
  }
  EXPECT_GE(held, 0.94 * kSamples);
  EXPECT_LE(held, 0.98 * kSamples);
}

TEST(RankCorrelations, SaysWhyThereIsNone) {
  const std::vector<double> varies{1, 2, 3, 4, 5};
  EXPECT_FALSE(rank_correlations({varies}, {1, 1, 1, 1, 1})[0].undefined.empty());
  EXPECT_FALSE(rank_correlations({varies, {2, 2, 2, 2, 2}}, varies)[1].undefined.empty());
  EXPECT_FALSE(rank_correlations({varies}, {1, 2, kUndefined, kUndefined, 3})[0].undefined.empty());
  const auto twins = rank_correlations({varies, varies}, {2, 1, 4, 3, 5});
  EXPECT_TRUE(twins[0].spearman);
  EXPECT_FALSE(twins[0].partial);  // nothing tells them apart
}

struct NoisySweep {
  std::vector<double> outputs, errors;
};

/// 10 x1 and chance whose standard deviation, 1 + 4 x1, each study estimates from seven people.
NoisySweep noisy_sweep(std::size_t base_points, Random& random) {
  NoisySweep out;
  for (const auto& x : testing::saltelli_points(3, base_points, [&] { return random.unit(); })) {
    const double sd = 1 + 4 * x[0];
    double squares = 0;
    for (int i = 0; i < 6; ++i) squares += std::pow(random.normal(), 2);
    out.outputs.push_back(10 * x[0] + sd * random.normal());
    out.errors.push_back(sd * std::sqrt(squares / 6));
  }
  return out;
}
constexpr double kOfFirst = 100.0 / 12, kOfChance = 1 + 4 + 16.0 / 3;
constexpr double kFirstShare = kOfFirst / (kOfFirst + kOfChance);

// The variance of x1's part is 100/12, that of chance the mean of (1 + 4 x1)^2.
TEST(SobolIndices, ChanceWithinPointsIsInNoTotalIndex) {
  constexpr std::uint64_t kSeed = 8;
  Random random(kSeed);
  const NoisySweep sweep = noisy_sweep(4000, random);
  const SobolIndices found = sobol_indices(sweep.outputs, sweep.errors, 3, 1);
  EXPECT_NEAR(found.variance, kOfFirst + kOfChance, 0.6);
  EXPECT_NEAR(*found.noise_share, 1 - kFirstShare, 0.02);
  for (std::size_t p = 0; p < 3; ++p) {
    const double truth = p == 0 ? kFirstShare : 0;
    EXPECT_NEAR(*found.of[p].first, truth, 0.05);
    EXPECT_NEAR(*found.of[p].total, truth, 0.05);
  }
  // Without standard errors chance counts to every total index, and it is known that it does.
  const SobolIndices without = sobol_indices(sweep.outputs, {}, 3, 1);
  EXPECT_FALSE(without.noise_share);
  EXPECT_NEAR(*without.of[1].total, 1 - kFirstShare, 0.05);
  EXPECT_NEAR(*without.of[1].first, 0, 0.05);
}

TEST(SobolIndices, InertParametersIntervalsHoldZeroAtTheirRate) {
  constexpr std::uint64_t kSeed = 9;
  Random random(kSeed);
  int inert = 0, first = 0;
  constexpr int kSweeps = 150;
  for (int s = 0; s < kSweeps; ++s) {
    const NoisySweep sweep = noisy_sweep(100, random);
    const SobolIndices found = sobol_indices(sweep.outputs, sweep.errors, 3, 1, 200);
    inert += found.of[1].total_ci95->low < 0 && 0 < found.of[1].total_ci95->high;
    first +=
        found.of[0].total_ci95->low < kFirstShare && kFirstShare < found.of[0].total_ci95->high;
  }
  EXPECT_GE(inert, 0.88 * kSweeps);
  EXPECT_GE(first, 0.88 * kSweeps);
}

// Some of the studies have one participant with times: no standard error.
TEST(SobolIndices, MissingStandardErrorsComeFromTheOthers) {
  constexpr std::uint64_t kSeed = 10;
  Random random(kSeed);
  NoisySweep sweep = noisy_sweep(2000, random);
  const double all = *sobol_indices(sweep.outputs, sweep.errors, 3, 1).of[2].total;
  for (std::size_t i = 0; i < sweep.errors.size(); i += 3) sweep.errors[i] = kUndefined;
  EXPECT_NEAR(*sobol_indices(sweep.outputs, sweep.errors, 3, 1).of[2].total, all, 0.02);
}

TEST(SobolIndices, BasePointsWithGapsAreLeftOut) {
  constexpr std::uint64_t kSeed = 5;
  Random random(kSeed);
  std::vector<double> outputs;
  for (int base = 0; base < 50; ++base) {
    const double a = random.unit(), b = random.unit(), a2 = random.unit(), b2 = random.unit();
    for (const double y : {a + a2, b + b2, b + a2, a + b2}) outputs.push_back(y);
  }
  const SobolIndices all = sobol_indices(outputs, {}, 2, 1);
  std::vector<double> with_gap = outputs;
  with_gap[4 * 20 + 3] = kUndefined;
  const SobolIndices fewer = sobol_indices(with_gap, {}, 2, 1);
  EXPECT_EQ(all.base_points, 50u);
  EXPECT_EQ(fewer.base_points, 49u);
  EXPECT_EQ(fewer.dropped, 1u);
  with_gap.erase(with_gap.begin() + 80, with_gap.begin() + 84);
  EXPECT_EQ(sobol_indices(with_gap, {}, 2, 1).of[0].total, fewer.of[0].total);
  EXPECT_FALSE(sobol_indices(std::vector<double>(200, 3.0), {}, 2, 1).undefined.empty());
  EXPECT_FALSE(sobol_indices({1, 2, 3, 4}, {}, 2, 1).undefined.empty());
  // A constant that is added changes nothing.
  for (double& y : outputs) y += 1000;
  EXPECT_NEAR(*sobol_indices(outputs, {}, 2, 1).of[0].first, *all.of[0].first, 1e-9);
}

}  // namespace
}  // namespace palpate::analysis
