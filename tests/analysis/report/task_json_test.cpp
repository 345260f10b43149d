// Every number of an analysis of tasks stands in its JSON under its own name.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <nlohmann/json.hpp>

#include "analysis/report/report.h"
#include "analysis/statistics/paired_evidence.h"
#include "analysis/statistics/task_analysis.h"
#include "tests/analysis/report/task_report_fixture.h"

namespace palpate::analysis {
namespace {

using testing::difference_of;
using testing::full_function;
using testing::named_cell;
using testing::track_of;
using Expected = nlohmann::json;

Expected json_of(const StudyAnalysis& analysis) {
  return Expected::parse(task_report_json(analysis, "1.2"));
}

Expected json_of_cell(TaskCell cell) {
  StudyAnalysis analysis;
  analysis.cells.push_back(std::move(cell));
  return json_of(analysis)["cells"][0];
}

TEST(TaskJson, HeadCountsWhatWasRead) {
  StudyAnalysis analysis;
  analysis.table.source = "study.csv";
  analysis.table.trials.resize(3);
  analysis.table.n_practice = 2;
  analysis.table.title = "Which ball?";
  analysis.table.warnings = {"one", "two"};
  Expected expected = Expected::parse(R"({"version": 1, "simulated": false, "source": "study.csv",
      "title": "Which ball?", "warnings": ["one", "two"], "group_results": [],
      "program_version": "1.2", "n_trials": 3, "n_practice": 2, "cells": [],
      "renderer_comparisons": [], "condition_comparisons": [], "group_model": [], "group_comparisons": []})");
  EXPECT_EQ(json_of(analysis), expected);
  analysis.table.simulated = true;
  expected["simulated"] = true;
  EXPECT_EQ(json_of(analysis), expected);
  const std::string text = task_report_json(analysis, "1.2");
  EXPECT_EQ(text.substr(0, 17), "{\n \"version\": 1,\n");
  EXPECT_EQ(text.back(), '\n');
}

TEST(TaskJson, AFunctionWithEverything) {
  TaskCell cell = named_cell("compare", "stiff", "ball", "ray");
  cell.trials = 30;
  cell.answered = 22;
  cell.judged = 21;
  cell.correct = 20;
  cell.standard_level = 300;
  cell.forced_choice = true;
  cell.intervals = 3;
  cell.level_unit = "N/m";
  cell.expected_easier = protocols::Easier::lower;
  cell.functions = {full_function("Anna")};
  const Expected expected = Expected::parse(R"({
    "task": "compare", "block_name": "stiff", "shape": "ball", "renderer": "ray", "n_trials": 30,
    "n_answered": 22, "n_judged": 21, "n_correct": 20, "standard_level": 300.0,
    "level_unit": "N/m", "expected_easier": "lower", "forced_choice": true, "same_different": false, "n_intervals": 3,
    "psychometric_functions": [{
      "participant_id": "Anna",
      "levels": [{"level": 200.0, "trials": 10, "successes": 1},
                 {"level": 400.0, "trials": 12, "successes": 9}],
      "fit": {"status": "ok", "function": "normal", "scale": "db",
              "easier": "higher", "reversed": false, "guess_is_lapse": false,
              "threshold": 301.25, "threshold_ci95": [281.5, 322.75],
              "slope": 2.5, "slope_ci95": [1.25, 4.75], "determined": true, "slope_at_bound": false,
              "guess": 0.125, "guess_ci95": [0.0625, 0.25],
              "lapse": 0.03126, "lapse_ci95": [0.00004, 0.06], "log_likelihood": -7.25,
              "deviance": 3.5, "deviance_p": 0.0416, "pse": 303.5, "pse_ci95": [2.0, 4.0],
              "jnd": 21.75, "jnd_ci95": [1.5, 33.25], "weber_fraction": 0.0625,
              "weber_fraction_ci95": [0.03125, 0.09375]},
      "bayes": {"status": "ok", "threshold": 305.5, "threshold_ci95": [285.5, 325.5],
                "slope": 2.75, "slope_ci95": [1.75, 5.25], "guess": 0.1875,
                "guess_ci95": [0.09375, 0.28125], "lapse": 0.015625,
                "lapse_ci95": [0.0078125, 0.046875]},
      "detectability": {"status": "ok", "d_prime": 1.625, "d_prime_ci95": [1.125, 2.125],
                        "criterion": -0.375, "criterion_ci95": [-0.625, -0.25]}}],
    "confidence": {"status": "undefined", "reason": "nobody was asked"}})");
  Expected found = json_of_cell(cell);
  // 9 of 12 in a forced choice of three.
  Expected& level = found["psychometric_functions"][0]["levels"][1];
  const ForcedChoiceDetectability detected = forced_choice_detectability(9, 12, 3);
  EXPECT_EQ(level["d_prime"], detected.d_prime);
  EXPECT_EQ(level["d_prime_ci95"],
            (Expected{detected.d_prime_ci95.low, detected.d_prime_ci95.high}));
  for (Expected& one : found["psychometric_functions"][0]["levels"]) {
    one.erase("d_prime");
    one.erase("d_prime_ci95");
  }
  EXPECT_EQ(found, expected);
}

TEST(TaskJson, UndefinedValuesSayWhyInfiniteEndsAreNull) {
  TaskCell cell = named_cell("detect", "", "", "");
  cell.functions = {full_function("B")};
  ParticipantFunction& one = cell.functions[0];
  one.counts.clear();
  one.fit.threshold_ci95.low = -std::numeric_limits<double>::infinity();
  one.figures = {};
  one.goodness.p.reset();
  one.determined = false;
  one.fit.slope_at_bound = true;
  one.reversed = true;
  one.model.guess_is_lapse = true;
  one.model.function.easier = protocols::Easier::lower;
  one.posterior.undefined = "no grid";
  one.detectability = {};
  one.detectability.undefined = "no noise";
  Expected found = json_of_cell(cell);
  EXPECT_EQ(found["n_intervals"], Expected());
  EXPECT_EQ(found["standard_level"], Expected());
  EXPECT_EQ(found["level_unit"], Expected());
  EXPECT_EQ(found["expected_easier"], Expected());
  found = found["psychometric_functions"][0];
  const Expected ends = {nullptr, 322.75};
  EXPECT_EQ(found["fit"]["threshold_ci95"], ends);
  EXPECT_EQ(found["fit"]["jnd"], Expected());
  EXPECT_EQ(found["fit"]["jnd_ci95"], Expected());
  EXPECT_EQ(found["fit"]["deviance_p"], Expected());
  EXPECT_EQ(found["fit"]["determined"], false);
  EXPECT_EQ(found["fit"]["slope_at_bound"], true);
  EXPECT_EQ(found["fit"]["reversed"], true);
  EXPECT_EQ(found["fit"]["guess_is_lapse"], true);
  EXPECT_EQ(found["fit"]["easier"], "lower");
  EXPECT_EQ(found["bayes"], Expected::parse(R"({"status": "undefined", "reason": "no grid"})"));
  EXPECT_EQ(found["detectability"],
            Expected::parse(R"({"status": "undefined", "reason": "no noise"})"));
  one.fit.undefined = "one level";
  EXPECT_EQ(json_of_cell(cell)["psychometric_functions"][0]["fit"],
            Expected::parse(R"({"status": "undefined", "reason": "one level"})"));
}

TEST(TaskJson, TracksCountTheirTrialsFromOne) {
  TaskCell cell = named_cell("compare", "", "", "");
  cell.functions.resize(1);
  const protocols::Estimate estimate{2.5, 0.25, 7.5, 0.5, 0.04, 40, 11, 3};
  cell.functions[0].tracks = {track_of("7", protocols::Staircase{}, estimate)};
  TrackProcedure& procedure = *cell.functions[0].tracks[0].procedure;
  procedure.target = 0.75;
  procedure.fitted_level = 2.25;
  const auto tracks = [&] { return json_of_cell(cell)["psychometric_functions"][0]["tracks"]; };
  Expected expected = Expected::parse(R"([{"track": "7", "levels": [4.0, 2.0, 3.0],
    "successes": [true, false, true], "reversal_trials": [2],
    "procedure": {"kind": "staircase", "threshold": 2.5, "threshold_scale_sd": 0.25, "slope": 7.5,
      "guess": 0.5, "lapse": 0.04, "n_trials": 40, "n_reversals": 11, "n_at_limit": 3,
      "converges_at": 0.75, "fit_level_there": 2.25}}])");
  EXPECT_EQ(tracks(), expected);
  protocols::QuestPlus quest;
  quest.function = {protocols::PsychometricShape::weibull, protocols::LevelScale::log10,
                    protocols::Easier::higher};
  procedure = {quest, {}, std::nullopt, std::nullopt};
  expected[0]["procedure"] = Expected::parse(R"({"kind": "quest_plus", "threshold": null,
      "threshold_scale_sd": null, "slope": null, "guess": null, "lapse": null, "n_trials": 0,
      "n_reversals": 0, "n_at_limit": 0, "converges_at": null, "fit_level_there": null,
      "function": "weibull", "scale": "log"})");
  EXPECT_EQ(tracks(), expected);
  cell.functions[0].tracks[0].procedure.reset();
  expected[0].erase("procedure");
  EXPECT_EQ(tracks(), expected);
}

TEST(TaskJson, NumbersSettingsAnswersAndConfidence) {
  TaskCell cell = named_cell("rate", "", "", "");
  cell.participants = {"A", "B"};
  cell.magnitude.emplace();
  cell.magnitude->exponent = 0.75;
  cell.magnitude->exponent_ci95 = Interval{0.5, 1.25};
  cell.magnitude->without_logarithm = 4;
  cell.magnitude->lines = {{"", 1, 9, 3, 0.625, -0.5, 0.9375, 0.0625, {{300, 11.5}}}};
  cell.magnitude->means = {{300, 12.5, Interval{11.5, 13.75}, 2}};
  cell.adjustments = {{1, 4, 502.5, Interval{490, 515}, 2.25, 11, 7.5, 5.5}};
  const InformationTransfer pooled{"", 40, 2, 1.25, 1.125, 2.25, 0.0625};
  cell.information = pooled;
  cell.informations = {{"", 20, 1.75, 1.5, 1.375, 2.5, 0.125},
                       {"", 20, 1.875, 0.5, -0.25, 1, 0.25}};
  cell.information_mean.mean = 0.5625;
  cell.information_mean.ci95 = Interval{-0.5, 1.625};
  cell.information_most = 2;
  cell.confidence = {};
  cell.confidence.area = 0.6875;
  cell.confidence.area_ci95 = Interval{0.5625, 0.8125};
  cell.confidence_mean = {"", 2, 1, 0.75, Interval{0.625, 0.875}};
  cell.same_different = true;
  const Expected found = json_of_cell(cell);
  EXPECT_EQ(found["same_different"], true);
  EXPECT_EQ(found["magnitude_estimation"], Expected::parse(R"({"exponent": 0.75,
    "exponent_ci95": [0.5, 1.25], "n_without_logarithm": 4,
    "participants": [{"participant_id": "B", "exponent": 0.625, "exponent_se": 0.0625,
                      "log10_scale": -0.5, "r_squared": 0.9375,
                      "levels": [{"level": 300.0, "geometric_mean": 11.5}]}],
    "levels": [{"level": 300.0, "geometric_mean": 12.5, "ci95": [11.5, 13.75],
                "n_participants": 2}]})"));
  EXPECT_EQ(found["adjustments"], Expected::parse(R"([{"participant_id": "B", "n_settings": 4,
    "pse": 502.5, "pse_ci95": [490.0, 515.0], "constant_error": 2.25, "sd": 11.0, "jnd": 7.5,
    "start_effect": 5.5}])"));
  EXPECT_EQ(found["information_transfer"], Expected::parse(R"({"bits": 1.25,
    "bits_corrected": 1.125, "se": 0.0625, "stimulus_entropy_bits": 2.0, "categories": 2.25, "most_bits": 2.0,
    "mean_of_participants_bits_corrected": 0.5625, "mean_of_participants_ci95": [-0.5, 1.625],
    "participants": [
      {"participant_id": "A", "bits": 1.5, "bits_corrected": 1.375, "se": 0.125,
       "stimulus_entropy_bits": 1.75, "categories": 2.5},
      {"participant_id": "B", "bits": 0.5, "bits_corrected": -0.25, "se": 0.25,
       "stimulus_entropy_bits": 1.875, "categories": 1.0}]})"));
  EXPECT_EQ(found["confidence"], Expected::parse(R"({"status": "ok", "type2_roc_area": 0.6875,
    "ci95": [0.5625, 0.8125], "mean_of_participants": {"n_participants": 2, "n_left_out": 1,
      "type2_roc_area": 0.75, "ci95": [0.625, 0.875]}})"));
}

TEST(TaskJson, GroupResultsHaveEveryFigure) {
  TaskGroup group;
  group.task = "compare";
  group.block_name = "stiff";
  group.shape = "ball";
  group.measure = "jnd";
  group.unit = "N/m";
  group.geometric = true;
  group.renderers.resize(2);
  group.renderers[0].renderer = "point";
  group.renderers[0].participants = {{"A", 20.5}, {"B", 24}};
  group.renderers[0].n_undetermined = 1;
  group.renderers[0].mean = 22.25;
  group.renderers[0].sd = 0.125;
  group.renderers[0].ci95 = Interval{19, 26};
  group.renderers[1].renderer = "ray";
  group.renderers[1].n_undetermined = 3;
  group.renderers[1].of_model = true;
  group.renderers[1].n_of_model = 4;
  StudyAnalysis analysis;
  analysis.groups = {group};
  EXPECT_EQ(json_of(analysis)["group_results"], Expected::parse(R"([{"task": "compare",
    "block_name": "stiff", "shape": "ball", "measure": "jnd", "unit": "N/m", "mean_is": "geometric",
    "renderers": [{"renderer": "point", "from": "participants", "n_participants": 2, "n_undetermined": 1, "mean": 22.25,
        "ci95": [19.0, 26.0], "sd_of_natural_logs": 0.125,
        "participants": [{"participant_id": "A", "value": 20.5},
                         {"participant_id": "B", "value": 24.0}]},
      {"renderer": "ray", "from": "hierarchical model", "n_participants": 4, "n_undetermined": 3, "mean": null, "ci95": null,
       "sd_of_natural_logs": null, "participants": []}]}])"));
  analysis.groups[0].geometric = false;
  analysis.groups[0].unit.clear();
  const Expected found = json_of(analysis)["group_results"][0];
  EXPECT_EQ(found["mean_is"], "arithmetic");
  EXPECT_EQ(found["unit"], Expected());
  EXPECT_EQ(found["renderers"][0]["sd"], 0.125);
}

TEST(TaskJson, ComparisonsHaveEveryFigure) {
  TaskComparison one;
  one.task = "compare";
  one.measure = "jnd";
  one.block_name = "stiff";
  one.shape = "ball";
  one.renderer = "ray";
  one.conditions = {"first", "second"};
  one.logarithms = true;
  one.n_undetermined = 2;
  one.n_tests = 3;
  one.comparison.participant_sd = 0.5;
  one.comparison.residual_sd = 0.25;
  one.comparison.differences = {difference_of(1, 6, -0.75)};
  ConditionDifference& difference = one.comparison.differences[0];
  difference.t_test = {"", 9, 8, -2.5, 5, 0.03125, Interval{-1.5, -0.125}, 0.0625};
  difference.effect_size.dz = -1.125;
  difference.mixed_estimate = -0.625;
  difference.mixed_se = 0.375;
  StudyAnalysis analysis;
  analysis.renderers = {one};
  one.comparison = {};
  one.comparison.undefined = "nothing";
  one.logarithms = false;
  analysis.conditions = {one};
  Expected found = json_of(analysis);
  Expected& shown = found["renderer_comparisons"][0]["differences"][0];
  const PairedEvidence evidence =
      evidence_of(-0.75, analysis.renderers[0].comparison.differences[0].t_test);
  EXPECT_EQ(shown["ci90"], (Expected{evidence.ci90->low, evidence.ci90->high}));
  EXPECT_EQ(shown["least_bound"], *evidence.least_bound);
  EXPECT_EQ(shown["bf10"], *evidence.bayes_factor);
  EXPECT_EQ(found["jnd"]["stiff"]["ratio"], std::exp(-0.75));
  EXPECT_EQ(found["equivalence"]["jnd"]["stiff"]["least_bound"], *evidence.least_bound);
  for (const char* key : {"ci90", "least_bound", "bf10"}) shown.erase(key);
  EXPECT_EQ(found["renderer_comparisons"], Expected::parse(R"([{"task": "compare",
    "measure": "jnd", "block_name": "stiff", "shape": "ball", "reference": "first",
    "natural_logarithms": true, "n_undetermined": 2, "status": "ok", "participant_sd": 0.5,
    "residual_sd": 0.25, "n_tests": 3, "differences": [{"renderer": "second", "n_pairs": 6, "mean": -0.75,
      "ci95": [-1.5, -0.125], "t": -2.5, "df": 5.0, "p": 0.03125, "p_holm": 0.0625, "dz": -1.125,
      "mixed_estimate": -0.625, "mixed_se": 0.375}]}])"));
  EXPECT_EQ(found["condition_comparisons"], Expected::parse(R"([{"task": "compare",
    "measure": "jnd", "renderer": "ray", "reference": "first", "natural_logarithms": false,
    "n_undetermined": 2, "status": "undefined", "reason": "nothing", "participant_sd": null,
    "residual_sd": null}])"));
  analysis.conditions[0].comparison.differences = {difference_of(1, 0, 0)};
  EXPECT_EQ(json_of(analysis)["condition_comparisons"][0]["differences"][0]["condition"], "second");
}

TEST(TaskJson, GroupModelAndComparison) {
  StudyAnalysis analysis;
  TaskGroupModel model;
  model.block_name = "b";
  model.task = "compare";
  model.shape = "ball";
  model.measure = "jnd";
  model.renderer = "ray";
  model.unit = "N/m";
  model.n = 6;
  model.estimate = 2.5;
  model.high = 4.5;
  model.sd_between = 0.25;
  model.lapse_mean = 0.02;
  model.notes = {"JND below 4.5"};
  analysis.group_models.models.push_back(model);
  EXPECT_EQ(json_of(analysis)["group_model"][0],
            Expected::parse(R"({"block": "b", "task": "compare",
    "shape": "ball", "measure": "jnd", "renderer": "ray", "n": 6, "estimate": 2.5,
    "ci95": [null, 4.5], "sd_between": 0.25, "lapse_mean": 0.02, "status": "low open",
    "notes": ["JND below 4.5"]})"));
  TaskGroupComparison one;
  one.measure = "jnd";
  one.reference = "point";
  one.compared = "ray";
  one.ratio = true;
  one.n = 6;
  one.estimate = 0.5;
  one.low = 0.25;
  one.high = 0.75;
  one.low90 = 0.3125;
  one.p = one.p_holm = 0.125;
  one.likelihood_ratio = 3.5;
  one.individual_fits = {5, 1, 2.5, 4, 0.25, {"B"}};
  analysis.group_models.comparisons.push_back(one);
  EXPECT_EQ(json_of(analysis)["group_comparisons"][0], Expected::parse(R"({"block": "", "task": "",
    "shape": "", "measure": "jnd", "reference": "point", "compared": "ray", "scale": "ratio",
    "n": 6, "estimate": 0.5, "ci95": [0.25, 0.75], "ci90": [0.3125, null], "p": 0.125, "p_holm": 0.125, "lr": 3.5,
    "status": "ok", "individual_fits": {"n": 5, "left_out": 1, "left_out_participants": ["B"], "t": 2.5, "df": 4.0, "p": 0.25}})"));
}

}  // namespace
}  // namespace palpate::analysis
