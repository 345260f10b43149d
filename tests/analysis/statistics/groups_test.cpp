// Groups between participants against R (fixtures/make_groups.R) and closed forms.

#include <gtest/gtest.h>

#include <algorithm>
#include <boost/math/distributions/non_central_t.hpp>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <nlohmann/json.hpp>
#include <vector>

#include "analysis/statistics/between_groups.h"
#include "analysis/statistics/describe.h"
#include "analysis/statistics/design_model.h"
#include "analysis/statistics/group_power.h"
#include "analysis/statistics/mixed_anova.h"
#include "data/base/random.h"
#include "tests/analysis/statistics/cells_of_times.h"

namespace palpate::analysis {
namespace {

using GroupsJson = nlohmann::json;

GroupsJson fixture() {
  return GroupsJson::parse(
      std::ifstream(PALPATE_SOURCE_DIR "/tests/analysis/fixtures/groups.json"));
}

std::vector<GroupedRow> rows_of(const GroupsJson& study) {
  std::vector<GroupedRow> rows;
  for (std::size_t i = 0; i < study["group"].size(); ++i)
    rows.push_back({study["group"][i], study["values"][i].get<std::vector<double>>()});
  return rows;
}

std::vector<WithinFactor> within_of(const GroupsJson& study) {
  std::vector<WithinFactor> within{{"renderer", study["renderers"]}};
  if (study["shapes"] > 1) within.push_back({"shape", study["shapes"]});
  return within;
}

void expect_near(const std::optional<double>& found, const GroupsJson& expected) {
  ASSERT_TRUE(found);
  EXPECT_NEAR(*found, expected.get<double>(),
              1e-8 * std::max(1.0, std::fabs(expected.get<double>())));
}

TEST(MixedAnova, AgreesWithAfexOnUnbalancedGroups) {
  std::size_t corrected = 0;
  const GroupsJson all = fixture();
  for (const auto& study : all["cases"]) {
    const MixedAnova anova = mixed_anova(rows_of(study), study["groups"], within_of(study));
    ASSERT_EQ(anova.effects.size(), study["effects"].size());
    for (std::size_t i = 0; i < anova.effects.size(); ++i) {
      const GroupEffect& found = anova.effects[i];
      const auto& expected = study["effects"][i];
      SCOPED_TRACE(found.name);
      EXPECT_EQ(found.name, expected["name"]);
      expect_near(found.num_df, expected["num_df"]);
      expect_near(found.den_df, expected["den_df"]);
      expect_near(found.f, expected["f"]);
      expect_near(found.p, expected["p"]);
      expect_near(found.generalized_eta_squared, expected["ges"]);
      if (!expected.contains("gg_epsilon") || !expected["gg_epsilon"].is_number()) continue;
      expect_near(found.gg_epsilon, expected["gg_epsilon"]);
      expect_near(found.gg_p, expected["gg_p"]);
      ++corrected;
    }
  }
  EXPECT_GT(corrected, 20U);
}

std::vector<GroupedFigures> figures_of(const std::vector<GroupedRow>& rows) {
  std::vector<GroupedFigures> out;
  for (const GroupedRow& row : rows)
    out.push_back(
        {"P" + std::to_string(out.size()), row.group, {row.values.begin(), row.values.end()}});
  return out;
}

TEST(BetweenGroups, AgreesWithEmmeansAndWelch) {
  const GroupsJson all = fixture();
  for (const auto& study : all["cases"]) {
    const BetweenGroups found =
        compare_groups(figures_of(rows_of(study)), study["groups"], within_of(study));
    for (const GroupMarginal& one : found.marginals) {
      if (!one.condition) expect_near(one.mean, study["emmeans"][one.group]);
    }
    const GroupContrast& first = found.contrasts.front();
    expect_near(first.t, study["welch"]["t"]);
    expect_near(first.df, study["welch"]["df"]);
    expect_near(first.p, study["welch"]["p"]);
    expect_near(first.ci95->low, study["welch"]["low"]);
    expect_near(first.ci95->high, study["welch"]["high"]);
  }
}

/// The trials of a model case as cells.
ParticipantCells cells_of(const GroupsJson& study) {
  const std::size_t people = study["group"].size();
  std::vector<std::vector<std::vector<std::vector<double>>>> times(
      2, std::vector(3, std::vector(people, std::vector<double>())));
  for (std::size_t i = 0; i < study["y"].size(); ++i)
    times[study["renderer"][i]][study["shape"][i]][study["participant"][i]].push_back(
        study["y"][i]);
  return cells_of_times(times);
}

/// R's derivatives are numerical: hence the tolerances. On the boundary its degrees of freedom are
/// of another point.
TEST(DesignModel, AgreesWithLmerTest) {
  std::size_t compared = 0;
  const GroupsJson all = fixture();
  for (const auto& study : all["models"]) {
    const DesignModel model = design_model({cells_of(study),
                                            {{"renderer", 2}},
                                            3,
                                            study["group"].get<std::vector<std::size_t>>(),
                                            study["groups"]},
                                           WithinContrasts::left_out);
    ASSERT_EQ(model.undefined, "");
    EXPECT_EQ(model.taken_out.empty(), !study["singular"].get<bool>());
    if (study["singular"]) continue;
    for (const auto& expected : study["effects"]) {
      SCOPED_TRACE(expected["name"].get<std::string>());
      const auto found =
          std::ranges::find(model.effects, expected["name"].get<std::string>(), &GroupEffect::name);
      ASSERT_NE(found, model.effects.end());
      const double f = expected["f"], df = expected["den_df"], p = expected["p"];
      EXPECT_NEAR(*found->f, f, 1e-4 * std::max(1.0, f));
      EXPECT_EQ(*found->num_df, expected["num_df"].get<double>());
      EXPECT_NEAR(*found->den_df, df, 2e-3 * df);
      EXPECT_NEAR(*found->p, p, 1e-3 * p + 1e-6);
      ++compared;
    }
    for (const auto& expected : study["means"]) {
      const auto found = std::ranges::find_if(model.means, [&](const ModelMean& one) {
        return one.group == expected["group"] && one.condition &&
               one.condition->level == expected["renderer"];
      });
      ASSERT_NE(found, model.means.end());
      EXPECT_NEAR(*found->value.estimate, expected["mean"].get<double>(), 1e-5);
      EXPECT_NEAR(*found->value.se, expected["se"].get<double>(), 1e-4);
    }
  }
  EXPECT_GE(compared, 28U);
}

/// With as many trials in every cell, the test of the group is that of participants' means.
TEST(DesignModel, BalancedGroupsGiveTheAnovaOfMeans) {
  for (const std::uint64_t seed : {1U, 2U}) {
    Random random(seed);
    constexpr std::size_t kPeople = 24;
    ParticipantCells cells(2, std::vector(2, std::vector<ParticipantCell>(kPeople)));
    std::vector<std::size_t> group_of;
    std::vector<GroupedRow> rows;
    for (std::size_t p = 0; p < kPeople; ++p) {
      group_of.push_back(p % 2);
      const double own = random.normal();
      const double slope = random.normal();
      GroupedRow row{p % 2, {}};
      for (std::size_t r = 0; r < 2; ++r) {
        double sum = 0;
        for (std::size_t s = 0; s < 2; ++s) {
          ParticipantCell& cell = cells[r][s][p];
          cell.n_used = cell.n_trials = 20;
          cell.mean_log = own + (r == 1 ? slope : 0) + 0.1 * random.normal();
          cell.sum_of_squares_log = 19 * 0.2;
          sum += cell.mean_log;
        }
        row.values.push_back(sum / 2);
      }
      rows.push_back(row);
    }
    const DesignModel model =
        design_model({cells, {{"renderer", 2}}, 2, group_of, 2}, WithinContrasts::left_out);
    const MixedAnova anova = mixed_anova(rows, 2, {{"renderer", 2}});
    for (const char* const name : {"group", "renderer", "group:renderer"}) {
      const auto found = std::ranges::find(model.effects, name, &GroupEffect::name);
      const auto expected = std::ranges::find(anova.effects, name, &GroupEffect::name);
      EXPECT_NEAR(*found->f, *expected->f, 1e-4 * *expected->f + 1e-6) << name;
      EXPECT_NEAR(*found->den_df, 22, 1e-3) << name;
    }
  }
}

TEST(DesignModel, EmptyCellsSayWhy) {
  ParticipantCells cells(2, std::vector(2, std::vector<ParticipantCell>(4)));
  for (std::size_t r = 0; r < 2; ++r) {
    for (std::size_t s = 0; s < 2; ++s) {
      for (std::size_t p = 0; p < 4; ++p) {
        if (r == 1 && s == 1 && p % 2 == 1) continue;
        cells[r][s][p].n_used = 3;
        cells[r][s][p].mean_log = static_cast<double>(p + r + s);
        cells[r][s][p].sum_of_squares_log = 1;
      }
    }
  }
  EXPECT_EQ(design_model({cells, {{"renderer", 2}}, 2, {0, 1, 0, 1}, 2}, WithinContrasts::left_out)
                .undefined,
            "a cell of the design has no time");
}

std::vector<GroupedRow> drawn(Random& random, std::vector<std::size_t> sizes, std::size_t cells) {
  std::vector<GroupedRow> rows;
  for (std::size_t group = 0; group < sizes.size(); ++group) {
    for (std::size_t i = 0; i < sizes[group]; ++i) {
      GroupedRow row{group, {}};
      const double own = random.normal();
      for (std::size_t c = 0; c < cells; ++c) row.values.push_back(own + random.normal());
      rows.push_back(row);
    }
  }
  return rows;
}

const GroupEffect& effect(const MixedAnova& anova, const std::string& name) {
  return *std::ranges::find(anova.effects, name, &GroupEffect::name);
}

/// With two conditions the interaction is the pooled t test of participants' differences.
TEST(MixedAnova, InteractionIsSquaredT) {
  for (const std::uint64_t seed : {1U, 2U}) {
    Random random(seed);
    const std::vector<GroupedRow> rows = drawn(random, {9, 9}, 2);
    double mean[2] = {}, squares = 0;
    for (const GroupedRow& row : rows) mean[row.group] += (row.values[1] - row.values[0]) / 9;
    for (const GroupedRow& row : rows)
      squares += std::pow(row.values[1] - row.values[0] - mean[row.group], 2);
    const double t = (mean[1] - mean[0]) / std::sqrt(squares / 16 * 2 / 9);
    const MixedAnova anova = mixed_anova(rows, 2, {{"renderer", 2}});
    EXPECT_NEAR(*effect(anova, "group:renderer").f, t * t, 1e-10);
    EXPECT_EQ(*effect(anova, "group:renderer").den_df, 16);
  }
}

/// Groups that were drawn by lot differ by chance alone.
TEST(MixedAnova, PermutedGroupsHaveUniformP) {
  constexpr int kStudies = 500;
  for (const std::uint64_t seed : {3U, 4U}) {
    Random random(seed);
    for (const char* const name : {"group", "group:renderer"}) {
      std::vector<double> p;
      for (int i = 0; i < kStudies; ++i)
        p.push_back(*effect(mixed_anova(drawn(random, {7, 5}, 2), 2, {{"renderer", 2}}), name).p);
      std::ranges::sort(p);
      double distance = 0;
      for (int i = 0; i < kStudies; ++i) {
        const double at = p[static_cast<std::size_t>(i)] * kStudies;
        distance = std::max({distance, std::fabs(at - i), std::fabs(at - i - 1)});
      }
      EXPECT_LT(distance / std::sqrt(kStudies), 1.95) << name;  // Kolmogorov: p = 0.001
    }
  }
}

TEST(BetweenGroups, IntervalsCoverTheTruth) {
  constexpr int kStudies = 500;
  for (const std::uint64_t seed : {5U, 6U}) {
    Random random(seed);
    int covered = 0;
    for (int i = 0; i < kStudies; ++i) {
      std::vector<GroupedRow> rows = drawn(random, {8, 12}, 2);
      for (GroupedRow& row : rows) row.values[1] += row.group == 1 ? 0.5 : 0;
      const BetweenGroups found = compare_groups(figures_of(rows), 2, {{"renderer", 2}});
      const auto contrast = std::ranges::find(found.contrasts, true, &GroupContrast::of_difference);
      covered += contrast->ci95->low <= 0.5 && 0.5 <= contrast->ci95->high;
    }
    EXPECT_GE(covered, 0.92 * kStudies);
    EXPECT_LE(covered, 0.97 * kStudies + 5);
  }
}

/// The test of two groups is a t test of participants' means, whose power has a closed form.
TEST(GroupPower, EqualsNoncentralT) {
  StudyModel model;
  model.shapes = {"cone", "cube"};
  model.log_ratios = {0.1, 0};
  model.intercept_sd = 0.3;
  model.gain_sd = 0.2;
  model.residual_sd = 0.5;
  constexpr std::size_t kTrials = 40, kPeople = 12;
  const double noise = model.residual_sd * model.residual_sd / kTrials;
  // Of the mean over renderers, and of their difference.
  const double sd_mean = std::sqrt(0.3 * 0.3 + 0.2 * 0.2 / 4 + noise / 2);
  const double sd_gain = std::sqrt(0.2 * 0.2 + 2 * noise);
  const auto expected = [&](double effect, double sd) {
    const double df = 2 * kPeople - 2, shift = effect / (sd * std::sqrt(2.0 / kPeople));
    const double critical = quantile(boost::math::students_t(df), 0.975);
    const boost::math::non_central_t distribution(df, shift);
    return cdf(complement(distribution, critical)) + cdf(distribution, -critical);
  };
  for (const std::uint64_t seed : {1U, 2U}) {
    PowerSettings settings;
    settings.studies = 4000;
    settings.seed = seed;
    const GroupPower found = simulate_group_power(model, {2, 0.3, 0.2}, kPeople, kTrials, settings);
    EXPECT_NEAR(found.share(found.group), expected(0.3, sd_mean), 0.03);
    EXPECT_NEAR(found.share(found.interaction), expected(0.2, sd_gain), 0.03);
    const GroupPower none = simulate_group_power(model, {3, 0, 0}, kPeople, kTrials, settings);
    EXPECT_NEAR(none.share(none.group), 0.05, 0.015);
    EXPECT_NEAR(none.share(none.interaction), 0.05, 0.015);
  }
}

TEST(GroupPower, PlansTheFewestThatReachThePower) {
  StudyModel model;
  model.shapes = {"cone"};
  model.log_ratios = {0};
  model.intercept_sd = 0.3;
  model.residual_sd = 0.5;
  PowerSettings settings;
  settings.studies = 500;
  const GroupEffects effects{2, 0.4, 0};
  const std::vector<GroupPower> points =
      plan_groups(model, effects, 2, 100, 40, 0.8, settings, [](std::size_t) {});
  const auto first = std::ranges::find_if(
      points, [&](const GroupPower& one) { return reaches(one, effects, 0.8); });
  ASSERT_NE(first, points.end());
  ASSERT_NE(first, points.begin());
  EXPECT_EQ(std::prev(first)->participants + 1, first->participants);
  EXPECT_FALSE(
      reaches(plan_groups(model, effects, 2, 3, 40, 0.8, settings, [](std::size_t) {}).back(),
              effects, 0.8));
}

TEST(BetweenGroups, SmallGroupsSayWhy) {
  const std::vector<GroupedRow> rows{{0, {1, 2}}, {0, {2, 4}}, {1, {3, 3}}};
  const BetweenGroups found = compare_groups(figures_of(rows), 2, {{"renderer", 2}});
  EXPECT_TRUE(found.anova.undefined.empty());
  EXPECT_EQ(found.contrasts.front().undefined, "a group has one participant, so no variance");
  EXPECT_EQ(mixed_anova({{0, {1, 2}}, {1, {2, 4}}}, 2, {{"renderer", 2}}).undefined,
            "one participant in each group, so no variance within groups");
  EXPECT_EQ(mixed_anova({{0, {1, 2}}}, 2, {{"renderer", 2}}).undefined,
            "a group has no participant with a value in every cell");
}

TEST(BetweenGroups, GapsAreLeftOut) {
  std::vector<GroupedFigures> figures;
  for (std::size_t i = 0; i < 8; ++i)
    figures.push_back({"P" + std::to_string(i), i % 2, {double(i), double(i * i)}});
  figures[3].values[1] = std::nullopt;
  const BetweenGroups found = compare_groups(figures, 2, {{"renderer", 2}});
  EXPECT_EQ(found.dropped, std::vector<std::size_t>{3});
  EXPECT_EQ(found.anova.n, (std::vector<std::size_t>{4, 3}));
}

}  // namespace
}  // namespace palpate::analysis
