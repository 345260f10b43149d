// Reversals of tracks without a protocol, by hand.

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "analysis/statistics/task_analysis.h"

namespace palpate::analysis {
namespace {

/// The reversals of one track, from levels and answers ('+' a success).
std::vector<std::size_t> reversals(const std::vector<double>& levels, const std::string& answers) {
  StudyTable table;
  for (std::size_t i = 0; i < levels.size(); ++i) {
    StudyTrial trial;
    trial.track = "1";
    trial.level = levels[i];
    trial.success = answers[i] == '+';
    trial.answered = true;
    table.trials.push_back(trial);
  }
  std::vector<const StudyTrial*> trials;
  for (const StudyTrial& trial : table.trials) trials.push_back(&trial);
  return tracks_of(trials, table).at(0).reversals;
}

using Answers = std::vector<std::size_t>;

TEST(Tracks, OneDownOneUpReversesWhereAnswersChange) {
  EXPECT_EQ(reversals({5, 4, 3, 4, 3, 4, 5}, "++-+--+"), (Answers{2, 3, 4, 6}));
}

TEST(Tracks, ReverseAlsoWhereSuccessesRaiseTheLevel) {
  EXPECT_EQ(reversals({3, 4, 5, 4, 5, 4, 3}, "++-+--+"), (Answers{2, 3, 4, 6}));
}

TEST(Tracks, TwoDownOneUpReversesWhereDirectionChanges) {
  EXPECT_EQ(reversals({5, 5, 4, 4, 3, 4, 4, 3}, "++++-++-"), (Answers{4, 6, 7}));
}

TEST(Tracks, NeverReverseUnlessTheyFollowTheAnswers) {
  EXPECT_EQ(reversals({5, 4, 5, 4, 3, 4}, "+++--+"), Answers());
  EXPECT_EQ(reversals({5, 4, 3, 2}, "+--+"), Answers()) << "down after a failure as well";
}

TEST(Tracks, ConstantLevelsDoNotReverse) { EXPECT_EQ(reversals({5, 5, 5}, "+-+"), Answers()); }

TEST(Tracks, LeaveOutUnansweredAndCatchTrials) {
  StudyTable table;
  for (const double level : {5.0, 9.0, 4.0, 9.0, 3.0}) {
    StudyTrial trial;
    trial.level = level;
    trial.answered = level < 9 || table.trials.size() > 1;
    trial.catch_trial = level == 9 && trial.answered;
    table.trials.push_back(trial);
  }
  std::vector<const StudyTrial*> trials;
  for (const StudyTrial& trial : table.trials) trials.push_back(&trial);
  EXPECT_EQ(tracks_of(trials, table).at(0).levels, (std::vector<double>{5, 4, 3}));
}

}  // namespace
}  // namespace palpate::analysis
