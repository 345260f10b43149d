// How often intervals hold the truth: what is counted, and that it is the same however it is run.

#include "analysis/statistics/interval_coverage.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "analysis/report/coverage_report.h"
#include "analysis/statistics/sensitivity.h"

namespace palpate::analysis {
namespace {

TEST(IntervalCoverage, DesignsCoverEveryProcedureWithAnalyzesModels) {
  const auto designs = coverage_designs({0, 0.05});
  std::set<std::string> tasks;
  std::set<std::size_t> kinds;
  for (const CoverageDesign& one : designs) {
    tasks.insert(one.task);
    for (const auto& track : one.tracks) kinds.insert(track.index());
    EXPECT_TRUE(one.model.lapse.free);
    EXPECT_EQ(one.model.lapse.most, kMostLapse);
    const double guess = one.truth.parameters.guess;
    EXPECT_TRUE(one.model.guess_is_lapse ? guess == one.truth.parameters.lapse
                                         : one.model.guess.free || guess == one.model.guess.value);
    EXPECT_TRUE(one.truth.parameters.lapse == 0 || one.truth.parameters.lapse == 0.05);
  }
  EXPECT_EQ(tasks.size(), 3U);
  EXPECT_EQ(kinds, (std::set<std::size_t>{0, 1, 2, 3})) << "constant, staircase, QUEST+, limits";
}

TEST(IntervalCoverage, IsTheSameForOneAndThreeJobs) {
  CoverageSettings settings;
  settings.lapses = {0.05};
  settings.studies = 4;
  settings.simulations = 9;
  double share = 0;
  settings.progress = [&](double done) { share = done; };
  const auto one = interval_coverage(settings);
  EXPECT_EQ(share, 1);
  settings.jobs = 3;
  const auto three = interval_coverage(settings);
  ASSERT_EQ(one.size(), coverage_designs({0.05}).size());
  EXPECT_EQ(coverage_json(one, settings, {}), coverage_json(three, settings, {}));
  settings.seed = 2;
  EXPECT_NE(coverage_json(interval_coverage(settings), settings, {}),
            coverage_json(one, settings, {}));
  for (const CoverageResult& result : one) {
    EXPECT_EQ(result.studies + result.unfitted, 4U);
    EXPECT_GT(result.mean_trials, 60);
    EXPECT_LE(result.likelihood.threshold, result.studies);
    EXPECT_EQ(result.bayes_studies, result.design.model.guess.free ? 1U : result.studies);
  }
}

TEST(IntervalCoverage, TextAndJsonSayTheCounts) {
  CoverageResult result;
  result.design = coverage_designs({0.02})[0];
  result.studies = 50;
  result.likelihood = {48, 45, 50};
  result.bayes_studies = 10;
  result.bayes = {9, 8, 7};
  result.called_bad = 2;
  result.open = 1;
  CoverageSettings settings;
  settings.studies = 50;
  settings.seed = 77;
  const std::string text = coverage_text({result}, settings);
  EXPECT_NE(text.find("50 studies per line, seed 77"), std::string::npos);
  EXPECT_NE(text.find("0.02    96.0   90.0  100.0   90.0   80.0   70.0      4.0   2.0\n"),
            std::string::npos)
      << text;
  const auto json = nlohmann::json::parse(coverage_json({result}, settings, {}));
  const auto& design = json["designs"][0];
  EXPECT_EQ(json["seed"], 77);
  EXPECT_EQ(json["n_studies"], 50);
  EXPECT_EQ(design["likelihood"]["slope"]["held"], 45);
  EXPECT_EQ(design["bayes"]["lapse"]["held"], 7);
  EXPECT_EQ(design["n_with_posterior"], 10);
  EXPECT_EQ(design["n_called_bad"], 2);
  EXPECT_EQ(design["likelihood"]["slope"]["ci95"][0], wilson_interval(45, 50).low);
}

}  // namespace
}  // namespace palpate::analysis
