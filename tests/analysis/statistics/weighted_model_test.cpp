// The mixed model of figures with standard errors, against R's metafor
// (fixtures/make_weighted.R) and the analysis of variance.

#include "analysis/statistics/weighted_model.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "data/base/random.h"

namespace palpate::analysis {
namespace {

using Json = nlohmann::json;

TEST(WeightedModel, AgreesWithMetafor) {
  std::ifstream file(PALPATE_SOURCE_DIR "/tests/analysis/fixtures/weighted.json");
  const Json all = Json::parse(file);
  std::size_t number = 0;
  for (const Json& study : all["studies"]) {
    SCOPED_TRACE(number++);
    std::vector<WeightedFigure> figures;
    for (std::size_t i = 0; i < study["value"].size(); ++i)
      figures.push_back({study["participant"][i], study["group"][i], study["cell"][i],
                         study["value"][i], study["se"][i]});
    const std::size_t groups = study["groups"], cells = study["cells"];
    const DesignModel model =
        weighted_model(figures, groups, {{"renderer", cells}}, WithinContrasts::added);
    ASSERT_EQ(model.undefined, "");
    EXPECT_NEAR(*model.participant_sd * *model.participant_sd, study["participant_variance"], 1e-5);
    EXPECT_NEAR(*model.common_sd * *model.common_sd, study["common_variance"], 1e-5);
    std::size_t found = 0;
    for (const ModelMean& one : model.means) {
      if (cells > 1 && !one.condition) continue;
      const std::size_t mean = one.group * cells + (one.condition ? one.condition->level : 0);
      EXPECT_NEAR(*one.value.estimate, study["means"][mean], 1e-4);
      EXPECT_NEAR(*one.value.se, study["mean_se"][mean], 1e-4);
      ++found;
    }
    EXPECT_EQ(found, groups * cells);
  }
}

/// With equal errors and all cells the weights are equal: F is that of the analysis of variance.
TEST(WeightedModel, EqualErrorsGiveTheAnalysisOfVariance) {
  Random random(3);
  std::vector<WeightedFigure> figures;
  std::vector<GroupedRow> rows;
  for (std::size_t p = 0; p < 18; ++p) {
    const double own = random.normal();
    GroupedRow& row = rows.emplace_back(GroupedRow{p % 2, {}});
    for (std::size_t c = 0; c < 2; ++c) {
      row.values.push_back(5 + own + 0.6 * static_cast<double>(c) + random.normal());
      figures.push_back({p, p % 2, c, row.values.back(), 0.1});
    }
  }
  const std::vector<WithinFactor> within{{"renderer", 2}};
  const DesignModel model = weighted_model(figures, 2, within, WithinContrasts::added);
  const MixedAnova anova = mixed_anova(rows, 2, within);
  ASSERT_EQ(model.effects.size(), anova.effects.size());
  for (const GroupEffect& expected : anova.effects) {
    const auto found = std::ranges::find(model.effects, expected.name, &GroupEffect::name);
    ASSERT_NE(found, model.effects.end());
    EXPECT_NEAR(*found->f, *expected.f, 1e-4 * *expected.f) << expected.name;
    EXPECT_EQ(*found->den_df, *expected.den_df);
    EXPECT_NEAR(*found->p, *expected.p, 1e-4);
  }
}

TEST(WeightedModel, HoldsItsLevelWithoutEffects) {
  constexpr int kStudies = 400;
  int found = 0;
  for (int study = 0; study < kStudies; ++study) {
    Random random(11, {static_cast<std::uint64_t>(study)});
    std::vector<WeightedFigure> figures;
    for (std::size_t p = 0; p < 12; ++p) {
      const double own = 0.3 * random.normal();
      for (std::size_t c = 0; c < 2; ++c) {
        const double error = 0.1 + 0.3 * random.unit();
        figures.push_back({p, p % 2, c, own + std::hypot(error, 0.1) * random.normal(), error});
      }
    }
    const DesignModel model = weighted_model(figures, 2, {{"renderer", 2}}, WithinContrasts::added);
    for (const GroupEffect& effect : model.effects) found += *effect.p < 0.1 ? 1 : 0;
  }
  const double share = found / (3.0 * kStudies);
  EXPECT_GT(share, 0.06);
  EXPECT_LT(share, 0.14);
}

TEST(WeightedModel, SaysWhyThereIsNone) {
  const std::vector<WithinFactor> within{{"renderer", 2}};
  EXPECT_NE(
      weighted_model({{0, 0, 0, 1, 0.1}, {1, 0, 0, 2, 0.1}}, 1, within, WithinContrasts::added)
          .undefined.find("no figure"),
      std::string::npos);
  EXPECT_NE(
      weighted_model({{0, 0, 0, 1, 0.1}, {0, 0, 1, 2, 0.1}}, 1, within, WithinContrasts::added)
          .undefined.find("one participant"),
      std::string::npos);
}

}  // namespace
}  // namespace palpate::analysis
