#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "protocols/parse.h"
#include "protocols/tasks/block_order.h"
#include "protocols/tasks/block_trials.h"
#include "protocols/tasks/texts.h"

namespace palpate::protocols {
namespace {

Protocol reaches() {
  return parse_protocol(PALPATE_SOURCE_DIR "/tests/protocols/good/reach-v2.json");
}

TEST(Reach, ReadsEveryKey) {
  const Protocol protocol = reaches();
  const TaskBlock& block = protocol.blocks.at(0);
  ASSERT_TRUE(block.reaching);
  const ReachingSpec& reaching = *block.reaching;
  EXPECT_EQ(block.task, TaskKind::reach);
  EXPECT_EQ(reaching.home, Vec3(0, -0.03, 0));
  EXPECT_EQ(reaching.targets, (std::vector<Vec3>{{0, 0.05, 0}, {0.05, 0, 0}, {0, 0, 0.05}}));
  EXPECT_EQ(reaching.home_radius, 0.004);
  EXPECT_EQ(reaching.target_radius, 0.006);
  EXPECT_EQ(reaching.least_time, 0.3);
  EXPECT_EQ(reaching.most_time, 0.8);
  EXPECT_EQ(reaching.clamp_share, 0.2);
  EXPECT_EQ(reaching.catch_share, 0.1);
  EXPECT_EQ(reaching.clamp_stiffness, 900);
  EXPECT_EQ(protocol.texts.go_home, "x");
}

TEST(Reach, EveryTargetHasAChannelOfItsOwn) {
  const Protocol protocol = reaches();
  const ReachingSpec& reaching = *protocol.blocks.at(0).reaching;
  ASSERT_EQ(reaching.channels.size(), reaching.targets.size());
  for (std::size_t t = 0; t < reaching.targets.size(); ++t) {
    const StimulusSpec& channel =
        protocol.stimuli.at(static_cast<std::size_t>(reaching.channels[t]));
    EXPECT_EQ(channel.name, "channel " + std::to_string(t + 1));
    EXPECT_EQ(channel.object.shape, stimuli::ShapeKind::none);
    const stimuli::FieldSpec& field = channel.object.fields.at(0);
    EXPECT_EQ(field.kind, stimuli::FieldSpec::Kind::channel);
    EXPECT_EQ(field.centre, reaching.home);
    EXPECT_EQ(field.to, reaching.targets[t]);
    EXPECT_EQ(field.stiffness, 900);
  }
  EXPECT_EQ(protocol.stimulus_texts.size(), protocol.stimuli.size());
  EXPECT_TRUE(protocol.blocks.at(1).reaching->channels.empty());
}

/// Trials by target and kind.
std::map<std::pair<double, ReachTrial>, int> counted(const std::vector<Trial>& trials) {
  std::map<std::pair<double, ReachTrial>, int> counts;
  for (const Trial& trial : trials) ++counts[{*trial.level, trial.reach}];
  return counts;
}

TEST(Reach, ClampsAndCatchesTakeTheirShare) {
  const Protocol protocol = reaches();
  const std::vector<Trial> trials = trials_of_block(protocol, 3, 0);
  EXPECT_EQ(trials.size(), 18U);
  EXPECT_EQ(most_trials_of(protocol.blocks[0]), 18);
  const auto counts = counted(trials);
  for (const double target : {1., 2., 3.}) {
    int all = 0;
    for (const ReachTrial kind : {ReachTrial::field, ReachTrial::none, ReachTrial::clamp}) {
      const auto found = counts.find({target, kind});
      all += found == counts.end() ? 0 : found->second;
    }
    EXPECT_EQ(all, 6) << target;
  }
  // 3.6 of 18 are clamps, rounded; 1.8 are catch trials.
  EXPECT_EQ(counts.at({1, ReachTrial::clamp}), 2);
  EXPECT_EQ(counts.at({2, ReachTrial::clamp}), 1);
  EXPECT_EQ(counts.at({3, ReachTrial::none}), 1);
  EXPECT_FALSE(counts.contains({1, ReachTrial::none}));
}

TEST(Reach, IntervalsShowFieldChannelOrNothing) {
  const Protocol protocol = reaches();
  const ReachingSpec& reaching = *protocol.blocks[0].reaching;
  for (const Trial& trial : trials_of_block(protocol, 1, 0)) {
    ASSERT_EQ(trial.intervals.size(), 1U);
    const auto target = static_cast<std::size_t>(*trial.level) - 1;
    const int felt = trial.intervals.front().stimulus;
    EXPECT_EQ(trial.stimulus, 0);
    EXPECT_EQ(trial.catch_trial, trial.reach == ReachTrial::none);
    if (trial.reach == ReachTrial::field) EXPECT_EQ(felt, 0);
    if (trial.reach == ReachTrial::none) EXPECT_EQ(felt, -1);
    if (trial.reach == ReachTrial::clamp) EXPECT_EQ(felt, reaching.channels[target]);
  }
}

TEST(Reach, FieldsAreNotTurned) {
  Protocol protocol = reaches();
  protocol.orientation = OrientationKind::uniform;
  for (std::size_t i = 0; i < 5; ++i)
    EXPECT_EQ(orientation_in_block(protocol, 1, 0, i), Quat(1, 0, 0, 0));
}

TEST(Reach, OnlyItsProtocolsTranslateItsText) {
  const auto has = [](const Protocol& protocol) {
    return std::ranges::any_of(texts_of(protocol),
                               [](const auto& text) { return text.first == "texts.go_home"; });
  };
  EXPECT_TRUE(has(reaches()));
  EXPECT_FALSE(has(parse_protocol(PALPATE_SOURCE_DIR "/tests/protocols/good/procedures-v2.json")));
}

}  // namespace
}  // namespace palpate::protocols
