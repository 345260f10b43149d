#include <gtest/gtest.h>

#include <map>

#include "protocols/procedures/procedure.h"

namespace palpate::protocols {
namespace {

std::vector<ProcedureSpec> one_of_each() {
  Staircase staircase;
  staircase.start = 8;
  staircase.steps = {2, 1};
  staircase.min = 1;
  staircase.max = 10;
  staircase.down = 2;
  staircase.stop_reversals = 8;
  QuestPlus quest;
  quest.levels = {1, 2, 3, 4, 5, 6, 7, 8};
  quest.threshold.values = {2, 3, 4, 5, 6};
  quest.slope.values = {0.5, 1, 2};
  quest.guess.values = {0.5};
  quest.lapse.values = {0.02, 0.1};
  quest.stop_trials = 25;
  Limits limits;
  limits.low = 1;
  limits.high = 9;
  limits.jitter_steps = 2;
  return {ConstantStimuli{{2, 4, 6}, 7}, staircase, quest, limits};
}

struct ShownTrial {
  TrackLevel asked;
  bool success;
};

std::vector<ShownTrial> run_tracks(InterleavedTracks tracks, stimuli::Random& random) {
  std::vector<ShownTrial> shown;
  while (const auto next = tracks.next()) {
    const bool success = random.unit() < 0.5 + 0.05 * next->level;
    tracks.record({next->level, success});
    shown.push_back({*next, success});
  }
  return shown;
}

TEST(InterleavedProcedures, EveryRoundHasATrialOfEveryTrackThatGoesOn) {
  stimuli::Random random(5);
  const std::vector<ShownTrial> shown = run_tracks({one_of_each(), 3}, random);
  std::map<std::size_t, std::size_t> counts;
  for (std::size_t i = 0; i < shown.size(); ++i) {
    ++counts[shown[i].asked.track];
    if (i % 4 == 3 && i < 4 * 20) {
      for (std::size_t track = 0; track < 4; ++track) EXPECT_EQ(counts[track], (i + 1) / 4) << i;
    }
  }
  EXPECT_EQ(counts[0], 21u);
  EXPECT_EQ(counts[2], 25u);
}

TEST(InterleavedProcedures, ASessionThatGoesOnIsAsIfNothingHadHappened) {
  for (const std::uint64_t seed : {1U, 2U, 99U}) {
    stimuli::Random random(seed);
    const std::vector<ShownTrial> shown = run_tracks({one_of_each(), seed}, random);
    ASSERT_GT(shown.size(), 60u);
    for (std::size_t killed = 0; killed <= shown.size(); ++killed) {
      InterleavedTracks resumed(one_of_each(), seed);
      for (std::size_t i = 0; i < killed; ++i)
        resumed.record({shown[i].asked.level, shown[i].success});
      const auto next = resumed.next();
      ASSERT_EQ(next.has_value(), killed < shown.size());
      if (!next) continue;
      EXPECT_EQ(next->track, shown[killed].asked.track);
      EXPECT_EQ(next->level, shown[killed].asked.level);
    }
  }
}

TEST(InterleavedProcedures, OrderIsByChance) {
  stimuli::Random one(1), two(1);
  const auto first = run_tracks({one_of_each(), 1}, one);
  const auto second = run_tracks({one_of_each(), 2}, two);
  int other = 0;
  for (std::size_t i = 0; i < 40; ++i)
    other += first[i].asked.track != second[i].asked.track ? 1 : 0;
  EXPECT_GT(other, 10);
}

TEST(InterleavedProcedures, NoneIsLongerThanItsSpecSays) {
  for (const ProcedureSpec& spec : one_of_each()) {
    for (const double share : {0.0, 0.5, 1.0}) {
      Procedure procedure(spec, 4);
      stimuli::Random random(8);
      while (const auto level = procedure.next_level())
        procedure.record({*level, random.unit() < share});
      EXPECT_LE(procedure.history().size(), most_trials(spec));
      EXPECT_GT(procedure.history().size(), 0u);
    }
  }
}

}  // namespace
}  // namespace palpate::protocols
