// The text of an analysis of tasks in a terminal, whole and word for word.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "analysis/report/report.h"
#include "analysis/report/task_tables.h"
#include "analysis/statistics/task_analysis.h"
#include "tests/analysis/report/task_report_fixture.h"

namespace palpate::analysis {
namespace {

using testing::difference_of;
using testing::full_function;
using testing::named_cell;
using testing::track_of;

const char* const kLogisticText =
    "Intervals are 95 % intervals. Psychometric functions: logistic, lapse rate free up to 0.06.\n"
    "compare with levels on both sides of the standard: the same lapse rate at both asymptotes; on "
    "one\n"
    "side: guess rate 1 / intervals, and the threshold is half-way from there to certainty;\n"
    "detect, same/different: guess rate free. d': log-linear correction.\nBayes: posterior mean of "
    "the threshold on a grid.\n";

std::string text_of_cell(TaskCell cell) {
  StudyAnalysis analysis;
  analysis.cells.push_back(std::move(cell));
  const std::string text = task_report_text(analysis);
  return text.substr(0, text.find("Intervals are"));
}

std::string line_of_function(const ParticipantFunction& one) {
  TaskCell cell = named_cell("compare", "", "ball", "");
  cell.functions = {one};
  const std::string head =
      "compare, ball: 0 trials of 0 participants, 0 answered\n"
      "  functions over the untransformed levels\n";
  std::string text = text_of_cell(cell);
  EXPECT_EQ(text.substr(0, head.size()), head);
  text = text.substr(head.size());
  EXPECT_EQ(text.substr(text.size() - 2), "\n\n");
  return text.substr(0, text.size() - 2);
}

TEST(TaskText, AnEmptyAnalysisSaysHowItIsDone) {
  StudyAnalysis analysis;
  EXPECT_EQ(task_report_text(analysis), kLogisticText);
  analysis.table.simulated = true;
  EXPECT_EQ(task_report_text(analysis), std::string("SIMULATED PARTICIPANTS\n\n") + kLogisticText);
  analysis.functions.shape = protocols::PsychometricShape::weibull;
  EXPECT_EQ(
      task_report_text(analysis),
      "SIMULATED PARTICIPANTS\n\n"
      "Intervals are 95 % intervals. Psychometric functions: weibull, lapse rate free up to 0.06.\n"
      "compare with levels on both sides of the standard: the same lapse rate at both asymptotes; "
      "on one\n"
      "side: guess rate 1 / intervals, and the JND is measured half-way from there to certainty "
      "(threshold: at "
      "63 %);\ndetect, same/different: guess rate free. d': log-linear correction.\nBayes: "
      "posterior "
      "mean of the threshold on a grid.\n");
  analysis = {};
  analysis.table.warnings = {"Column 'Level'?", "another"};
  EXPECT_EQ(task_report_text(analysis),
            std::string("Column 'Level'?\nanother\n\n") + kLogisticText);
}

TEST(TaskText, AFunctionWithEverything) {
  EXPECT_EQ(
      line_of_function(full_function("Anna")),
      "  Anna        PSE 303.5 [2, 4], JND 21.75 [1.5, 33.25], Weber fraction 0.0625, slope "
      "2.5 [1.25, 4.75], lapses 0.0313 [0, 0.06], fit p 0.042; Bayes 305.5 [285.5, 325.5], d' "
      "1.625 [1.125, 2.125], criterion -0.375 [-0.625, -0.25]");
}

TEST(TaskText, LeavesOutMissingParameters) {
  ParticipantFunction one = full_function("Anna");
  one.figures = {};
  one.model.lapse.free = false;
  one.goodness.p.reset();
  one.posterior.undefined = "no grid";
  one.detectability = {};
  const double infinity = std::numeric_limits<double>::infinity();
  one.fit.threshold_ci95 = {-infinity, infinity};
  EXPECT_EQ(line_of_function(one),
            "  Anna        threshold 301.2 [-inf, inf], slope 2.5 [1.25, 4.75]");
  one.determined = false;
  one.fit.slope_at_bound = true;
  one.figures.jnd = 12345.678;
  EXPECT_EQ(line_of_function(one),
            "  Anna        threshold 301.2 [-inf, inf], JND 1.235e+04, slope not determined, "
            "threshold NOT DETERMINED by these levels");
  one.fit.undefined = "one level only";
  EXPECT_EQ(line_of_function(one), "  Anna        no function: one level only");
  one.detectability.d_prime = 2;
  EXPECT_EQ(line_of_function(one),
            "  Anna        no function: one level only, d' 2, criterion undefined");
}

TEST(TaskText, AnswersTheOtherWayRoundAreSaid) {
  TaskCell cell = named_cell("compare", "", "ball", "");
  cell.functions = {full_function("Anna")};
  ParticipantFunction& one = cell.functions[0];
  one.detectability = {};
  one.reversed = true;
  one.determined = false;
  one.model.function.easier = protocols::Easier::lower;
  const auto has = [&](const std::string& words) {
    return text_of_cell(cell).find(words) != std::string::npos;
  };
  EXPECT_TRUE(
      has("[0, 0.06], NOT COMPARED: successes FALL as the level rises, although those of the "
          "others rise "
          "(are keys swapped?), fit p"))
      << text_of_cell(cell);
  EXPECT_FALSE(has("NOT DETERMINED"));
  cell.expected_easier = protocols::Easier::higher;
  EXPECT_TRUE(has("although the task expects them to rise (are keys swapped?)"));
  cell.expected_easier = one.model.function.easier = protocols::Easier::higher;
  EXPECT_TRUE(has("successes RISE with the level, although the task expects them to fall"));
  one.reversed = false;
  one.detectability.d_prime = -1;
  one.detectability.d_prime_ci95 = Interval{-2, -0.5};
  EXPECT_TRUE(has("d' -1 [-2, -0.5] (BELOW 0: are keys swapped?), criterion"));
  one.detectability.d_prime_ci95 = Interval{-2, 0.5};
  EXPECT_FALSE(has("BELOW"));
  cell.confidence.area = 0.25;
  cell.confidence.area_ci95 = Interval{0.125, 0.375};
  EXPECT_TRUE(has("0.25 [0.125, 0.375] (BELOW 0.5: is the scale reversed?)\n"));
  cell.confidence.area_ci95 = Interval{0.125, 0.625};
  EXPECT_FALSE(has("BELOW"));
}

TEST(TaskText, GroupResultsSayWhoWasLeftOut) {
  TaskGroup group;
  group.task = "compare";
  group.shape = "ball";
  group.measure = "weber_fraction";
  group.geometric = true;
  group.renderers = {
      {"point", {{"A", 1}, {"B", 2}}, 1, 0.25, 0.5, Interval{0.125, 0.5}, false, 0, {}},
      {"ray", {{"A", 1}}, 0, 0.75, {}, {}, false, 0, {}},
      {"other", {}, 2, {}, {}, {}, false, 0, {}}};
  StudyAnalysis analysis;
  analysis.groups = {group};
  EXPECT_EQ(
      task_report_text(analysis),
      std::string("Weber fraction (ball, point): 0.25, 95 % interval 0.125 to 0.5, 2 participants. "
                  "Weber fraction\n(ball, ray): 0.75, 1 participant.\n\n"
                  "Weber fractions over participants, compare, ball (geometric means)\n"
                  "  point       0.25 [0.125, 0.5] (2 participants, 1 not determined and left "
                  "out)\n"
                  "  ray         0.75 (1 participant)\n"
                  "  other       no mean (0 participants, 2 not determined and left out)\n"
                  "\n") +
          kLogisticText);
  analysis.groups[0].measure = "pse";
  analysis.groups[0].geometric = false;
  analysis.groups[0].unit = "N/m";
  const std::string text = task_report_text(analysis);
  EXPECT_TRUE(text.starts_with("PSE (ball, point): 0.25 N/m, 95 % interval 0.125 to 0.5")) << text;
  EXPECT_EQ(text.substr(text.find("PSEs over"), 54),
            "PSEs over participants, compare, ball (means, N/m)\n  p");
}

TEST(TaskText, ProceduresOfTracks) {
  ParticipantFunction one;
  one.participant = "B";
  one.fit.undefined = "none";
  const protocols::Staircase staircase;
  protocols::QuestPlus quest;
  quest.function = {protocols::PsychometricShape::weibull, protocols::LevelScale::decibel,
                    protocols::Easier::higher};
  protocols::Estimate estimate;
  estimate.trials = 1;
  one.tracks = {Track{}, track_of("1", staircase, estimate)};
  estimate = {2.5, 0.25, 7.5, 0.5, 0.04, 40, 1, 3};
  one.tracks.push_back(track_of("2", staircase, estimate));
  one.tracks.back().procedure->target = 0.70711;
  estimate.reversals = 0;
  one.tracks.push_back(track_of("3", quest, estimate));
  estimate.reversals = 9;
  estimate.at_limit = 1;
  one.tracks.push_back(track_of("4", protocols::Limits{}, estimate));
  estimate.at_limit = 0;
  one.tracks.push_back(track_of("5", staircase, estimate));
  one.tracks.back().procedure->target = 0.5;
  one.tracks.back().procedure->fitted_level = 2.25;
  EXPECT_EQ(
      line_of_function(one),
      "  B           no function: none\n"
      "    track 1, staircase: no estimate; 1 trial\n"
      "    track 2, staircase: 2.5, mean of its reversals, converging to 70.7 % "
      "successes; 40 trials, 1 reversal, 3 at an end of its range\n"
      "    track 3, QUEST+: threshold 2.5, slope 7.5, posterior means (weibull, db); "
      "40 trials, 3 series without a change\n"
      "    track 4, limits: 2.5, mean level at which the answer changed; 40 trials, 9 reversals, 1 "
      "series without a change\n"
      "    track 5, staircase: 2.5, mean of its reversals, converging to 50.0 % "
      "successes; fitted function there at 2.25; 40 trials, 9 reversals");
}

TEST(TaskText, CellsOfNumbersSettingsAnswersAndConfidence) {
  TaskCell rated = named_cell("rate", "size", "", "ray");
  rated.trials = 2;
  rated.participants = {"A", "B"};
  rated.answered = 1;
  rated.magnitude.emplace();
  StevensLine line;
  line.participant = 1;
  line.exponent = 0.625;
  line.r_squared = 0.9375;
  rated.magnitude->lines.push_back(line);
  line = {};
  line.undefined = "one level";
  rated.magnitude->lines.push_back(line);
  rated.magnitude->means = {{300, 12.5, Interval{11.5, 13.75}, 2}, {600, 19.5, std::nullopt, 1}};
  const std::string lines =
      "rate, size, ray: 2 trials of 2 participants, 1 answered\n"
      "  B           exponent 0.625, r2 0.9375\n"
      "  A           one level\n";
  const std::string levels =
      "  level 300: geometric mean 12.5 [11.5, 13.75]\n"
      "  level 600: geometric mean 19.5\n";
  EXPECT_EQ(text_of_cell(rated), lines + levels + "\n");
  rated.magnitude->exponent = 0.75;
  rated.magnitude->exponent_ci95 = Interval{0.5, 1.25};
  rated.magnitude->without_logarithm = 1;
  EXPECT_EQ(text_of_cell(rated),
            lines + "  exponent over participants 0.75 [0.5, 1.25]\n" + levels +
                "  1 answer of 0 or below left out: they have no logarithm\n\n");

  TaskCell set = named_cell("adjust", "match", "ball", "point");
  set.trials = 1;
  set.participants = {"Carl"};
  set.adjustments = {{0, 4, 502.5, Interval{490, 515}, 2.25, 11, 7.5, 5.5},
                     {0, 1, 499, {}, -1, {}, {}, {}}};
  set.confidence.area = 0.6875;
  set.confidence.area_ci95 = Interval{0.5625, 0.8125};
  EXPECT_EQ(text_of_cell(set),
            "adjust, match, ball, point: 1 trial of 1 participant, 0 answered\n"
            "  Carl        PSE 502.5 [490, 515], constant error 2.25, JND 7.5, settings from above "
            "minus from "
            "below 5.5\n"
            "  Carl        PSE 499, constant error -1\n"
            "  confidence: area under the type 2 ROC 0.6875 [0.5625, 0.8125]\n\n");

  TaskCell named = named_cell("identify", "shapes", "", "ray");
  named.information.emplace();
  const std::string head = "identify, shapes, ray: 0 trials of 0 participants, 0 answered\n";
  EXPECT_EQ(text_of_cell(named), head + "\n");
  named.information->plain = 1.25;
  named.information->stimulus_entropy = 2;
  named.information->corrected = 1.125;
  named.information->categories = 2.182;
  const std::string bits =
      head +
      "  information transfer 1.25 bit of 2; corrected for the bias of few trials 1.125 bit, 2.182 "
      "categories";
  EXPECT_EQ(text_of_cell(named), bits + "\n\n");
  named.information_mean.mean = 1.5;
  named.information_mean.ci95 = Interval{1.375, 1.75};
  named.information_most = 2;
  EXPECT_EQ(text_of_cell(named),
            bits +
                "; mean of the participants' 1.5 [1.375, 1.75] of at most 2 (mean of arcsin "
                "sqrt, transformed back)\n\n");
  named.information->corrected = -0.5;  // no information is not less than none
  EXPECT_NE(text_of_cell(named).find("few trials 0 bit"), std::string::npos);
}

TEST(TaskText, PointsOutTablesWithoutAScale) {
  const std::string note =
      "A table does not contain the scale of an adaptive procedure's levels: if it "
      "is\nlogarithmic, give --scale log.\n";
  StudyAnalysis analysis;
  analysis.cells = {named_cell("detect", "", "", "ray")};
  const auto is_noted = [&] {
    return task_report_text(analysis).find(kLogisticText + note) != std::string::npos;
  };
  EXPECT_FALSE(is_noted()) << "no functions";
  analysis.cells[0].functions.resize(1);
  EXPECT_TRUE(is_noted());
  analysis.cells[0].scale = protocols::LevelScale::log10;
  EXPECT_FALSE(is_noted());
  EXPECT_NE(
      task_report_text(analysis).find("\n  functions over the logarithm (base 10) of the levels\n"),
      std::string::npos);
  analysis.cells[0].scale = protocols::LevelScale::linear;
  analysis.cells[0].no_function = "both sides";
  EXPECT_FALSE(is_noted());
  EXPECT_EQ(task_report_text(analysis).find("functions over"), std::string::npos);
  analysis.cells[0].no_function = "";
  analysis.functions.scale = protocols::LevelScale::linear;
  EXPECT_FALSE(is_noted()) << "it was asked for";
  analysis.functions.scale.reset();
  analysis.table.procedures["ab"];
  EXPECT_FALSE(is_noted()) << "a database says it";
}

std::string text_of_comparison(const TaskComparison& one, bool of_renderers) {
  StudyAnalysis analysis;
  (of_renderers ? analysis.renderers : analysis.conditions).push_back(one);
  const std::string text = task_report_text(analysis);
  return text.substr(0, std::min(text.find("To quote"), text.find("Intervals are")));
}

TEST(TaskText, ComparisonsSayDifferencesAndTests) {
  TaskComparison one;
  one.task = "compare";
  one.measure = "threshold";
  one.block_name = "stiff";
  one.shape = "ball";
  one.conditions = {"point", "ray", "line"};
  one.comparison.differences = {difference_of(1, 6, 2.5), difference_of(2, 0, 9)};
  TTest& test = one.comparison.differences[0].t_test;
  test = {"", 1, 0.5, 2.875, 5, 0.0312, Interval{1.5, 3.5}, 0.0624};
  one.n_tests = 2;
  one.comparison.differences[0].effect_size.dz = 1.18;
  one.comparison.differences[0].mixed_estimate = 2.75;
  EXPECT_EQ(text_of_comparison(one, true),
            "Thresholds by renderer, compare, stiff, ball (differences)\n"
            "  ray - point: 2.5 [1.5, 3.5], t(5) = 2.88, p = 0.031 (p = 0.062 adjusted "
            "over 2 tests, Holm), dz = 1.18; mixed model 2.75 (6 pairs)\n"
            "  line - point: no participant has both\n\n");

  one = {};
  one.task = "detect";
  one.renderer = "ray";
  one.measure = "jnd";
  one.logarithms = true;
  one.n_undetermined = 2;
  one.conditions = {"a, ball", "b, ball"};
  one.comparison.differences = {difference_of(1, 1, std::log(0.5))};
  one.n_tests = 1;
  // Of one comparison the adjusted p is no other than p.
  one.comparison.differences[0].t_test = {
      "", 1, 1, -1, 1, 0.5, Interval{std::log(0.25), std::log(4)}, 0.5};
  one.comparison.differences[0].mixed_estimate = std::log(2);
  EXPECT_EQ(
      text_of_comparison(one, false),
      "JNDs by block and stimulus, detect, ray (ratios)\n"
      "  2 functions left out: no threshold among the levels shown, a slope too steep for "
      "them, or reversed answers\n"
      ""
      "  b, ball / a, ball: 0.5 [0.25, 4], t(1) = −1.00, p = 0.500; mixed model 2 (1 pair)\n\n");

  one.comparison.differences.clear();
  one.n_undetermined = 1;
  one.comparison.undefined = "nothing to compare";
  one.measure = "pse";
  EXPECT_EQ(text_of_comparison(one, false),
            "PSEs by block and stimulus, detect, ray (ratios)\n"
            "  nothing to compare\n"
            "  1 function left out: no threshold among the levels shown, a slope too steep for "
            "them, or reversed answers\n"
            "\n");
  one.measure = "exponent";
  EXPECT_EQ(text_of_comparison(one, false).substr(0, 10), "Exponents ");
}

TEST(TaskText, RatingsHaveAWilcoxonTestWithItsWarning) {
  TaskComparison one;
  one.task = "rate";
  one.measure = "rating";
  one.block_name = "rough";
  one.renderer = "point";
  one.conditions = {"silk", "wool"};
  one.n_tests = 1;
  one.comparison.differences = {difference_of(1, 6, 1.5)};
  ConditionDifference& difference = one.comparison.differences[0];
  difference.t_test = {"", 1, 0.5, 3, 5, 0.03, Interval{0.25, 2.75}, 0.03};
  difference.wilcoxon = {"", 6, 21, 0.03125, true};
  EXPECT_EQ(
      text_of_comparison(one, false),
      "Mean ratings by block and stimulus, rate, rough, point (differences)\n"
      "  wool - silk: 1.5 [0.25, 2.75], t(5) = 3.00, p = 0.030; Wilcoxon V = 21, p = 0.031 (6 "
      "pairs)\n\n");
  difference.wilcoxon = {"", 5, 15, 0.0625, true};
  EXPECT_NE(text_of_comparison(one, false)
                .find("V = 15, p = 0.062 (5 or fewer differ: p cannot be below 0.05)"),
            std::string::npos);
  StudyAnalysis analysis;
  analysis.table.simulated = true;
  analysis.conditions = {one};
  const std::string text = task_report_text(analysis);
  EXPECT_NE(
      text.find("To quote\nMean ratings (rate, rough, point), wool − silk: 1.5, 95 % CI [0.25, "
                "2.75], t(5) = 3.00, p ="),
      std::string::npos)
      << text;
  EXPECT_NE(text.find("SIMULATED PARTICIPANTS)."), std::string::npos) << text;
}

TEST(TaskText, RatioOfTheGroupHasItsInterval) {
  StudyAnalysis analysis;
  TaskGroupComparison& one = analysis.group_models.comparisons.emplace_back();
  one.task = "compare";
  one.measure = "jnd";
  one.reference = "point";
  one.compared = "ray";
  one.ratio = true;
  one.n = 6;
  one.estimate = 0.5;
  one.low = 0.25;
  one.p = one.p_holm = 0.03125;
  one.likelihood_ratio = 3.5;
  const std::string sentence =
      "JNDs (compare), ray / point: 0.5, 95 % CI above 0.25, likelihood ratio 3.50, p = 0.031, n "
      "= 6";
  EXPECT_EQ(group_sentence(one), sentence);
  one.individual_fits = {5, 1, 2.5, 4, 0.25, {"B"}};
  const std::string text = task_report_text(analysis);
  EXPECT_NE(text.find("  " + sentence +
                      "\n    individual fits: t(4) = 2.50, p = 0.250, 5 pairs, 1 "
                      "function left out (B)\n"),
            std::string::npos)
      << text;
  EXPECT_NE(text.find("To quote\nJNDs (compare), ray / point"), std::string::npos) << text;
  EXPECT_TRUE(conclusion(analysis).starts_with("JNDs are 50 % lower with the ray than with the"));
}

}  // namespace
}  // namespace palpate::analysis
