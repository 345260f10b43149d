// Tables of inferential statistics print the values of the analysis.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "analysis/input/trials.h"
#include "analysis/report/tables.h"
#include "analysis/statistics/analysis.h"
#include "analysis/text.h"
#include "data/base/random.h"

namespace palpate::analysis {
namespace {

/// Twelve participants with random intercepts and gains; the sd of gains is proportional to the
/// index of the renderer.
Analysis varied_study(const std::vector<std::string>& renderers) {
  TrialTableBuilder builder;
  constexpr std::uint64_t kSeed = 23;
  Random random(kSeed);
  for (int p = 0; p < 12; ++p) {
    const std::string name = std::to_string(p);
    const double intercept = 0.4 * random.normal();
    int trial = 0;
    for (std::size_t r = 0; r < renderers.size(); ++r) {
      const double gain = 0.15 * static_cast<double>(r) * random.normal();
      for (int i = 0; i < 24; ++i) {
        StudyTrial raw;
        raw.participant = name;
        raw.renderer = renderers[r];
        raw.shape = raw.response = i % 2 == 0 ? "cone" : "cube";
        raw.trial = ++trial;
        raw.correct = true;
        raw.response_time = std::exp(2 + intercept + gain + 0.25 * random.normal());
        builder.add(raw);
      }
    }
  }
  return analyze(builder.finish({}), {}, "test");
}

TEST(MixedModelTable, TellsEveryStandardDeviationOfTheFit) {
  for (const std::vector<std::string>& renderers :
       {std::vector<std::string>{"point", "ray"}, {"point", "ray", "plane"}}) {
    const Analysis analysis = varied_study(renderers);
    const MixedModel& model = analysis.mixed_model;
    ASSERT_EQ(model.undefined, "");
    ASSERT_EQ(model.random_sds.size(), renderers.size());
    const Table table = mixed_model_table(analysis);
    const auto note = std::find_if(table.notes.begin(), table.notes.end(), [](const auto& text) {
      return text.find("tandard deviations") != std::string::npos;
    });
    ASSERT_NE(note, table.notes.end());
    std::string rest = *note;
    // In this order, each after its name.
    const auto take = [&](const std::string& words, double value, int digits) {
      const std::string expected = words + " " + fixed(value, digits);
      const std::size_t at = rest.find(expected);
      ASSERT_NE(at, std::string::npos) << expected << " in: " << *note;
      rest = rest.substr(at + expected.size());
    };
    take("intercepts", model.random_sds[0], 3);
    for (std::size_t r = 1; r < renderers.size(); ++r)
      take(analysis.table.renderers[r], model.random_sds[r], 3);
    if (renderers.size() == 2) take("correlation", model.random_correlations[0].value(), 2);
    EXPECT_EQ(note->find("correlation") != std::string::npos, renderers.size() == 2) << *note;
    take("residual", model.residual_sd.value(), 3);
    take("(REML)", model.log_likelihood_reml.value(), 3);
    EXPECT_NE(rest.find(std::to_string(12 * 24 * renderers.size()) + " trials"), std::string::npos);
  }
}

}  // namespace
}  // namespace palpate::analysis
