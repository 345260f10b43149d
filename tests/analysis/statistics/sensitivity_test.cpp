#include "analysis/statistics/sensitivity.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "stimuli/random.h"

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

TEST(RankCorrelations, PartialOnesAreThoseOfTheResiduals) {
  stimuli::Random random(3);
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
TEST(RankCorrelations, IntervalsHoldTheTruthAsOftenAsTheySay) {
  stimuli::Random random(11);
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

TEST(RankCorrelations, SaysWhyThereIsNone) {
  const std::vector<double> varies{1, 2, 3, 4, 5};
  EXPECT_FALSE(rank_correlations({varies}, {1, 1, 1, 1, 1})[0].undefined.empty());
  EXPECT_FALSE(rank_correlations({varies, {2, 2, 2, 2, 2}}, varies)[1].undefined.empty());
  EXPECT_FALSE(rank_correlations({varies}, {1, 2, kUndefined, kUndefined, 3})[0].undefined.empty());
  const auto twins = rank_correlations({varies, varies}, {2, 1, 4, 3, 5});
  EXPECT_TRUE(twins[0].spearman);
  EXPECT_FALSE(twins[0].partial);  // nothing tells them apart
}

TEST(SobolIndices, BasePointsWithGapsAreLeftOut) {
  stimuli::Random random(5);
  std::vector<double> outputs;
  for (int base = 0; base < 50; ++base) {
    const double a = random.unit(), b = random.unit(), a2 = random.unit(), b2 = random.unit();
    for (const double y : {a + a2, b + b2, b + a2, a + b2}) outputs.push_back(y);
  }
  const SobolIndices all = sobol_indices(outputs, 2, 1);
  std::vector<double> with_gap = outputs;
  with_gap[4 * 20 + 3] = kUndefined;
  const SobolIndices fewer = sobol_indices(with_gap, 2, 1);
  EXPECT_EQ(all.base_points, 50u);
  EXPECT_EQ(fewer.base_points, 49u);
  EXPECT_EQ(fewer.dropped, 1u);
  with_gap.erase(with_gap.begin() + 80, with_gap.begin() + 84);
  EXPECT_EQ(sobol_indices(with_gap, 2, 1).of[0].total, fewer.of[0].total);
  EXPECT_FALSE(sobol_indices(std::vector<double>(200, 3.0), 2, 1).undefined.empty());
  EXPECT_FALSE(sobol_indices({1, 2, 3, 4}, 2, 1).undefined.empty());
  // A constant that is added changes nothing.
  for (double& y : outputs) y += 1000;
  EXPECT_NEAR(*sobol_indices(outputs, 2, 1).of[0].first, *all.of[0].first, 1e-9);
}

}  // namespace
}  // namespace palpate::analysis
