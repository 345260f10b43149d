// The mixed model of single trials with crossed factors, against R (fixtures/make_designs.R) and
// against its closed forms.

#include "analysis/statistics/design_model.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "analysis/statistics/mixed_anova.h"
#include "data/base/random.h"
#include "tests/analysis/statistics/cells_of_times.h"

namespace palpate::analysis {
namespace {

using Json = nlohmann::json;

Json designs_fixture() {
  std::ifstream file(PALPATE_SOURCE_DIR "/tests/analysis/fixtures/designs.json");
  return Json::parse(file);
}

DesignedTimes times_of(const Json& study) {
  DesignedTimes out;
  std::size_t conditions = 1;
  for (std::size_t f = 0; f < study["factors"].size(); ++f) {
    out.conditions.push_back({study["factors"][f], study["levels"][f]});
    conditions *= out.conditions.back().levels;
  }
  out.shapes = 2;
  out.groups = study["groups"];
  out.group_of = study["group"].get<std::vector<std::size_t>>();
  const std::size_t people = out.group_of.size();
  std::vector logs(conditions, std::vector(out.shapes, std::vector<std::vector<double>>(people)));
  for (std::size_t i = 0; i < study["y"].size(); ++i)
    logs[study["condition"][i]][study["shape"][i]][study["participant"][i]].push_back(
        study["y"][i]);
  out.cells = cells_of_times(logs);
  return out;
}

bool is_condition(const std::optional<DesignCondition>& found, const Json& expected) {
  return found && found->factor == expected["factor"] && found->level == expected["level"];
}

/// R's degrees of freedom come from numerical derivatives: hence the tolerances.
TEST(DesignModel, AgreesWithLmerTestOnCrossedFactors) {
  std::size_t n = 0;
  const Json all = designs_fixture();
  for (const Json& study : all["designs"]) {
    SCOPED_TRACE(n++);
    const DesignModel model = design_model(times_of(study), WithinContrasts::added);
    ASSERT_EQ(model.undefined, "");
    EXPECT_EQ(model.slopes, study["slopes"].get<std::vector<std::string>>());
    EXPECT_EQ(model.taken_out, study["taken_out"].get<std::vector<std::string>>());
    EXPECT_EQ(model.singular.empty(), !study["singular"].get<bool>());
    EXPECT_EQ(model.effects.size(), study["effects"].size());
    for (const Json& expected : study["effects"]) {
      SCOPED_TRACE(expected["name"].get<std::string>());
      const auto found =
          std::ranges::find(model.effects, expected["name"].get<std::string>(), &GroupEffect::name);
      ASSERT_NE(found, model.effects.end());
      const double f = expected["f"], df = expected["den_df"], p = expected["p"];
      EXPECT_NEAR(*found->f, f, 1e-4 * std::max(1.0, f));
      EXPECT_EQ(*found->num_df, expected["num_df"].get<double>());
      EXPECT_NEAR(*found->den_df, df, 2e-3 * df);
      EXPECT_NEAR(*found->p, p, 1e-3 * p + 1e-6);
    }
    for (const Json& expected : study["means"]) {
      const auto found = std::ranges::find_if(model.means, [&](const ModelMean& one) {
        return one.group == expected["group"] && is_condition(one.condition, expected);
      });
      ASSERT_NE(found, model.means.end());
      EXPECT_NEAR(*found->value.estimate, expected["mean"].get<double>(), 1e-5);
      EXPECT_NEAR(*found->value.se, expected["se"].get<double>(), 1e-5);
      EXPECT_NEAR(*found->value.df_satterthwaite, expected["df"].get<double>(),
                  2e-3 * expected["df"].get<double>());
    }
    for (const Json& expected : study["within"]) {
      const auto found = std::ranges::find_if(model.contrasts, [&](const GroupContrast& one) {
        return one.within && one.group == expected["group"] &&
               is_condition(one.condition, expected);
      });
      ASSERT_NE(found, model.contrasts.end());
      EXPECT_NEAR(*found->estimate, expected["estimate"].get<double>(), 1e-5);
      EXPECT_NEAR(*found->se, expected["se"].get<double>(), 1e-5);
      EXPECT_NEAR(*found->df, expected["df"].get<double>(), 2e-3 * expected["df"].get<double>());
      EXPECT_NEAR(*found->p, expected["p"].get<double>(), 1e-3);
    }
  }
  EXPECT_EQ(n, 20U);
}

/// As many trials in every cell: the tests of effects of two levels are those of participants'
/// means, whatever their variances.
TEST(DesignModel, BalancedFactorsGiveTheAnovaOfMeans) {
  for (const std::uint64_t seed : {3U, 4U}) {
    Random random(seed);
    constexpr std::size_t kPeople = 30;
    DesignedTimes times{ParticipantCells(4, std::vector(1, std::vector<ParticipantCell>(kPeople))),
                        {{"renderer", 2}, {"lag", 2}},
                        1,
                        {},
                        2};
    std::vector<GroupedRow> rows;
    for (std::size_t p = 0; p < kPeople; ++p) {
      times.group_of.push_back(p % 2);
      GroupedRow row{p % 2, {}};
      const double own = random.normal();
      for (std::size_t c = 0; c < 4; ++c) {
        ParticipantCell& cell = times.cells[c][0][p];
        cell.n_used = 12;
        cell.mean_log = own + random.normal();
        cell.sum_of_squares_log = 11 * 0.2;
        row.values.push_back(cell.mean_log);
      }
      rows.push_back(row);
    }
    const DesignModel model = design_model(times, WithinContrasts::added);
    EXPECT_TRUE(model.taken_out.empty());
    const MixedAnova anova = mixed_anova(rows, 2, times.conditions);
    ASSERT_EQ(model.effects.size(), anova.effects.size());
    for (const GroupEffect& expected : anova.effects) {
      const auto found = std::ranges::find(model.effects, expected.name, &GroupEffect::name);
      ASSERT_NE(found, model.effects.end()) << expected.name;
      EXPECT_NEAR(*found->f, *expected.f, 1e-5 * *expected.f + 1e-7) << expected.name;
      EXPECT_NEAR(*found->den_df, 28, 1e-3) << expected.name;
    }
  }
}

DesignedTimes drawn_times(Random& random, std::size_t people, std::size_t trials) {
  std::vector logs(4, std::vector(1, std::vector<std::vector<double>>(people)));
  for (std::size_t p = 0; p < people; ++p) {
    const double own = random.normal();
    for (auto& condition : logs) {
      for (std::size_t i = 0; i < trials; ++i) condition[0][p].push_back(own + random.normal());
    }
  }
  return {
      cells_of_times(logs), {{"renderer", 2}, {"lag", 2}}, 1, std::vector<std::size_t>(people), 1};
}

/// With one trial in every cell no study can tell slopes of all of them from noise; with three
/// people none of more than three effects.
TEST(DesignModel, SlopesBeyondTheDataAreTakenOut) {
  Random random(5);
  const DesignModel once = design_model(drawn_times(random, 12, 1), WithinContrasts::added);
  EXPECT_EQ(once.undefined, "");
  ASSERT_FALSE(once.taken_out.empty());
  EXPECT_EQ(once.taken_out.front(), "renderer:lag");
  const DesignModel three = design_model(drawn_times(random, 3, 5), WithinContrasts::added);
  EXPECT_EQ(three.undefined, "");
  EXPECT_LE(three.slopes.size(), 1U);
  EXPECT_EQ(design_model(drawn_times(random, 1, 5), WithinContrasts::added).undefined,
            "one participant, so no variance between participants");
}

/// Under no effect p is uniform, in a design whose slopes are taken out.
TEST(DesignModel, PIsUniformUnderTheNull) {
  Random random(6);
  int low = 0;
  constexpr int kStudies = 250;
  for (int i = 0; i < kStudies; ++i) {
    const DesignModel model = design_model(drawn_times(random, 10, 4), WithinContrasts::added);
    ASSERT_EQ(model.undefined, "");
    low += *std::ranges::find(model.effects, "renderer", &GroupEffect::name)->p < 0.1;
  }
  EXPECT_NEAR(low, 0.1 * kStudies, 4 * std::sqrt(0.1 * 0.9 * kStudies));
}

}  // namespace
}  // namespace palpate::analysis
