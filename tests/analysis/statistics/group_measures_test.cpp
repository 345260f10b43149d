// Measures of detection, evidence for no difference, and transformed means against values of an
// independent program (fixtures/group/expected.json) and closed forms.

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "analysis/statistics/describe.h"
#include "analysis/statistics/group_detection.h"
#include "analysis/statistics/paired_evidence.h"
#include "analysis/statistics/transformed_means.h"

namespace palpate::analysis {
namespace {

using SmallJson = nlohmann::json;

SmallJson small_expected() {
  return SmallJson::parse(
      std::ifstream(PALPATE_SOURCE_DIR "/tests/analysis/fixtures/group/expected.json"))["small"];
}

TEST(ForcedChoice, SharesAgreeWithTheOracle) {
  for (const auto& [alternatives, want] : small_expected()["d_mafc"].items()) {
    const int m = std::stoi(alternatives);
    EXPECT_NEAR(forced_choice_share(1, m), want["pc_1"].get<double>(), 1e-8);
    EXPECT_NEAR(forced_choice_share(2, m), want["pc_2"].get<double>(), 1e-8);
    EXPECT_NEAR(*forced_choice_d_prime(0.8, m), want["d_of_0.8"].get<double>(), 1e-6);
    EXPECT_NEAR(forced_choice_share(0, m), 1.0 / m, 1e-12);
  }
  EXPECT_LT(*forced_choice_d_prime(0.4, 2), 0);
}

TEST(ForcedChoice, IntervalIsWilsonsOfTheShare) {
  const SmallJson want = small_expected()["d_3afc_18_of_20"];
  const ForcedChoiceDetectability found = forced_choice_detectability(18, 20, 3);
  EXPECT_NEAR(found.share, want["share"].get<double>(), 1e-6);
  EXPECT_NEAR(found.d_prime, want["d"].get<double>(), 1e-6);
  EXPECT_NEAR(found.d_prime_ci95.low, want["ci95"][0].get<double>(), 1e-6);
  EXPECT_NEAR(found.d_prime_ci95.high, want["ci95"][1].get<double>(), 1e-6);
  EXPECT_TRUE(std::isinf(forced_choice_detectability(5, 5, 2).d_prime_ci95.high));
}

TEST(GroupDetection, SensitivityAndCriterionAgreeWithTheOracle) {
  const SmallJson want = small_expected()["d_yes_no"];
  std::vector<DetectionCounts> counts;
  for (std::size_t i = 0; i < want["hits"].size(); ++i)
    counts.push_back({want["trials"], want["hits"][i], want["trials"], want["false_alarms"][i]});
  const GroupFit fit = fit_group(group_detection_data({counts}));
  const GroupCondition& found = fit.conditions[0];
  EXPECT_NEAR(found.first.mean, want["d"].get<double>(), 2e-6);
  EXPECT_NEAR(found.first.sd, want["d_sd"].get<double>(), 2e-6);
  EXPECT_NEAR(found.first.ci95.low, want["d_ci95"][0].get<double>(), 1e-5);
  EXPECT_NEAR(found.first.ci95.high, want["d_ci95"][1].get<double>(), 1e-5);
  EXPECT_NEAR(found.second.mean, want["criterion"].get<double>(), 2e-6);
  EXPECT_NEAR(found.second.ci95.low, want["criterion_ci95"][0].get<double>(), 1e-5);
  EXPECT_NEAR(found.second.ci95.high, want["criterion_ci95"][1].get<double>(), 1e-5);
  EXPECT_NEAR(-found.log_likelihood, want["minus_log_likelihood"].get<double>(), 1e-5);
}

TEST(GroupDetection, PerfectForcedChoiceBoundsFromBelow) {
  const std::vector<ForcedChoiceCounts> perfect(6, {20, 20});
  const GroupFit fit = fit_group(group_forced_choice_data({perfect}, 3));
  EXPECT_TRUE(fit.conditions[0].first.high_open);
  EXPECT_FALSE(fit.conditions[0].first.low_open);
  EXPECT_GT(fit.conditions[0].first.ci95.low, 1.5);
}

TEST(GroupDetection, ManyForcedChoicesGiveTheTrueMean) {
  std::vector<ForcedChoiceCounts> counts;
  for (const double d : {0.8, 1.0, 1.2, 1.4, 1.6})
    counts.push_back({100000, static_cast<int>(std::lround(1e5 * forced_choice_share(d, 4)))});
  const GroupFit fit = fit_group(group_forced_choice_data({counts, counts}, 4));
  EXPECT_NEAR(fit.conditions[0].first.mean, 1.2, 1e-3);
  GroupData data = group_forced_choice_data({counts, counts}, 4);
  EXPECT_NEAR(compare_group(data, fit, GroupCoordinate::first, 0, 1).difference, 0, 1e-6);
}

TEST(BayesFactor, AgreesWithBayesFactorOfR) {
  for (const auto& one : small_expected()["jzs_bf10"]) {
    const double want = one["bf10"];
    EXPECT_NEAR(jzs_bayes_factor(one["t"], one["n"]) / want, 1, 1e-7) << one;
  }
}

TEST(BayesFactor, FewPairsNeverSupportNoDifference) {
  EXPECT_GT(jzs_bayes_factor(0, kLeastForBayes - 1), 1.0 / 3);
  EXPECT_LT(jzs_bayes_factor(0, kLeastForBayes), 1.0 / 3);
}

TEST(EquivalenceTest, AgreesWithTheOracle) {
  const SmallJson want = small_expected()["tost"];
  const std::vector<double> differences = want["differences"];
  const Equivalence found = equivalence(differences, want["bound"]);
  EXPECT_NEAR(*found.p, want["p_low"].get<double>(), 1e-7);
  EXPECT_NEAR(*found.p_low, want["p_low"].get<double>(), 1e-7);
  EXPECT_NEAR(*found.p_high, want["p_high"].get<double>(), 1e-8);
  EXPECT_NEAR(found.ci90->low, want["ci90"][0].get<double>(), 1e-7);
  EXPECT_NEAR(found.ci90->high, want["ci90"][1].get<double>(), 1e-7);
  const TTest test = t_test(differences);
  EXPECT_NEAR(jzs_bayes_factor(*test.t, differences.size()), want["bf10"].get<double>(), 1e-7);
}

TEST(EquivalenceTest, IntervalAndTestAgreeAtTheBound) {
  const std::vector<double> differences{-0.2, 0.1, 0.05, -0.1, 0.3, 0.02};
  const TTest test = t_test(differences);
  const PairedEvidence found = evidence_of(mean(differences), test);
  EXPECT_NEAR(*equivalence(differences, *found.least_bound).p, 0.05, 1e-9);
  EXPECT_EQ(*found.bayes_factor, jzs_bayes_factor(*test.t, 6));
  EXPECT_FALSE(equivalence({0.5}, 1).p);
}

TEST(TransformedMeans, InformationStaysBetweenItsEnds) {
  const TransformedMean found = mean_information({1.9, 2, 2, 1.7, 2.2, -0.1}, 2);
  EXPECT_EQ(found.n, 6U);
  EXPECT_GE(found.ci95->low, 0);
  EXPECT_LE(found.ci95->high, 2);
  // Two values: the mean of the angles, back.
  const double angle = 0.5 * (std::asin(std::sqrt(0.25)) + std::asin(std::sqrt(0.75)));
  EXPECT_NEAR(*mean_information({0.5, 1.5}, 2).mean, 2 * std::pow(std::sin(angle), 2), 1e-12);
  const TransformedMean all = mean_information({2, 2, 2}, 2);
  EXPECT_EQ(all.undefined, "all participants transmit the most possible");
  EXPECT_NEAR(*all.mean, 2, 1e-12);
  EXPECT_FALSE(all.ci95);
}

TEST(TransformedMeans, AreasWithoutBothAnswersAreCounted) {
  const Type2Roc all_correct = type2_roc({{true, 1}, {true, 2}});
  const Type2Roc perfect = type2_roc({{true, 2}, {true, 2}, {false, 1}});
  const Type2Roc chance = type2_roc({{true, 1}, {false, 1}});
  const TransformedMean found = mean_type2_area({all_correct, perfect, chance});
  EXPECT_EQ(found.n, 2U);
  EXPECT_EQ(found.left_out, 1U);
  // (2 + 1/2) / (2 + 1) and 1/2: logits ln 5 and 0.
  EXPECT_NEAR(*found.mean, 1 / (1 + 1 / std::sqrt(5)), 1e-12);
}

}  // namespace
}  // namespace palpate::analysis
