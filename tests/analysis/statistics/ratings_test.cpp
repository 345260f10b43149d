// Ratings: shares, medians and quartiles as R's quantile(), and the tests of participants' means.

#include "analysis/statistics/ratings.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "analysis/statistics/task_analysis.h"

namespace palpate::analysis {
namespace {

TEST(Ratings, SpreadsAndSharesFollowDefinition) {
  // A: 1 2 2 4; B: 3. In R: quantile(c(1, 2, 2, 4)) is 1, 1.75, 2, 2.5, 4.
  const std::vector<Rating> ratings{
      {0, 2, 7.5}, {1, 3, 7.5}, {0, 4, 7.5}, {0, 1, 9.5}, {0, 2, 9.5}};
  const Ratings found = ratings_of(
      ratings, {{1, "soft", 0, 0}, {2, "", 0, 0}, {3, "", 0, 0}, {4, "hard", 0, 0}, {5, "", 0, 0}});
  EXPECT_TRUE(found.labelled);
  ASSERT_EQ(found.participants.size(), 2U);
  const RatingSpread& a = found.participants[0].spread;
  EXPECT_EQ(a.ratings, 4U);
  EXPECT_DOUBLE_EQ(a.lower_quartile, 1.75);
  EXPECT_DOUBLE_EQ(a.median, 2);
  EXPECT_DOUBLE_EQ(a.upper_quartile, 2.5);
  EXPECT_DOUBLE_EQ(a.mean, 2.25);
  EXPECT_EQ(found.spread.ratings, 5U);
  EXPECT_DOUBLE_EQ(found.spread.mean, 2.4);
  // Each participant counts as much: 1/4, 2/4, 1/4 of A and the whole of B.
  const std::vector<double> shares{0.125, 0.25, 0.5, 0.125, 0};
  const std::vector<std::size_t> counts{1, 2, 1, 1, 0};
  ASSERT_EQ(found.steps.size(), shares.size());
  for (std::size_t i = 0; i < shares.size(); ++i) {
    EXPECT_DOUBLE_EQ(found.steps[i].share, shares[i]) << i;
    EXPECT_EQ(found.steps[i].count, counts[i]) << i;
  }
  EXPECT_DOUBLE_EQ(*found.mean.mean, 2.625) << "of the participants' means, 2.25 and 3";
  EXPECT_DOUBLE_EQ(*found.mean.sd, std::sqrt(0.28125));
  ASSERT_TRUE(found.mean.ci95.has_value());
  EXPECT_NEAR(found.mean.ci95->high, 2.625 + 12.706204736 * 0.375, 1e-8);
  ASSERT_EQ(found.levels.size(), 2U);
  EXPECT_EQ(found.levels[0].level, 7.5);
  EXPECT_DOUBLE_EQ(*found.levels[0].mean.mean, 3);
  EXPECT_EQ(found.levels[1].mean.participants, 1U);
  EXPECT_FALSE(found.levels[1].mean.ci95.has_value());
}

TEST(Ratings, FewWholeNumbersAreSteps) {
  const auto steps_of = [](const std::vector<double>& numbers) {
    std::vector<Rating> ratings;
    for (const double number : numbers) ratings.push_back({0, number, std::nullopt});
    return ratings_of(ratings, {}).steps.size();
  };
  EXPECT_EQ(steps_of({1, 5, 3, 3}), 3U);
  EXPECT_EQ(steps_of({0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10}), 11U);
  EXPECT_EQ(steps_of({0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11}), 0U);
  EXPECT_EQ(steps_of({1, 2.5}), 0U);
  EXPECT_EQ(ratings_of({}, {}).spread.ratings, 0U);
  EXPECT_FALSE(ratings_of({}, {}).mean.mean.has_value());
}

/// A study of ratings: numbers[person][stimulus] with each renderer, one rating each.
StudyTable rated(const std::vector<std::vector<double>>& point,
                 const std::vector<std::vector<double>>& ray, std::optional<double> level = {}) {
  StudyTable table;
  const auto add = [&](const std::vector<std::vector<double>>& numbers, const char* renderer) {
    for (std::size_t p = 0; p < numbers.size(); ++p) {
      for (std::size_t s = 0; s < numbers[p].size(); ++s) {
        StudyTrial& trial = table.trials.emplace_back();
        trial.participant = "P" + std::to_string(p);
        trial.task = "rate";
        trial.block_name = "rough";
        trial.renderer = renderer;
        trial.shape = std::vector{"silk", "wool", "steel"}[s];
        trial.number = numbers[p][s];
        trial.level = level;
        trial.answered = true;
      }
    }
  };
  add(point, "point");
  add(ray, "ray");
  return table;
}

// In R: t.test(c(2, 1, 3, 2, 1, 4)), wilcox.test() of the same values: V = 21, p = 0.03125.
TEST(RatedStimuli, AreComparedWithEachOther) {
  const StudyAnalysis analysis = analyze_study(
      rated({{1, 3, 2}, {2, 3, 4}, {1, 4, 2}, {2, 4, 1}, {3, 4, 3}, {1, 5, 2}}, {}), {});
  ASSERT_EQ(analysis.cells.size(), 3U);
  EXPECT_TRUE(analysis.renderers.empty());
  ASSERT_EQ(analysis.conditions.size(), 2U) << "silk with wool and steel, wool with steel";
  const TaskComparison& of_silk = analysis.conditions[0];
  EXPECT_EQ(of_silk.conditions, (std::vector<std::string>{"silk", "wool", "steel"}));
  EXPECT_EQ(of_silk.block_name, "rough");
  EXPECT_FALSE(of_silk.logarithms) << "a scale has no true zero";
  const ConditionDifference& wool = of_silk.comparison.differences.at(0);
  EXPECT_NEAR(wool.mean, 13.0 / 6, 1e-12);
  EXPECT_NEAR(*wool.t_test.t, 4.539796923, 1e-6);
  EXPECT_EQ(*wool.t_test.df, 5);
  EXPECT_NEAR(*wool.t_test.p, 0.00616984348, 1e-8);
  EXPECT_EQ(*wool.wilcoxon.positive_rank_sum, 21);
  EXPECT_NEAR(*wool.wilcoxon.p, 0.03125, 1e-12);
  EXPECT_EQ(analysis.conditions[1].conditions, (std::vector<std::string>{"wool", "steel"}));
  std::vector<std::optional<double>> p;
  for (const TaskComparison& one : analysis.conditions) {
    EXPECT_EQ(one.n_tests, 3U);
    for (const auto& difference : one.comparison.differences) p.push_back(difference.t_test.p);
  }
  EXPECT_EQ(*wool.t_test.p_holm, *holm(p)[0]);
  EXPECT_GT(*wool.t_test.p_holm, *wool.t_test.p) << "adjusted over all three";
}

TEST(RatedStimuli, HaveRenderersComparedOverAllOfABlock) {
  const std::vector<std::vector<double>> point{{1, 3}, {2, 3}, {1, 4}}, ray{{3, 3}, {5, 4}, {4, 4}};
  const StudyAnalysis analysis = analyze_study(rated(point, ray), {});
  ASSERT_EQ(analysis.renderers.size(), 2U);
  for (const TaskComparison& one : analysis.renderers) {
    EXPECT_EQ(one.measure, "rating");
    EXPECT_EQ(one.n_tests, 2U);
    EXPECT_EQ(one.conditions, (std::vector<std::string>{"point", "ray"}));
  }
  const ConditionDifference& silk = analysis.renderers[0].comparison.differences.at(0);
  EXPECT_NEAR(silk.mean, 8.0 / 3, 1e-12);
  EXPECT_NEAR(*silk.t_test.p_holm, 2 * *silk.t_test.p, 1e-12);
}

TEST(RatedStimuli, HaveOtherQuestionsInOtherBlocks) {
  StudyTable table = rated({{1, 3}, {2, 4}, {1, 5}}, {});
  for (StudyTrial& trial : table.trials)
    trial.block_name = trial.shape == "silk" ? "rough" : "warm";
  EXPECT_TRUE(analyze_study(std::move(table), {}).conditions.empty());
}

TEST(RatedLevels, HaveAPowerLawOnlyWithoutLabels) {
  const std::vector<std::vector<double>> numbers{{1, 3}, {2, 3}};
  const StudyAnalysis free = analyze_study(rated(numbers, {}, 4), {});
  EXPECT_TRUE(free.cells[0].magnitude.has_value());
  EXPECT_FALSE(free.cells[0].ratings.has_value());
  StudyTable labelled = rated(numbers, {}, 4);
  for (StudyTrial& trial : labelled.trials) trial.response = *trial.number == 1 ? "soft" : "hard";
  const StudyAnalysis steps = analyze_study(labelled, {});
  EXPECT_FALSE(steps.cells[0].magnitude.has_value());
  ASSERT_TRUE(steps.cells[0].ratings.has_value());
  EXPECT_EQ(steps.cells[0].ratings->steps.at(0).label, "soft");
  // With the protocol its steps count, also those that nobody chose.
  StudyTable stored = rated(numbers, {}, 4);
  for (StudyTrial& trial : stored.trials) trial.protocol_sha256 = "ab";
  stored.procedures["ab"]["rough"].rating_steps = {{1, "soft"}, {2, "middle"}, {3, "hard"}};
  const StudyAnalysis known = analyze_study(std::move(stored), {});
  ASSERT_TRUE(known.cells[0].ratings.has_value());
  EXPECT_EQ(known.cells[0].ratings->steps.size(), 3U);
  EXPECT_FALSE(known.cells[0].magnitude.has_value());
}

}  // namespace
}  // namespace palpate::analysis
