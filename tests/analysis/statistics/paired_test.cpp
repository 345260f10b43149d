// Undefined values, and properties that hold for all data.

#include "analysis/statistics/paired.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "data/base/random.h"

namespace palpate::analysis {
namespace {

const std::string kPairedFixtures = PALPATE_SOURCE_DIR "/tests/analysis/fixtures/";

Bootstrap bootstrap(const std::vector<double>& differences) {
  constexpr std::uint64_t kSeed = 5;
  Random random(kSeed);
  return bootstrap_mean(differences, random, 999);
}

TEST(Undefined, NoPairsAndOnePair) {
  for (const std::vector<double>& d : {std::vector<double>{}, std::vector<double>{-0.3}}) {
    EXPECT_FALSE(t_test(d).undefined.empty());
    EXPECT_FALSE(t_test(d).t || t_test(d).p || t_test(d).log_ratio_ci95);
    EXPECT_FALSE(effect_size(d).undefined.empty());
    EXPECT_FALSE(effect_size(d).dz || effect_size(d).hedges_gz);
    EXPECT_FALSE(bootstrap(d).undefined.empty());
    EXPECT_FALSE(bootstrap(d).log_ratio_ci95.has_value());
  }
}

TEST(Wilcoxon, OnePairIsDefinedAndSaysNothing) {
  EXPECT_NE(wilcoxon({}).undefined, "");
  EXPECT_FALSE(wilcoxon({}).p.has_value());
  for (const double d : {-0.3, 0.2}) {
    const Wilcoxon one = wilcoxon({d});
    EXPECT_EQ(one.undefined, "");
    EXPECT_EQ(one.n_nonzero, 1U);
    EXPECT_EQ(one.positive_rank_sum, d > 0 ? 1.0 : 0.0);
    EXPECT_EQ(one.p, 1.0) << "each sign has a chance of one half on its side";
  }
  EXPECT_EQ(wilcoxon({0}).undefined, "every difference is zero");
}

TEST(Undefined, TwoPairsHaveDzButNoHedgesG) {
  const EffectSize effect = effect_size({-0.1, -0.3});
  EXPECT_FALSE(effect.undefined.empty());
  EXPECT_NEAR(effect.dz.value(), -std::sqrt(2.0), 1e-12);
  EXPECT_FALSE(effect.hedges_gz.has_value());
  EXPECT_TRUE(t_test({-0.1, -0.3}).undefined.empty());
}

TEST(Undefined, NoVarianceUpToRounding) {
  const std::vector<double> equal{-0.7, -0.7 - 1e-16, -0.7 + 2e-16, -0.7};
  EXPECT_FALSE(t_test(equal).t.has_value());
  EXPECT_TRUE(t_test(equal).sd.has_value());
  EXPECT_FALSE(effect_size(equal).dz.has_value());
  EXPECT_FALSE(bootstrap(equal).log_ratio_ci95.has_value());
  const Wilcoxon ranks = wilcoxon(equal);
  EXPECT_TRUE(ranks.undefined.empty());
  EXPECT_EQ(ranks.positive_rank_sum, 0.0);
  EXPECT_EQ(ranks.p, 2.0 / 16) << "all four negative: 1 of 16 sign patterns on each side";
  EXPECT_TRUE(t_test({-0.7, -0.7 - 1e-9}).t.has_value()) << "small, but variance";
}

TEST(Undefined, WilcoxonOfZerosAlone) {
  const Wilcoxon ranks = wilcoxon({0, 1e-17, -1e-17});
  EXPECT_FALSE(ranks.undefined.empty());
  EXPECT_EQ(ranks.n_nonzero, 0U);
}

TEST(Holm, LeavesOutWhatHasNoP) {
  const auto adjusted = holm({0.01, std::nullopt, 0.04, 0.03, 0.9});
  EXPECT_DOUBLE_EQ(adjusted[0].value(), 0.04);
  EXPECT_FALSE(adjusted[1].has_value());
  EXPECT_DOUBLE_EQ(adjusted[2].value(), 0.09) << "never below a smaller p's";
  EXPECT_DOUBLE_EQ(adjusted[3].value(), 0.09);
  EXPECT_DOUBLE_EQ(adjusted[4].value(), 0.9);
}

TEST(PercentReduction, PositiveWhenRayIsFasterAndEndsSwap) {
  EXPECT_NEAR(percent_reduction(std::log(0.78)), 22, 1e-12);
  const Interval percent = percent_reduction(Interval{std::log(0.5), std::log(1.1)});
  EXPECT_NEAR(percent.low, -10, 1e-12);
  EXPECT_NEAR(percent.high, 50, 1e-12);
}

TEST(Properties, SignsFlipTogether) {
  constexpr std::uint64_t kSeed = 9;
  Random random(kSeed);
  for (int round = 0; round < 50; ++round) {
    std::vector<double> d, flipped;
    for (std::size_t i = 0; i < 3 + random.below(30); ++i) {
      d.push_back(random.normal() - 0.3);
      flipped.push_back(-d.back());
    }
    if (d.size() < 2) continue;
    EXPECT_DOUBLE_EQ(t_test(d).t.value(), -t_test(flipped).t.value());
    EXPECT_DOUBLE_EQ(t_test(d).p.value(), t_test(flipped).p.value());
    EXPECT_DOUBLE_EQ(wilcoxon(d).p.value(), wilcoxon(flipped).p.value());
    const double n = static_cast<double>(d.size());
    EXPECT_DOUBLE_EQ(
        wilcoxon(d).positive_rank_sum.value() + wilcoxon(flipped).positive_rank_sum.value(),
        n * (n + 1) / 2);
  }
}

TEST(Wilcoxon, ApproximationBeyondTheLimitMeetsTheExactP) {
  constexpr std::uint64_t kSeed = 4;
  Random random(kSeed);
  std::vector<double> d;
  while (d.size() < kExactWilcoxon) d.push_back(random.normal() + 0.1);
  const Wilcoxon exact = wilcoxon(d);
  d.push_back(1e-6);  // the lowest rank: changes V least
  const Wilcoxon approximate = wilcoxon(d);
  EXPECT_TRUE(exact.exact);
  EXPECT_FALSE(approximate.exact);
  EXPECT_NEAR(exact.p.value(), approximate.p.value(), 0.05 * exact.p.value());
}

TEST(Bootstrap, HoldsTheMeanAsOftenAsIsSaid) {
  // The tabulated coverage against R's (fixtures/bca_coverage.R), and against a simulation.
  const auto counted = nlohmann::json::parse(std::ifstream(kPairedFixtures + "bca_coverage.json"));
  for (const auto& [pairs, shares] : counted.items()) {
    const auto n = static_cast<std::size_t>(std::stoi(pairs));
    if (n == 20) {
      EXPECT_FALSE(bca_coverage(n).has_value());
      continue;
    }
    EXPECT_NEAR(*bca_coverage(n), shares["bca_normal"].get<double>(), 0.011) << n;
    EXPECT_NEAR(shares["t_normal"].get<double>(), 0.95, 0.01) << n;
  }
  EXPECT_FALSE(bca_coverage(0) || bca_coverage(1));
  constexpr int kStudies = 2000;
  for (const std::uint64_t seed : {31, 32}) {
    for (const std::size_t n : {2U, 5U, 7U, 12U}) {
      Random random(seed, {n});
      int held = 0;
      for (int i = 0; i < kStudies; ++i) {
        std::vector<double> d(n);
        for (double& value : d) value = random.normal();
        const auto ends = bootstrap_mean(d, random, 999).log_ratio_ci95;
        held += ends && ends->low <= 0 && 0 <= ends->high;
      }
      EXPECT_NEAR(held / double{kStudies}, *bca_coverage(n), 0.03) << n << ", seed " << seed;
    }
  }
}

TEST(Bootstrap, RepeatsFromItsSeed) {
  const std::vector<double> d{-0.2, -0.1, 0.05, -0.4, -0.15};
  EXPECT_EQ(bootstrap(d).log_ratio_ci95->low, bootstrap(d).log_ratio_ci95->low);
  constexpr std::uint64_t kSeed = 6;
  Random other(kSeed);
  EXPECT_NE(bootstrap(d).log_ratio_ci95->low, bootstrap_mean(d, other, 999).log_ratio_ci95->low);
}

}  // namespace
}  // namespace palpate::analysis
