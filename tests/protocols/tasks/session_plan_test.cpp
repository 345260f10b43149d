// The next trial follows from protocol, participant and answers alone, and every trial agrees with
// its block.

#include "protocols/session_plan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "protocols/tasks/block_order.h"
#include "tests/protocols/tasks/task_study.h"

namespace palpate::protocols {
namespace {

using nlohmann::json;

bool same(const Trial& a, const Trial& b) {
  if (a.intervals.size() != b.intervals.size()) return false;
  for (std::size_t i = 0; i < a.intervals.size(); ++i) {
    const Interval &x = a.intervals[i], &y = b.intervals[i];
    if (x.stimulus != y.stimulus || x.level != y.level || x.renderer != y.renderer) return false;
  }
  return a.trial == b.trial && a.block == b.block && a.level == b.level && a.track == b.track &&
         a.orientation == b.orientation && a.catch_trial == b.catch_trial;
}

TEST(SessionPlan, ContinuesTheSameFromAnyTrial) {
  const Protocol protocol = parsed(task_study());
  const std::vector<Trial> whole = worked_off(SessionPlan(protocol, 3, 1));
  ASSERT_GT(whole.size(), 60U);
  for (std::size_t stop = 0; stop <= whole.size(); ++stop) {
    SessionPlan resumed(protocol, 3, 1);
    for (std::size_t i = 0; i < stop; ++i) resumed.answered(answer_to(whole[i]));
    EXPECT_EQ(resumed.done(), stop);
    const std::vector<Trial> rest = worked_off(resumed);
    ASSERT_EQ(rest.size(), whole.size() - stop);
    for (std::size_t i = 0; i < rest.size(); ++i) ASSERT_TRUE(same(rest[i], whole[stop + i]));
  }
}

TEST(SessionPlan, ShowsConstantLevelsEquallyOftenInEitherInterval) {
  for (const int participant : {1, 2, 17}) {
    std::map<double, int> shown, first;
    double before = 0;
    int run = 0;
    for (const Trial& trial : worked_off(SessionPlan(parsed(task_study()), participant, 1))) {
      if (trial.task_block != 0) continue;
      ASSERT_EQ(trial.intervals.size(), 2U);
      ++shown[*trial.level];
      const bool in_first = !trial.intervals[0].standard;
      EXPECT_NE(in_first, !trial.intervals[1].standard);
      EXPECT_EQ(trial.intervals[in_first ? 0 : 1].level, trial.level);
      EXPECT_FALSE(trial.intervals[in_first ? 1 : 0].level.has_value());
      first[*trial.level] += in_first ? 1 : 0;
      run = *trial.level == before ? run + 1 : 1;
      before = *trial.level;
      EXPECT_LE(run, 2);
    }
    for (const double level : {200.0, 250.0, 350.0, 400.0}) {
      EXPECT_EQ(shown[level], 6);
      EXPECT_EQ(first[level], 3);
    }
  }
}

TEST(SessionPlan, EndsAnAdaptiveBlockThatNobodyAnswers) {
  const Protocol protocol = parsed(task_study());
  SessionPlan plan(protocol, 1, 1);
  std::map<int, std::size_t> shown;
  while (!plan.finished()) {
    ++shown[plan.next().task_block];
    ASSERT_LE(shown[1], 200U);
    plan.answered({false, false, false});
  }
  EXPECT_EQ(shown[1], most_unanswered(protocol.blocks[1]));
  EXPECT_EQ(shown[1], 15U);  // a quarter of two tracks of 30
  EXPECT_EQ(shown[0], 24U);  // constant stimuli are shown once
}

TEST(SessionPlan, FollowsEachStaircaseByItsOwnAnswers) {
  const Protocol protocol = parsed(task_study());
  std::map<int, Procedure> tracks;
  for (int i = 0; i < 2; ++i)
    tracks.emplace(i + 1, Procedure(protocol.blocks[1].procedures[static_cast<std::size_t>(i)], 0));
  std::set<int> positions;
  for (const Trial& trial : worked_off(SessionPlan(protocol, 2, 1))) {
    if (trial.task_block != 1) continue;
    ASSERT_EQ(trial.intervals.size(), 3U);
    EXPECT_EQ(std::count_if(trial.intervals.begin(), trial.intervals.end(),
                            [](const Interval& i) { return i.standard; }),
              2);
    for (int i = 0; i < 3; ++i) {
      if (!trial.intervals[static_cast<std::size_t>(i)].standard) positions.insert(i);
    }
    Procedure& track = tracks.at(trial.track);
    ASSERT_EQ(trial.level, track.next_level());
    const TrialOutcome outcome = answer_to(trial);
    if (outcome.answered) track.record({*trial.level, outcome.success});
  }
  EXPECT_EQ(positions.size(), 3U);
  for (const auto& [number, track] : tracks) EXPECT_FALSE(track.next_level().has_value());
}

TEST(SessionPlan, DrawsTheSameWhateverTheAnswersAre) {
  const Protocol protocol = parsed(task_study());
  for (const bool right : {false, true}) {
    std::size_t shown = 0;
    for (SessionPlan plan(protocol, 2, 1); !plan.finished();
         plan.answered({right, right, true, std::nullopt})) {
      const Trial& trial = plan.next();
      if (trial.task_block != 1) continue;
      const DrawnTrial drawn = drawn_trial(protocol, 2, 1, shown);
      EXPECT_EQ(trial.catch_trial, drawn.catch_trial);
      EXPECT_EQ(trial.orientation, drawn.orientation);
      EXPECT_FALSE(trial.intervals.at(static_cast<std::size_t>(drawn.position)).standard);
      if (shown < 6) {  // no track ends in its first trials
        EXPECT_EQ(trial.track, track_order(protocol, 2, 1, shown / 2).at(shown % 2));
      }
      ++shown;
    }
    EXPECT_GT(shown, 6U);
  }
}

TEST(SessionPlan, HasTheShareOfCatchTrials) {
  int catches = 0, all = 0;
  std::map<decltype(Trial::renderer), int> of_renderer, catches_of_renderer;
  std::map<int, std::set<decltype(Trial::renderer)>> of_track;
  for (const Trial& trial : worked_off(SessionPlan(parsed(task_study()), 1, 1))) {
    if (trial.task_block != 2) continue;
    ++all;
    ++of_renderer[trial.renderer];
    of_track[trial.track].insert(trial.renderer);
    if (trial.catch_trial) ++catches_of_renderer[trial.renderer];
    EXPECT_EQ(trial.intervals.at(0).renderer, trial.renderer);
    ASSERT_EQ(trial.intervals.size(), 1U);
    EXPECT_EQ(trial.intervals[0].stimulus, trial.catch_trial ? -1 : 1);
    EXPECT_EQ(trial.level.has_value(), !trial.catch_trial);
    catches += trial.catch_trial ? 1 : 0;
  }
  EXPECT_EQ(all, 24);  // 3 levels x 3 x 2 renderers, and a quarter of all
  EXPECT_EQ(catches, 6);
  // Equally many with each renderer, and each in the track of its renderer.
  ASSERT_EQ(of_renderer.size(), 2U);
  for (const auto& [renderer, count] : of_renderer) {
    EXPECT_EQ(count, 12);
    EXPECT_EQ(catches_of_renderer[renderer], 3);
  }
  for (const auto& [track, renderers] : of_track) EXPECT_EQ(renderers.size(), 1U) << track;
}

TEST(SessionPlan, SpreadsCatchTrialsOverAnAdaptiveBlock) {
  json document = task_study();
  document["blocks"] = json::array({document["blocks"][2]});
  document["blocks"][0]["procedure"] = json::parse(
      R"({"kind": "staircase", "start": 0.006, "min": 0.001, "max": 0.01, "steps": [0.001],
          "easier": "lower", "stop": {"trials": 100}})");
  const std::vector<Trial> trials = worked_off(SessionPlan(parsed(document), 1, 1));
  for (std::size_t i = 0; i + 20 <= trials.size(); i += 20) {
    EXPECT_EQ(std::count_if(trials.begin() + static_cast<std::ptrdiff_t>(i),
                            trials.begin() + static_cast<std::ptrdiff_t>(i) + 20,
                            [](const Trial& t) { return t.catch_trial; }),
              5);
  }
}

TEST(SessionPlan, BalancesBlocksAndKeepsPracticeBeforeItsOwn) {
  json document = task_study();
  document["block_order"] = "counterbalanced";
  json practice = document["blocks"][1];
  practice["name"] = "practice";
  practice["practice"] = true;
  document["blocks"].insert(document["blocks"].begin() + 1, practice);
  const Protocol protocol = parsed(document);
  std::map<int, int> first;
  for (int participant = 1; participant <= 6; ++participant) {
    const std::vector<int> order = blocks_in_order(protocol, participant, 1);
    ASSERT_EQ(order.size(), 4U);
    ++first[order.front()];
    const auto at = std::find(order.begin(), order.end(), 1);
    EXPECT_EQ(*(at + 1), 2);
  }
  for (const int block : {0, 1, 3}) EXPECT_EQ(first[block], 2);
  int number = 0;
  for (const Trial& trial : worked_off(SessionPlan(protocol, 2, 1))) {
    EXPECT_GE(trial.block, number);
    number = trial.block;
    EXPECT_EQ(trial.practice, trial.task_block == 1);
  }
  EXPECT_EQ(number, 4);
}

TEST(SessionPlan, NumbersBlocksThroughAllSessions) {
  json document = task_study();
  document["blocks"][2]["session"] = 2;
  const Protocol protocol = parsed(document);
  EXPECT_EQ(protocol.sessions.count, 2);
  const std::vector<Trial> second = worked_off(SessionPlan(protocol, 1, 2));
  ASSERT_EQ(second.size(), 24U);
  EXPECT_EQ(second.front().block, 3);
  EXPECT_EQ(second.front().trial, 1);
}

TEST(SessionPlan, StartsAdjustmentsInTurn) {
  json document = task_study();
  document["blocks"] = json::parse(
      R"([{"name": "equal", "task": "adjust", "stimuli": ["soft"], "standard": "soft",
           "renderers": ["point"], "level": {"path": "/stiffness_n_per_m"}, "min": 100,
           "max": 600, "turn": 10, "starts": [150, 550], "repetitions": 4}])");
  const Protocol protocol = parsed(document);
  std::vector<double> one, two;
  for (const Trial& trial : worked_off(SessionPlan(protocol, 1, 1))) one.push_back(*trial.level);
  for (const Trial& trial : worked_off(SessionPlan(protocol, 2, 1))) two.push_back(*trial.level);
  EXPECT_EQ(one, (std::vector<double>{150, 550, 150, 550}));
  EXPECT_EQ(two, (std::vector<double>{550, 150, 550, 150}));
}

TEST(TrialCounts, EqualTheTrialsOfTheSessions) {
  const Protocol tasks = parsed(task_study());
  const std::vector<TrialCounts> counts = trial_counts(tasks);
  ASSERT_EQ(counts.size(), tasks.blocks.size());
  for (std::size_t i = 0; i < counts.size(); ++i) {
    EXPECT_EQ(counts[i].expected, expected_trials_of(tasks.blocks[i]));
    EXPECT_EQ(counts[i].most, most_trials_of(tasks.blocks[i]));
  }
  const Protocol shapes = parse_protocol(PALPATE_SOURCE_DIR "/protocols/ho2000.json");
  const std::vector<TrialCounts> of_shapes = trial_counts(shapes);
  ASSERT_EQ(of_shapes.size(), 1U);
  EXPECT_EQ(of_shapes[0].expected, static_cast<long long>(schedule(shapes, 1).size()));
}

TEST(OrderRule, NamesWhatComesInOrder) {
  const Protocol tasks = parsed(task_study());
  const std::vector<std::string> blocks = tasks.order_rule->conditions(tasks, 1);
  for (const TaskBlock* const block : listed_blocks(tasks))
    EXPECT_EQ(std::ranges::count(blocks, block->name), block->practice ? 0 : 1);
  const Protocol shapes = parse_protocol(PALPATE_SOURCE_DIR "/protocols/ho2000.json");
  EXPECT_TRUE(listed_blocks(shapes).empty());
  EXPECT_EQ(shapes.order_rule->conditions(shapes, 1).front(),
            to_string(schedule(shapes, 1).front().renderer));
  EXPECT_EQ(shapes.order_rule->condition_of("ray", ""), "ray");
}

}  // namespace
}  // namespace palpate::protocols
