// How a simulated participant adjusts a level until two stimuli feel the same.

#include <gtest/gtest.h>

#include <cstdint>
#include <string>

#include "runner/participants/task_participant.h"
#include "tests/runner/participants/judge.h"

namespace palpate::runner::participants::judged {
namespace {

class Adjusting : public ::testing::Test {
 protected:
  std::string next(const Interval& felt, bool touched = true) {
    judge_.judgement().feel(felt, {{}, false, touched});
    return judge_.named(judge_.judgement().answer());
  }
  void SetUp() override { judge_.judgement().begin(trial_of(), Random(kSeedOfTrial)); }

  Judge judge_{R"("task": "adjust", "stimuli": ["ball"], "standard": "ball",
                  "level": {"path": "/stiffness_n_per_m"}, "min": 100, "max": 500, "turn": 10,
                  "starts": [150])",
               exact()};
};

TEST_F(Adjusting, FeelsBothThenTurnsAsOftenAsNeeded) {
  EXPECT_EQ(next(at(150)), "switch");
  EXPECT_EQ(judge_.judgement().turns(), 1);
  EXPECT_EQ(next(kStandard), "switch");  // it turns the interval that it feels
  EXPECT_EQ(next(at(150)), "up");
  EXPECT_EQ(judge_.judgement().turns(), 25);
  EXPECT_EQ(next(at(466)), "down");
  EXPECT_EQ(judge_.judgement().turns(), 7);
  EXPECT_EQ(next(at(406)), "down");
  EXPECT_EQ(judge_.judgement().turns(), 1);
  EXPECT_EQ(next(at(405)), "done");  // half a turn
}

TEST_F(Adjusting, EndsWhereItTurnsNoFarther) {
  next(kStandard);
  EXPECT_EQ(next(at(100)), "up");
  judge_.judgement().begin(trial_of(), Random(kSeedOfTrial));
  judge_.judgement().feel(kStandard, {900.0, true, true});
  judge_.judgement().feel(at(499), {499.0, true, true});
  EXPECT_EQ(judge_.named(judge_.judgement().answer()), "up");
  judge_.judgement().feel(at(500), {500.0, true, true});
  EXPECT_EQ(judge_.named(judge_.judgement().answer()), "done");
  judge_.judgement().begin(trial_of(), Random(kSeedOfTrial));
  judge_.judgement().feel(kStandard, {20.0, true, true});
  judge_.judgement().feel(at(101), {101.0, true, true});
  EXPECT_EQ(judge_.named(judge_.judgement().answer()), "down");
  judge_.judgement().feel(at(100), {100.0, true, true});
  EXPECT_EQ(judge_.named(judge_.judgement().answer()), "done");
}

TEST_F(Adjusting, ReturnsToAnUntouchedInterval) {
  EXPECT_EQ(next(at(150)), "switch");
  EXPECT_EQ(next(kStandard, false), "switch");
  EXPECT_EQ(next(at(150)), "switch");  // the standard is still unknown
  EXPECT_EQ(next(kStandard), "switch");
  EXPECT_EQ(next(at(150)), "up");
  EXPECT_EQ(next(at(150), false), "switch");
  EXPECT_EQ(next(at(150)), "up");
  EXPECT_EQ(next(kStandard, false), "switch");
  EXPECT_EQ(next(at(150)), "switch");
}

TEST_F(Adjusting, BeginsEachTrialAnew) {
  next(kStandard);
  EXPECT_EQ(next(at(150)), "up");
  judge_.judgement().begin(trial_of(), Random(kSeedOfTrial));
  EXPECT_EQ(judge_.judgement().turns(), 1);
  EXPECT_EQ(next(at(150)), "switch");
  next(kStandard);
  judge_.judgement().begin(trial_of(), Random(kSeedOfTrial));
  next(kStandard);
  EXPECT_EQ(next(at(400)), "done");
  judge_.judgement().begin(trial_of(), Random(kSeedOfTrial));
  EXPECT_EQ(next(kStandard), "switch");
  judge_.judgement().begin(trial_of(), Random(kSeedOfTrial));
  EXPECT_EQ(next(at(150)), "switch");
}

TEST(AdjustingJudgement, AdjustsUntilTheyDifferByLessThanAStandardDeviation) {
  JudgementSettings settings = exact();
  settings.weber = 0.15;
  Judge judge(R"("task": "adjust", "stimuli": ["ball"], "standard": "ball",
                 "level": {"path": "/stiffness_n_per_m"}, "min": 100, "max": 500, "turn": 10,
                 "starts": [150])",
              settings);
  for (const double level : {341.0, 339.0}) {  // 400 less 15 %
    judge.judgement().begin(trial_of(), Random(kSeedOfTrial));
    judge.judgement().feel(kStandard, {400.0, true, true});
    judge.judgement().feel(at(level), {level, true, true});
    EXPECT_EQ(judge.named(judge.judgement().answer()), level > 340 ? "done" : "up");
  }
}

}  // namespace
}  // namespace palpate::runner::participants::judged
