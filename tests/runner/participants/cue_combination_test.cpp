// Rules by which simulated participants combine what they feel and see, against closed forms.

#include "runner/participants/cue_combination.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "data/base/random.h"
#include "protocols/parse.h"
#include "protocols/schedule.h"
#include "runner/participants/task_participant.h"

namespace palpate::runner::participants {
namespace {

constexpr double kFelt = 0.1, kSeen = 0.05;

CueEstimates estimates(double felt, double seen) {
  CueEstimates out;
  out.felt = felt;
  out.seen = seen;
  out.felt_sd = kFelt;
  out.seen_sd = kSeen;
  return out;
}

TEST(CueCombination, OptimalHasWeightAndVarianceOfTheory) {
  Random random(5);
  double sum = 0, squares = 0;
  constexpr int kTrials = 10'000;
  for (int i = 0; i < kTrials; ++i) {
    const double one = combined_estimate(
        {}, estimates(1 + kFelt * random.normal(), 1.1 + kSeen * random.normal()));
    sum += one / kTrials;
    squares += one * one / kTrials;
  }
  const double weight = 0.01 / 0.0125, sd = kFelt * kSeen / std::hypot(kFelt, kSeen);
  EXPECT_NEAR(weight_of_seen(kFelt, kSeen), weight, 1e-15);
  EXPECT_NEAR(sum, 1 + 0.1 * weight, 4 * sd / 100);
  EXPECT_NEAR(std::sqrt(squares - sum * sum), sd, 0.03 * sd);
}

TEST(CueCombination, OneEstimateAloneIsKept) {
  CueEstimates one = estimates(1, 2);
  one.felt.reset();
  EXPECT_EQ(combined_estimate({}, one), 2);
  one = estimates(1, 2);
  one.seen.reset();
  EXPECT_EQ(combined_estimate({}, one), 1);
}

TEST(CueCombination, BestAndSwitchingTakeOneOfBoth) {
  EXPECT_EQ(combined_estimate({.rule = CueSettings::Rule::best}, estimates(1, 2)), 2);
  CueEstimates both = estimates(1, 2);
  EXPECT_EQ(combined_estimate({.rule = CueSettings::Rule::switching}, both), 1);
  both.looks = true;
  EXPECT_EQ(combined_estimate({.rule = CueSettings::Rule::switching}, both), 2);
}

TEST(CueCombination, CausalGivesUpWhatIsFarOrLate) {
  const CueSettings settings{CueSettings::Rule::causal, 0.05, 0.5};
  CueEstimates near = estimates(1, 1.02), far = estimates(1, 3);
  near.range = far.range = 1;
  const double combined = combined_estimate({}, near);
  // Prior one half, and two causes anywhere in a range of 1: the posterior is N / (N + 1).
  const double sd = std::hypot(kFelt, kSeen), z = 0.02 / sd;
  const double density = std::exp(-z * z / 2) / (sd * std::sqrt(2 * std::numbers::pi));
  const double one = density / (density + 1);
  EXPECT_NEAR(combined_estimate(settings, near), 1 + one * (combined - 1), 1e-12);
  EXPECT_NEAR(combined_estimate(settings, far), 1, 1e-6);
  near.lag = 1;
  EXPECT_NEAR(combined_estimate(settings, near), 1, 1e-6);
  // Certain of one cause, it is optimal.
  far.lag = 0;
  EXPECT_EQ(combined_estimate({CueSettings::Rule::causal, 0.05, 1}, far),
            combined_estimate({}, far));
}

protocols::Protocol sizes() {
  return protocols::parse_protocol_text(R"({"version": 2, "name": "s", "renderers": ["point"],
    "view": {"screen_m": [[-0.2, 0.2, -0.15], [0.2, 0.2, -0.15], [-0.2, 0.2, 0.15]],
             "eye_m": [0, -0.3, 0]},
    "stimuli": [
      {"name": "felt", "shape": "cube", "edge_m": 0.05},
      {"name": "seen", "shape": "cube", "edge_m": 0.05, "felt": false, "seen": {"what": "object"}},
      {"name": "larger", "shape": "cube", "edge_m": 0.05,
       "seen": {"what": "object", "size_ratio": 1.2}}],
    "blocks": [
      {"name": "a", "task": "compare", "stimuli": ["felt"], "standard": "larger",
       "level": {"path": "/edge_m"},
       "procedure": {"kind": "constant", "levels": [0.055], "repetitions": 1}},
      {"name": "b", "task": "compare", "stimuli": ["felt"], "standard": "larger",
       "intervals_seen": "comparison", "level": {"path": "/edge_m"},
       "procedure": {"kind": "constant", "levels": [0.055], "repetitions": 1}}]})",
                                        "s.json");
}

/// The share of trials in which the standard seems larger than a comparison of 55 mm.
double standard_chosen(int block) {
  const protocols::Protocol protocol = sizes();
  TaskJudgement judgement(protocol, {});
  protocols::Trial trial;
  trial.task_block = block;
  const protocols::Interval standard{.stimulus = 2, .standard = true};
  const protocols::Interval comparison{.stimulus = 0, .level = 0.055};
  int chosen = 0;
  constexpr int kTrials = 2000;
  for (int i = 0; i < kTrials; ++i) {
    judgement.begin(trial, Random(1, {static_cast<std::uint64_t>(i)}));
    judgement.feel(standard, {});
    judgement.feel(comparison, {});
    chosen += judgement.answer() == 0 ? 1 : 0;
  }
  return static_cast<double>(chosen) / kTrials;
}

TEST(CueCombination, SeenSizeShiftsTheAnswers) {
  // Seen as 60 mm, felt as 50 mm: by the optimal weight the standard lies above 55 mm.
  EXPECT_GT(standard_chosen(0), 0.65);
  // Where only comparisons are seen, it is felt as 50 mm.
  EXPECT_LT(standard_chosen(1), 0.4);
}

}  // namespace
}  // namespace palpate::runner::participants
