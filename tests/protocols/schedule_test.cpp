#include "protocols/schedule.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <tuple>

#include "data/base/checksum.h"
#include "protocols/parse.h"

namespace palpate::protocols {
namespace {

Protocol ho2000() { return parse_protocol(PALPATE_SOURCE_DIR "/protocols/ho2000.json"); }

std::string text_of(const std::vector<Trial>& trials) {
  std::string text;
  for (const Trial& t : trials) {
    std::array<char, 200> line{};
    std::snprintf(line.data(), line.size(), "%d %d %d %s %d %.17g %.17g %.17g %.17g %d\n",
                  t.session, t.block, t.trial, to_string(t.renderer), t.stimulus, t.orientation.w,
                  t.orientation.x, t.orientation.y, t.orientation.z, t.practice ? 1 : 0);
    text += line.data();
  }
  return text;
}

/// The stimuli of each block, or another field of its trials.
template <class Field>
auto by_block(const std::vector<Trial>& trials, Field field) {
  std::map<int, std::vector<decltype(field(trials[0]))>> blocks;
  for (const Trial& trial : trials) blocks[trial.block].push_back(field(trial));
  return blocks;
}

int longest_run(const std::vector<int>& stimuli) {
  int longest = 0, run = 0;
  for (std::size_t i = 0; i < stimuli.size(); ++i) {
    run = i > 0 && stimuli[i] == stimuli[i - 1] ? run + 1 : 1;
    longest = std::max(longest, run);
  }
  return longest;
}

// A change here changes the meaning of every published seed.
TEST(Schedule, Ho2000NeverChanges) {
  std::string text;
  for (int participant = 1; participant <= 7; ++participant) {
    text += text_of(schedule(ho2000(), participant));
  }
  EXPECT_EQ(checksum_hex(text), "1863b585016ce244cb648500535f4f0ac29d22032bd8879f6bb464414a41184b");
}

TEST(Schedule, Ho2000IsThePapersDesign) {
  for (int participant = 1; participant <= 7; ++participant) {
    const std::vector<Trial> trials = schedule(ho2000(), participant);
    ASSERT_EQ(trials.size(), 608u);
    std::map<std::tuple<RendererKind, int>, int> shown;
    std::map<std::tuple<int, int>, int> in_block;
    for (std::size_t i = 0; i < trials.size(); ++i) {
      const Trial& trial = trials[i];
      ++shown[{trial.renderer, trial.stimulus}];
      ++in_block[{trial.block, trial.stimulus}];
      EXPECT_EQ(trial.trial, static_cast<int>(i) + 1);
      EXPECT_EQ(trial.block, static_cast<int>(i) / 76 + 1);
      EXPECT_EQ(trial.session, 1);
      EXPECT_FALSE(trial.practice);
      EXPECT_NEAR(glm::length(trial.orientation), 1, 1e-14);
    }
    ASSERT_EQ(shown.size(), 8u);
    for (const auto& [what, times] : shown) EXPECT_EQ(times, 76);
    ASSERT_EQ(in_block.size(), 32u);
    for (const auto& [what, times] : in_block) EXPECT_EQ(times, 19);
    for (const auto& [block, stimuli] :
         by_block(trials, [](const Trial& t) { return t.stimulus; })) {
      EXPECT_LE(longest_run(stimuli), 3);
    }
    const RendererKind first = participant % 2 == 1 ? RendererKind::point : RendererKind::ray;
    for (const Trial& trial : trials) EXPECT_EQ(trial.renderer == first, trial.block <= 4);
  }
}

TEST(Schedule, ParticipantsDoNotDependOnEachOther) {
  const Protocol protocol = ho2000();
  const std::string alone = text_of(schedule(protocol, 2));
  schedule(protocol, 1);
  EXPECT_EQ(text_of(schedule(protocol, 2)), alone);
  std::set<std::string> texts;
  for (int participant = 1; participant <= 20; ++participant) {
    texts.insert(text_of(schedule(protocol, participant)));
  }
  EXPECT_EQ(texts.size(), 20u);
}

TEST(Schedule, SeedsDiffer) {
  Protocol protocol = ho2000();
  const std::string before = text_of(schedule(protocol, 1));
  ++protocol.seed;
  EXPECT_NE(text_of(schedule(protocol, 1)), before);
}

TEST(Schedule, OrientationsDoNotDependOnTheOrder) {
  Protocol protocol = ho2000();
  const std::vector<Trial> limited = schedule(protocol, 1);
  protocol.order = {};
  protocol.practice.repetitions = 2;
  std::vector<Trial> free = schedule(protocol, 1);
  std::erase_if(free, [](const Trial& trial) { return trial.practice; });
  ASSERT_EQ(free.size(), limited.size());
  bool same_order = true;
  for (std::size_t i = 0; i < free.size(); ++i) {
    EXPECT_EQ(free[i].orientation, limited[i].orientation);
    same_order &= free[i].stimulus == limited[i].stimulus;
  }
  EXPECT_FALSE(same_order);
}

TEST(Schedule, FixedOrderIsAsListed) {
  Protocol protocol = ho2000();
  protocol.renderer_order = RendererOrder::fixed;
  protocol.renderers = {RendererKind::ray, RendererKind::point};
  for (int participant = 1; participant <= 3; ++participant) {
    EXPECT_EQ(schedule(protocol, participant).front().renderer, RendererKind::ray);
    EXPECT_EQ(schedule(protocol, participant).back().renderer, RendererKind::point);
  }
  EXPECT_EQ(renderer_orders(protocol), 1);
}

TEST(Schedule, InterleavedMixesRenderersWithinBlocks) {
  const Protocol protocol = parse_protocol(PALPATE_SOURCE_DIR "/protocols/ho2000-interleaved.json");
  const std::vector<Trial> trials = schedule(protocol, 1);
  ASSERT_EQ(trials.size(), 608u);
  std::map<std::tuple<int, RendererKind, int>, int> shown;
  for (const Trial& trial : trials) ++shown[{trial.block, trial.renderer, trial.stimulus}];
  EXPECT_EQ(shown.size(), 8u * 2 * 4);
  for (const auto& [what, times] : shown) EXPECT_EQ(times, std::get<0>(what) <= 4 ? 10 : 9);
  for (const auto& [block, stimuli] : by_block(trials, [](const Trial& t) { return t.stimulus; })) {
    EXPECT_LE(longest_run(stimuli), 3);
  }
}

TEST(Schedule, SequentialInterleavedShowsAllStimuliPerRenderer) {
  Protocol protocol = ho2000();
  protocol.renderer_order = RendererOrder::interleaved;
  protocol.order = {OrderKind::sequential, 1, 4};
  protocol.repetitions = 4;
  const std::vector<Trial> trials = schedule(protocol, 5);
  ASSERT_EQ(trials.size(), 32u);
  for (std::size_t i = 0; i < trials.size(); ++i) {
    EXPECT_EQ(trials[i].stimulus, static_cast<int>(i % 4));
    EXPECT_EQ(trials[i].renderer, i / 4 % 2 == 0 ? RendererKind::point : RendererKind::ray);
  }
}

TEST(Schedule, SpreadsRepetitionsOverBlocks) {
  Protocol protocol = ho2000();
  protocol.repetitions = 10;
  std::vector<std::size_t> sizes;
  for (const auto& [block, stimuli] :
       by_block(schedule(protocol, 1), [](const Trial& t) { return t.stimulus; })) {
    sizes.push_back(stimuli.size());
  }
  EXPECT_EQ(sizes, (std::vector<std::size_t>{12, 12, 8, 8, 12, 12, 8, 8}));
}

TEST(Schedule, PracticeComesBeforeEachRenderersFirstBlock) {
  Protocol protocol = ho2000();
  protocol.practice.repetitions = 2;
  const std::vector<Trial> trials = schedule(protocol, 1);
  ASSERT_EQ(trials.size(), 608u + 2 * 8);
  for (const Trial& trial : trials) {
    EXPECT_EQ(trial.practice, trial.block == 1 || trial.block == 6);
    EXPECT_EQ(trial.renderer, trial.block <= 5 ? RendererKind::point : RendererKind::ray);
  }
  EXPECT_EQ(trials.back().block, 10);
  const std::vector<Trial> round = practice_round(protocol, 1, RendererKind::ray, 1);
  ASSERT_EQ(round.size(), 8u);
  for (std::size_t i = 0; i < round.size(); ++i) {
    EXPECT_EQ(round[i].stimulus, trials[8 + 304 + i].stimulus);
    EXPECT_EQ(round[i].orientation, trials[8 + 304 + i].orientation);
    EXPECT_EQ(round[i].trial, static_cast<int>(i) + 1);
    EXPECT_TRUE(round[i].practice);
  }
}

TEST(Schedule, FurtherPracticeRoundsDifferWithinTheLimits) {
  Protocol protocol = ho2000();
  protocol.practice.repetitions = 5;
  protocol.order.max_run = 1;
  std::set<std::vector<int>> orders;
  for (const RendererKind renderer : protocol.renderers) {
    for (int round = 1; round <= 10; ++round) {
      const std::vector<Trial> trials = practice_round(protocol, 3, renderer, round);
      EXPECT_EQ(trials.size(), 20u);
      std::vector<int> stimuli;
      for (const Trial& trial : trials) stimuli.push_back(trial.stimulus);
      EXPECT_EQ(longest_run(stimuli), 1);
      orders.insert(stimuli);
      EXPECT_EQ(trials.front().renderer, renderer);
    }
  }
  EXPECT_EQ(orders.size(), 20u);
  protocol.renderer_order = RendererOrder::interleaved;
  EXPECT_EQ(practice_round(protocol, 3, RendererKind::ray, 1).size(), 40u);
}

TEST(Schedule, SessionsGetWholeBlocksWhereThereAreEnough) {
  Protocol protocol = ho2000();
  protocol.sessions.count = 3;
  protocol.sessions.warm_up_trials = 6;
  const std::vector<Trial> trials = schedule(protocol, 1);
  ASSERT_EQ(trials.size(), 608u + 12);
  std::map<int, int> main, warm_up, last;
  for (std::size_t i = 0; i < trials.size(); ++i) {
    const Trial& trial = trials[i];
    ++(trial.practice ? warm_up : main)[trial.session];
    EXPECT_EQ(trial.trial, ++last[trial.session]);
    EXPECT_EQ(trial.practice, trial.session > 1 && trial.trial <= 6);
    EXPECT_GE(trial.block, trials[i == 0 ? 0 : i - 1].block);
  }
  EXPECT_EQ(main, (std::map<int, int>{{1, 3 * 76}, {2, 3 * 76}, {3, 2 * 76}}));
  EXPECT_EQ(warm_up, (std::map<int, int>{{2, 6}, {3, 6}}));
  EXPECT_EQ(trials.back().block, 10);
  // The warm-up uses the next stimuli: the second session continues with the point renderer's last
  // block.
  EXPECT_EQ(trials[3 * 76].renderer, RendererKind::point);
  EXPECT_EQ(trials[6 * 76 + 6].renderer, RendererKind::ray);
}

TEST(Schedule, MoreSessionsThanBlocksDivideTheTrialsEvenly) {
  Protocol protocol = ho2000();
  protocol.blocks_per_renderer = 1;
  protocol.sessions.count = 3;
  protocol.practice.repetitions = 1;
  const std::vector<Trial> trials = schedule(protocol, 1);
  std::map<int, int> main;
  for (const Trial& trial : trials) main[trial.session] += trial.practice ? 0 : 1;
  EXPECT_EQ(main, (std::map<int, int>{{1, 203}, {2, 203}, {3, 202}}));
  // Practice, 203 | 101, practice, 102 | 202: six stretches, each a block.
  EXPECT_EQ(trials.back().block, 6);
  std::map<std::tuple<int, int>, int> size;
  for (const Trial& trial : trials) ++size[{trial.session, trial.block}];
  EXPECT_EQ(
      size,
      (std::map<std::tuple<int, int>, int>{
          {{1, 1}, 4}, {{1, 2}, 203}, {{2, 3}, 101}, {{2, 4}, 4}, {{2, 5}, 102}, {{3, 6}, 202}}));
}

TEST(Schedule, ListedOrientationsAreUsedEvenly) {
  Protocol protocol = ho2000();
  protocol.orientation = OrientationKind::listed;
  for (int i = 0; i < 5; ++i)
    protocol.orientations.push_back(glm::angleAxis(0.1 * i, Vec3(1, 0, 0)));
  std::map<std::tuple<RendererKind, int, double>, int> used;
  const std::vector<Trial> trials = schedule(protocol, 1);
  for (const Trial& trial : trials) {
    ++used[{trial.renderer, trial.stimulus, trial.orientation.x}];
  }
  EXPECT_EQ(used.size(), 2u * 4 * 5);
  for (const auto& [what, times] : used) EXPECT_TRUE(times == 15 || times == 16) << times;
  // The one that is used once more is random.
  std::set<double> once_more;
  for (const auto& [what, times] : used) {
    if (times == 16) once_more.insert(std::get<2>(what));
  }
  EXPECT_GT(once_more.size(), 1u);
  protocol.orientations.clear();
  EXPECT_THROW(schedule(protocol, 1), ScheduleError);
}

TEST(Schedule, FixedOrientationIsNone) {
  Protocol protocol = ho2000();
  protocol.orientation = OrientationKind::fixed;
  for (const Trial& trial : schedule(protocol, 1)) EXPECT_EQ(trial.orientation, Quat(1, 0, 0, 0));
}

TEST(Schedule, RefusesImpossibleArguments) {
  Protocol protocol = ho2000();
  EXPECT_THROW(schedule(protocol, 0), std::invalid_argument);
  EXPECT_THROW(practice_round(protocol, 1, RendererKind::ray, 0), std::invalid_argument);
  protocol.order.min_distance = 5;
  EXPECT_THROW(schedule(protocol, 1), ScheduleError);
}

}  // namespace
}  // namespace palpate::protocols
