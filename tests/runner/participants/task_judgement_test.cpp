// Simulated judgements against their definitions in task_participant.h: shares of many draws
// against closed forms of the normal distribution (4 standard errors), and single ones without
// noise.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <numbers>
#include <string>
#include <vector>

#include "protocols/parse.h"
#include "runner/participants/task_participant.h"
#include "tests/runner/participants/judge.h"

namespace palpate::runner::participants::judged {
namespace {

constexpr int kDraws = 4000;

double normal_cdf(double z) { return 0.5 * std::erfc(-z / std::numbers::sqrt2); }

/// Share of the draws that give the answer `name`.
double share(Judge& judge, const std::string& name, const std::vector<Interval>& intervals,
             const TaskJudgement::Felt& felt = {}, const Trial& trial = trial_of()) {
  int count = 0;
  for (int k = 0; k < kDraws; ++k) count += judge.answer(intervals, felt, trial) == name;
  return static_cast<double>(count) / kDraws;
}

void expect_share(double found, double expected, const std::string& where) {
  const double error = std::sqrt(std::max(expected * (1 - expected), 1e-3) / kDraws);
  EXPECT_NEAR(found, expected, 4 * error) << where;
}

TEST(TaskJudgement, ComparesAccordingToTheNormalDistribution) {
  Judge larger(compare()), smaller(compare(R"(, "asks": "smaller")"));
  for (const double level : {320.0, 380.0, 400.0, 440.0}) {
    const double chosen = 0.02 / 2 + 0.98 * normal_cdf((level - 400) / (0.15 * 400));
    const std::string where = std::to_string(level);
    expect_share(share(larger, "2", {kStandard, at(level)}), chosen, where);
    expect_share(share(larger, "1", {at(level), kStandard}), chosen, where + " first");
    expect_share(share(smaller, "1", {kStandard, at(level)}), chosen, where + " smaller");
  }
}

TEST(TaskJudgement, ChoosesLargestOfThreeEstimates) {
  Judge judge(compare(R"(, "intervals": 3)"));
  expect_share(share(judge, "3", {kStandard, kStandard, at(400)}), 1.0 / 3, "all alike");
  EXPECT_GT(share(judge, "2", {kStandard, at(700), kStandard}), 0.96);
}

TEST(TaskJudgement, DifferentMeansMoreThanAStandardDeviation) {
  Judge judge(compare(R"(, "answer": "same_different")"));
  const double sd = 0.15 * 400;
  for (const double level : {400.0, 450.0, 520.0}) {
    const double d = level - 400;
    const double apart = normal_cdf((d - sd) / sd) + normal_cdf((-d - sd) / sd);
    expect_share(share(judge, "different", {kStandard, at(level)}), 0.02 / 2 + 0.98 * apart,
                 std::to_string(level));
  }
  JudgementSettings sure;
  sure.lapse = 0;
  Judge measuring(compare(R"(, "answer": "same_different")"), sure);
  TaskJudgement& judgement = measuring.judgement();
  for (const double apart : {59.0, -59.0, 61.0, -61.0}) {  // with its noise already: sd 60
    judgement.begin(trial_of(), Random(kSeedOfTrial));
    judgement.feel(kStandard, {400, true, true});
    judgement.feel(at(300), {400 + apart, true, true});
    EXPECT_EQ(measuring.named(judgement.answer()), std::abs(apart) > 60 ? "different" : "same");
  }
}

TEST(TaskJudgement, AnUntouchedIntervalIsJudgedAsARandomLevel) {
  // Two random levels in 300 to 500, each with noise: both are chosen equally often, whatever the
  // true levels.
  Judge judge(compare());
  expect_share(share(judge, "2", {kStandard, at(500)}, {{}, false, false}), 0.5, "untouched");
}

TEST(TaskJudgement, DetectsByItsPsychometricFunction) {
  Judge judge(R"("task": "detect", "catch_trials": 0.2, )" + constant("200, 400, 1200"));
  Trial shown = trial_of();
  for (const double level : {500.0, 700.0, 800.0}) {
    shown.level = level;  // threshold in the middle of 200 to 1200, sd a tenth of that range
    const double yes = 0.05 + (1 - 0.05 - 0.02) * normal_cdf((level - 700) / 100);
    expect_share(share(judge, "yes", {at(level)}, {}, shown), yes, std::to_string(level));
    expect_share(share(judge, "yes", {at(level)}, {{}, false, false}, shown), 0.05, "untouched");
  }
  shown.catch_trial = true;
  expect_share(share(judge, "yes", {Interval{-1, {}, {}, false}}, {}, shown), 0.05, "nothing");
  shown.catch_trial = false;
  shown.level.reset();
  expect_share(share(judge, "yes", {at(400)}, {}, shown), 0.98, "without a level");
}

TEST(TaskJudgement, NumbersAreAPowerOfTheLevel) {
  JudgementSettings settings = exact();
  settings.exponent = 0.5;
  Judge free(R"("task": "rate", )" + constant("100, 900"), settings);
  Judge anchored(R"("task": "rate", "standard": "ball", "modulus": 30, "min": 1, "max": 40, )" +
                     constant("100, 900"),
                 settings);
  free.judgement().begin(trial_of(), Random(kSeedOfTrial));
  free.judgement().feel(at(900), {});
  EXPECT_DOUBLE_EQ(free.judgement().number(), 300);
  free.judgement().feel(at(400), {123.456, true, true});  // as the hand met it
  EXPECT_DOUBLE_EQ(free.judgement().number(), std::round(1000 * std::sqrt(123.456)) / 100);
  const auto rated = [&](double level) {
    anchored.judgement().begin(trial_of(), Random(kSeedOfTrial));
    anchored.judgement().feel(kStandard, {});
    anchored.judgement().feel(at(level), {});
    return anchored.judgement().number();
  };
  EXPECT_DOUBLE_EQ(rated(400), 30);
  EXPECT_DOUBLE_EQ(rated(100), 15);
  EXPECT_DOUBLE_EQ(rated(900), 40);  // 45 is beyond "max"
  EXPECT_DOUBLE_EQ(rated(0.01), 1);
}

TEST(TaskJudgement, NumbersScatterLogNormally) {
  JudgementSettings settings = exact();
  settings.number_sd = 0.2;
  Judge judge(R"("task": "rate", )" + constant("100, 900"), settings);
  double sum = 0, squares = 0;
  constexpr std::uint64_t kSeed = 3;
  for (int k = 0; k < kDraws; ++k) {
    judge.judgement().begin(trial_of(), Random(kSeed, {static_cast<std::uint64_t>(k)}));
    judge.judgement().feel(at(400), {});
    const double log = std::log(judge.judgement().number() / (10 * std::pow(400, 0.8)));
    sum += log;
    squares += log * log;
  }
  const double mean = sum / kDraws, sd = std::sqrt(squares / kDraws - mean * mean);
  EXPECT_NEAR(mean, 0, 4 * 0.2 / std::sqrt(kDraws));
  EXPECT_NEAR(sd, 0.2, 4 * 0.2 / std::sqrt(2.0 * kDraws));
}

TEST(TaskJudgement, ScaleStepsAreNearestToTheLevel) {
  Judge judge(R"("task": "rate", "scale": [{"label": "a"}, {"label": "b"}, {"label": "c"},
                 {"label": "d"}, {"label": "e"}], )" +
                  constant("100, 500"),
              exact());
  for (const auto& [level, step] : std::initializer_list<std::pair<double, const char*>>{
           {100, "1"}, {149, "1"}, {151, "2"}, {300, "3"}, {349, "3"}, {351, "4"}, {500, "5"}})
    EXPECT_EQ(judge.answer({at(level)}), step) << level;
  EXPECT_EQ(judge.answer({at(300)}, {1e4, true, true}), "5");
  EXPECT_EQ(judge.answer({at(300)}, {1.0, true, true}), "1");
}

TEST(TaskJudgement, IdentifiesTheNearestStiffnessAsARatio) {
  Judge judge(R"("task": "identify", "stimuli": ["ball", "soft", "mid"], "repetitions": 1)",
              exact());
  const auto named = [&](double stiffness) {
    return judge.answer({Interval{0, {}, {}, false}}, {stiffness, false, true});
  };
  EXPECT_EQ(named(139), "soft");  // the geometric mean of 100 and 200 is 141.4
  EXPECT_EQ(named(144), "mid");
  EXPECT_EQ(named(280), "mid");  // of 200 and 400: 282.8
  EXPECT_EQ(named(286), "ball");
  // Nothing measured: right.
  EXPECT_EQ(judge.answer({Interval{2, {}, {}, false}}, {}, trial_of(2)), "mid");
}

TEST(TaskJudgement, LapsesGiveAnyAnswer) {
  JudgementSettings settings = exact();
  settings.lapse = 0.3;
  Judge judge(R"("task": "identify", "stimuli": ["ball", "soft", "mid"], "repetitions": 1)",
              settings);
  expect_share(share(judge, "soft", {Interval{2, {}, {}, false}}, {}, trial_of(2)), 0.1, "one");
  expect_share(share(judge, "mid", {Interval{2, {}, {}, false}}, {}, trial_of(2)), 0.8, "right");
}

TEST(TaskJudgement, ConfidenceGrowsWithTheDifference) {
  JudgementSettings settings;
  settings.lapse = 0;
  Judge judge(compare(), settings);
  const auto confidence = [&](double apart) {  // the sd of a difference is 60
    judge.judgement().begin(trial_of(), Random(kSeedOfTrial));
    judge.judgement().feel(kStandard, {400.0, true, true});
    judge.judgement().feel(at(500), {400 + apart, true, true});
    judge.judgement().answer();
    return judge.judgement().confidence(4);
  };
  EXPECT_EQ(confidence(1), 0);
  EXPECT_EQ(confidence(29), 0);  // each of four steps is half a standard deviation
  EXPECT_EQ(confidence(31), 1);
  EXPECT_EQ(confidence(-61), 2);
  EXPECT_EQ(confidence(91), 3);
  EXPECT_EQ(confidence(1000), 3);
}

TEST(TaskJudgement, ConfidenceFollowsTheProbabilityOfTheAnswer) {
  Judge detecting(R"("task": "detect", "catch_trials": 0.2, )" + constant("200, 1200"));
  const auto sure = [&](double level) {
    Trial shown = trial_of();
    shown.level = level;
    detecting.answer({at(level)}, {}, shown);
    return detecting.judgement().confidence(10);
  };
  EXPECT_EQ(sure(700), 0);  // "yes" by 0.515
  EXPECT_EQ(sure(785), 5);  // by 0.05 + 0.93 Phi(0.85) = 0.796: 2 (0.796 - 0.5) of ten steps is 5.9
  EXPECT_EQ(sure(2000), 9);  // by 0.98
  Judge naming(R"("task": "identify", "stimuli": ["ball", "soft", "mid"], "repetitions": 1)", [] {
    JudgementSettings settings = exact();
    settings.weber = 0.15;
    return settings;
  }());
  naming.answer({Interval{0, {}, {}, false}}, {200.0, true, true});
  EXPECT_EQ(naming.judgement().confidence(10), 9);
  naming.answer({Interval{0, {}, {}, false}}, {230.0, true, true});  // ln(1.15) / 0.15 = 0.93
  EXPECT_EQ(naming.judgement().confidence(10), 5);
  naming.answer({Interval{0, {}, {}, false}}, {280.0, true, true});  // 2.24: more than two
  EXPECT_EQ(naming.judgement().confidence(10), 0);
  naming.answer({Interval{2, {}, {}, false}}, {}, trial_of(2));
  EXPECT_EQ(naming.judgement().confidence(10), 9);
  Judge half(compare());
  half.answer({kStandard, at(900)});
  half.answer({kStandard});  // nothing to compare with
  EXPECT_EQ(half.judgement().confidence(10), 0);
}

TEST(TaskJudgement, NoisyMeasurementsGetNoFurtherNoise) {
  JudgementSettings settings;
  settings.lapse = 0;
  Judge judge(compare(), settings);
  constexpr std::uint64_t kSeed = 2;
  for (std::uint64_t k = 0; k < 50; ++k) {
    judge.judgement().begin(trial_of(), Random(kSeed, {k}));
    judge.judgement().feel(kStandard, {400.0, true, true});
    judge.judgement().feel(at(300), {400.001, true, true});
    EXPECT_EQ(judge.named(judge.judgement().answer()), "2");
  }
}

TEST(TaskJudgement, RandomLevelsAreUniform) {
  Judge judge(R"("task": "rate", "scale": [{"label": "a"}, {"label": "b"}, {"label": "c"}], )" +
                  constant("100, 500"),
              exact());
  const TaskJudgement::Felt untouched{{}, false, false};
  expect_share(share(judge, "1", {at(500)}, untouched), 0.25, "lowest");
  expect_share(share(judge, "2", {at(500)}, untouched), 0.5, "middle");
}

TEST(TaskJudgement, OrientationsHaveTheSameNoiseEverywhere) {
  JudgementSettings settings;
  settings.lapse = 0;
  Judge judge(R"("task": "compare", "standard": "ball", "stimuli": ["ball"],
                 "level": {"path": "/orientation", "axis": [0, 0, 1]},
                 "procedure": {"kind": "constant", "levels": [-6, 6], "repetitions": 1})",
              settings);
  for (const double level : {-3.0, 2.0, 6.0})
    expect_share(share(judge, "2", {kStandard, at(level)}), normal_cdf(level / 3),
                 std::to_string(level));
}

TEST(TaskJudgement, WithAZeroStandardTheLargestLevelSetsTheNoise) {
  JudgementSettings settings;
  settings.lapse = 0;
  const protocols::Protocol protocol = protocols::parse_protocol_text(
      R"({"version": 2, "name": "j", "renderers": ["ray"], "stimuli": [
        {"name": "still", "shape": "sphere", "radius_m": 0.03, "friction_static": 0, "friction_dynamic": 0}],
        "blocks": [{"name": "b", "task": "compare", "standard": "still", "stimuli": ["still"],
          "level": {"path": "/friction_static"},
          "procedure": {"kind": "constant", "levels": [0.2, 0.8], "repetitions": 1}}]})",
      "j.json");
  TaskJudgement judgement(protocol, settings);
  int second = 0;
  constexpr std::uint64_t kSeed = 5;
  for (int k = 0; k < kDraws; ++k) {
    judgement.begin(trial_of(), Random(kSeed, {static_cast<std::uint64_t>(k)}));
    judgement.feel(kStandard, {});
    judgement.feel(at(0.2), {});
    second += judgement.answer();
  }
  expect_share(static_cast<double>(second) / kDraws, normal_cdf(0.2 / (0.15 * 0.8)), "friction");
}

}  // namespace
}  // namespace palpate::runner::participants::judged
