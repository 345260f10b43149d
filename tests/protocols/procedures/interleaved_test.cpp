#include <gtest/gtest.h>

#include <cstdint>
#include <map>

#include "protocols/procedures/procedure.h"
#include "tests/shared/peak_memory.h"

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

std::vector<ShownTrial> run_tracks(InterleavedTracks tracks, Random& random) {
  std::vector<ShownTrial> shown;
  while (const auto next = tracks.next()) {
    const bool success = random.unit() < 0.5 + 0.05 * next->level;
    tracks.record({next->level, success});
    shown.push_back({*next, success});
  }
  return shown;
}

TEST(InterleavedProcedures, RoundsHaveATrialOfEveryUnfinishedTrack) {
  constexpr std::uint64_t kSeed = 5;
  Random random(kSeed);
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

TEST(InterleavedProcedures, AResumedSessionContinuesTheSame) {
  for (const std::uint64_t seed : {1U, 2U, 99U}) {
    Random random(seed);
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

TEST(InterleavedProcedures, OrderIsRandom) {
  constexpr std::uint64_t kSeed = 1;
  Random one(kSeed), two(kSeed);
  const auto first = run_tracks({one_of_each(), 1}, one);
  const auto second = run_tracks({one_of_each(), 2}, two);
  int other = 0;
  for (std::size_t i = 0; i < 40; ++i)
    other += first[i].asked.track != second[i].asked.track ? 1 : 0;
  EXPECT_GT(other, 10);
}

TEST(InterleavedProcedures, NoneExceedsTheTrialsOfItsSpec) {
  for (const ProcedureSpec& spec : one_of_each()) {
    for (const double share : {0.0, 0.5, 1.0}) {
      Procedure procedure(spec, 4);
      constexpr std::uint64_t kSeed = 8;
      Random random(kSeed);
      while (const auto level = procedure.next_level())
        procedure.record({*level, random.unit() < share});
      EXPECT_LE(procedure.history().size(), most_trials(spec));
      EXPECT_GT(procedure.history().size(), 0u);
    }
  }
}

TEST(InterleavedProcedures, TracksOfTheSameGridShareItsTables) {
  QuestPlus quest;
  for (int i = 0; i < 40; ++i) quest.levels.push_back(i + 1);
  quest.threshold.values = quest.levels;
  for (int i = 0; i < 20; ++i) quest.slope.values.push_back(0.1 * (i + 1));
  quest.guess.values = {0, 0.1, 0.2, 0.3, 0.4};
  quest.lapse.values = {0, 0.02, 0.04, 0.06};
  const auto memory_of = [&](std::size_t tracks) {
    return peak_memory([&] {
      const InterleavedTracks all(std::vector<ProcedureSpec>(tracks, quest), 1);
      ASSERT_TRUE(all.next());
    });
  };
  const auto one = memory_of(1), twelve = memory_of(12);
  ASSERT_TRUE(one && twelve);
  // 5.1 MB of tables; a posterior has 0.13 MB.
  EXPECT_GT(*one, 40U * 16000 * sizeof(double));
  EXPECT_LT(*twelve, *one + 12U * 4 * 16000 * sizeof(double));
}

TEST(InterleavedProcedures, TracksSharingTablesLearnFromTheirOwnAnswers) {
  const ProcedureSpec quest = one_of_each()[2];
  InterleavedTracks two({quest, quest}, 9);
  Procedure alone[2]{{quest, 1}, {quest, 2}};
  constexpr std::uint64_t kSeed = 3;
  Random random(kSeed);
  while (const auto next = two.next()) {
    EXPECT_EQ(alone[next->track].next_level(), next->level);
    const Response answer{next->level, random.unit() < (next->track == 0 ? 0.9 : 0.3)};
    alone[next->track].record(answer);
    two.record(answer);
  }
  for (const std::size_t i : {0U, 1U})
    EXPECT_EQ(two.tracks()[i].estimate().threshold, alone[i].estimate().threshold);
  EXPECT_NE(alone[0].estimate().threshold, alone[1].estimate().threshold);
}

}  // namespace
}  // namespace palpate::protocols
