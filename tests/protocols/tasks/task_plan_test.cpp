// The next trial follows from protocol, participant and answers alone, and every trial is as its
// block says.

#include "protocols/tasks/task_plan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <tuple>

#include "protocols/parse.h"
#include "protocols/tasks/levels.h"
#include "stimuli/random.h"

namespace palpate::protocols {
namespace {

using nlohmann::json;

json study() {
  return json::parse(R"({"version": 2, "name": "s", "renderers": ["point", "ray"], "seed": 5,
    "stimuli": [{"name": "soft", "shape": "sphere", "radius_m": 0.03, "stiffness_n_per_m": 300},
                {"name": "lump", "shape": "sphere", "radius_m": 0.03, "stiffness_n_per_m": 100,
                 "layers": [{"depth_m": 0.004, "stiffness_n_per_m": 300}]}],
    "blocks": [
      {"name": "constant", "task": "compare", "stimuli": ["soft"], "standard": "soft",
       "renderers": ["ray"], "level": {"path": "/stiffness_n_per_m"},
       "procedure": {"kind": "constant", "levels": [200, 250, 350, 400], "repetitions": 6},
       "order": {"max_run": 2}},
      {"name": "stairs", "task": "compare", "intervals": 3, "stimuli": ["soft"],
       "standard": "soft", "renderers": ["ray"], "level": {"path": "/stiffness_n_per_m"},
       "procedure": [
         {"kind": "staircase", "start": 500, "min": 300, "max": 600, "steps": [50, 25], "down": 2,
          "stop": {"reversals": 6, "trials": 30}},
         {"kind": "staircase", "start": 400, "min": 300, "max": 600, "steps": [50, 25], "down": 3,
          "stop": {"reversals": 6, "trials": 30}}]},
      {"name": "lumps", "task": "detect", "stimuli": ["lump"], "catch_trials": 0.25,
       "level": {"path": "/layers/0/depth_m"},
       "procedure": {"kind": "constant", "levels": [0.002, 0.004, 0.008], "repetitions": 3}}
    ]})");
}

Protocol parsed(const json& document) { return parse_protocol_text(document.dump(), "study.json"); }

/// Answers that depend on the trial alone.
TrialOutcome answer_to(const Trial& trial) {
  stimuli::Random random(99, {static_cast<std::uint64_t>(trial.trial)});
  const bool success = random.unit() < (trial.level.value_or(400) > 380 ? 0.9 : 0.4);
  return {success, success, random.unit() > 0.05};
}

std::vector<Trial> worked_off(TaskPlan plan) {
  std::vector<Trial> trials;
  while (!plan.finished()) {
    trials.push_back(plan.next());
    plan.answered(answer_to(trials.back()));
  }
  return trials;
}

bool same(const Trial& a, const Trial& b) {
  if (a.intervals.size() != b.intervals.size()) return false;
  for (std::size_t i = 0; i < a.intervals.size(); ++i) {
    const Interval &x = a.intervals[i], &y = b.intervals[i];
    if (x.stimulus != y.stimulus || x.level != y.level || x.renderer != y.renderer) return false;
  }
  return a.trial == b.trial && a.block == b.block && a.level == b.level && a.track == b.track &&
         a.orientation == b.orientation && a.catch_trial == b.catch_trial;
}

TEST(TaskPlan, GoesOnFromAnyTrialAsIfNothingHadHappened) {
  const Protocol protocol = parsed(study());
  const std::vector<Trial> whole = worked_off(TaskPlan(protocol, 3, 1));
  ASSERT_GT(whole.size(), 60U);
  for (std::size_t stop = 0; stop <= whole.size(); ++stop) {
    TaskPlan resumed(protocol, 3, 1);
    for (std::size_t i = 0; i < stop; ++i) resumed.answered(answer_to(whole[i]));
    EXPECT_EQ(resumed.done(), stop);
    const std::vector<Trial> rest = worked_off(resumed);
    ASSERT_EQ(rest.size(), whole.size() - stop);
    for (std::size_t i = 0; i < rest.size(); ++i) ASSERT_TRUE(same(rest[i], whole[stop + i]));
  }
}

TEST(TaskPlan, ShowsEveryConstantLevelEquallyOftenInEitherInterval) {
  for (const int participant : {1, 2, 17}) {
    std::map<double, int> shown, first;
    double before = 0;
    int run = 0;
    for (const Trial& trial : worked_off(TaskPlan(parsed(study()), participant, 1))) {
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

TEST(TaskPlan, EndsAnAdaptiveBlockThatNobodyAnswers) {
  const Protocol protocol = parsed(study());
  TaskPlan plan(protocol, 1, 1);
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

TEST(TaskPlan, FollowsEachStaircaseByItsOwnAnswers) {
  const Protocol protocol = parsed(study());
  std::map<int, Procedure> tracks;
  for (int i = 0; i < 2; ++i)
    tracks.emplace(i + 1, Procedure(protocol.blocks[1].procedures[static_cast<std::size_t>(i)], 0));
  std::set<int> positions;
  for (const Trial& trial : worked_off(TaskPlan(protocol, 2, 1))) {
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

TEST(TaskPlan, HasTheShareOfCatchTrialsInWhichNothingIsShown) {
  int catches = 0, all = 0;
  for (const Trial& trial : worked_off(TaskPlan(parsed(study()), 1, 1))) {
    if (trial.task_block != 2) continue;
    ++all;
    ASSERT_EQ(trial.intervals.size(), 1U);
    EXPECT_EQ(trial.intervals[0].stimulus, trial.catch_trial ? -1 : 1);
    EXPECT_EQ(trial.level.has_value(), !trial.catch_trial);
    catches += trial.catch_trial ? 1 : 0;
  }
  EXPECT_EQ(all, 24);  // 3 levels x 3 x 2 renderers, and a quarter of all
  EXPECT_EQ(catches, 6);
}

TEST(TaskPlan, SpreadsCatchTrialsOverAnAdaptiveBlock) {
  json document = study();
  document["blocks"] = json::array({document["blocks"][2]});
  document["blocks"][0]["procedure"] = json::parse(
      R"({"kind": "staircase", "start": 0.006, "min": 0.001, "max": 0.01, "steps": [0.001],
          "easier": "lower", "stop": {"trials": 100}})");
  const std::vector<Trial> trials = worked_off(TaskPlan(parsed(document), 1, 1));
  for (std::size_t i = 0; i + 20 <= trials.size(); i += 20) {
    EXPECT_EQ(std::count_if(trials.begin() + static_cast<std::ptrdiff_t>(i),
                            trials.begin() + static_cast<std::ptrdiff_t>(i) + 20,
                            [](const Trial& t) { return t.catch_trial; }),
              5);
  }
}

TEST(TaskPlan, BalancesBlocksAndKeepsPracticeBeforeItsOwn) {
  json document = study();
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
  for (const Trial& trial : worked_off(TaskPlan(protocol, 2, 1))) {
    EXPECT_GE(trial.block, number);
    number = trial.block;
    EXPECT_EQ(trial.practice, trial.task_block == 1);
  }
  EXPECT_EQ(number, 4);
}

TEST(TaskPlan, NumbersBlocksThroughAllSessions) {
  json document = study();
  document["blocks"][2]["session"] = 2;
  const Protocol protocol = parsed(document);
  EXPECT_EQ(protocol.sessions.count, 2);
  const std::vector<Trial> second = worked_off(TaskPlan(protocol, 1, 2));
  ASSERT_EQ(second.size(), 24U);
  EXPECT_EQ(second.front().block, 3);
  EXPECT_EQ(second.front().trial, 1);
}

TEST(TaskPlan, StartsAdjustmentsInTurn) {
  json document = study();
  document["blocks"] = json::parse(
      R"([{"name": "equal", "task": "adjust", "stimuli": ["soft"], "standard": "soft",
           "renderers": ["point"], "level": {"path": "/stiffness_n_per_m"}, "min": 100,
           "max": 600, "turn": 10, "starts": [150, 550], "repetitions": 4}])");
  const Protocol protocol = parsed(document);
  std::vector<double> one, two;
  for (const Trial& trial : worked_off(TaskPlan(protocol, 1, 1))) one.push_back(*trial.level);
  for (const Trial& trial : worked_off(TaskPlan(protocol, 2, 1))) two.push_back(*trial.level);
  EXPECT_EQ(one, (std::vector<double>{150, 550, 150, 550}));
  EXPECT_EQ(two, (std::vector<double>{550, 150, 550, 150}));
}

/// The same study in version 1 and in version 2.
struct SameStudy {
  json one, two;
};

SameStudy identification(const char* orientation) {
  const json stimuli = json::parse(
      R"([{"name": "sphere", "shape": "sphere", "radius_m": 0.03},
          {"name": "cone", "shape": "cone", "radius_m": 0.03, "height_m": 0.06},
          {"name": "cube", "shape": "cube", "edge_m": 0.06}])");
  const json keys = {{"1", "sphere"}, {"2", "cone"}, {"3", "cube"}};
  SameStudy study;
  study.one = {{"version", 1},
               {"name", "s"},
               {"renderers", {"point", "ray"}},
               {"stimuli", stimuli},
               {"seed", 8},
               {"orientation", json::parse(orientation)},
               {"repetitions", 5},
               {"response", {{"keys", keys}}}};
  study.two = study.one;
  study.two.erase("repetitions");
  study.two.erase("response");
  study.two["version"] = 2;
  const auto block = [&](const char* name, const json& renderers) {
    return json{{"name", name},           {"task", "identify"},
                {"renderers", renderers}, {"stimuli", {"sphere", "cone", "cube"}},
                {"repetitions", 5},       {"keys", keys}};
  };
  study.two["blocks"] = {block("with-point", {"point"}), block("with-ray", {"ray"})};
  study.two["block_order"] = "counterbalanced";
  return study;
}

void expect_equal_trials(const SameStudy& study) {
  const Protocol one = parsed(study.one), two = parsed(study.two);
  for (const int participant : {1, 2, 7}) {
    const std::vector<Trial> expected = schedule(one, participant);
    const std::vector<Trial> found = worked_off(TaskPlan(two, participant, 1));
    ASSERT_EQ(found.size(), expected.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
      const Trial &a = expected[i], &b = found[i];
      EXPECT_EQ(a.stimulus, b.stimulus) << "participant " << participant << ", trial " << i;
      EXPECT_EQ(a.renderer, b.renderer);
      EXPECT_EQ(a.orientation, b.orientation);
      EXPECT_EQ(std::tuple(a.session, a.block, a.trial, a.practice),
                std::tuple(b.session, b.block, b.trial, b.practice));
      ASSERT_EQ(b.intervals.size(), 1U);
      EXPECT_EQ(b.intervals[0].stimulus, a.stimulus);
      EXPECT_EQ(b.intervals[0].renderer, a.renderer);
    }
  }
}

TEST(TaskPlan, IdentifiesInTheOrderOfVersion1) {
  for (const char* orientation :
       {R"("uniform")", R"("fixed")", "[[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 0, 1]]"})
    expect_equal_trials(identification(orientation));
}

TEST(TaskPlan, IdentifiesUnderTheLimitsOfVersion1) {
  SameStudy study = identification(R"("uniform")");
  study.one["order"] = {{"max_run", 2}};
  for (json& block : study.two["blocks"]) block["order"] = {{"max_run", 2}};
  expect_equal_trials(study);
}

TEST(TaskPlan, IdentifiesWithPracticeAndSeveralBlocksAsInVersion1) {
  SameStudy study = identification(R"("uniform")");
  study.one["repetitions"] = 10;
  study.one["blocks_per_renderer"] = 2;
  study.one["renderer_order"] = "fixed";
  study.one["practice"] = {{"repetitions", 2}};
  study.two["block_order"] = "fixed";
  json blocks = json::array();
  for (json& block : study.two["blocks"]) {
    json practice = block;
    practice["name"] = "practice-" + block["name"].get<std::string>();
    practice["practice"] = true;
    practice["repetitions"] = 2;
    blocks.push_back(practice);
    for (const char* part : {"-a", "-b"}) {
      json half = block;
      half["name"] = block["name"].get<std::string>() + part;
      blocks.push_back(half);
    }
  }
  study.two["blocks"] = blocks;
  expect_equal_trials(study);
}

TEST(TaskPlan, IdentifiesWithMixedRenderersAsInVersion1) {
  SameStudy study = identification(R"("uniform")");
  study.one["renderer_order"] = "interleaved";
  json mixed = study.two["blocks"][0];
  mixed["renderers"] = {"point", "ray"};
  study.two["blocks"] = json::array({mixed});
  expect_equal_trials(study);
}

TEST(TaskPlan, IdentifiesSomeOfTheStimuli) {
  SameStudy study = identification(R"("uniform")");
  json& block = study.two["blocks"][0];
  block["stimuli"] = {"cube", "sphere"};
  block["keys"] = {{"1", "sphere"}, {"3", "cube"}};
  std::map<int, int> shown;
  for (const Trial& trial : worked_off(TaskPlan(parsed(study.two), 1, 1))) {
    if (trial.task_block == 0) ++shown[trial.stimulus];
  }
  EXPECT_EQ(shown, (std::map<int, int>{{0, 5}, {2, 5}}));
}

TEST(Levels, VariesAnyNumberOfAStimulus) {
  const Protocol protocol = parsed(study());
  const StimulusSpec stiff = at_level(protocol, protocol.blocks[0], 0, 512.5);
  EXPECT_EQ(stiff.object.material.stiffness, 512.5);
  EXPECT_EQ(stiff.object.radius, 0.03);
  const StimulusSpec deep = at_level(protocol, protocol.blocks[2], 1, 0.0071);
  EXPECT_EQ(deep.object.material.layers.at(0).depth, 0.0071);
  EXPECT_EQ(deep.object.material.layers.at(0).stiffness, 300);
  EXPECT_EQ(own_level(protocol, protocol.blocks[0], 0), 300);
}

TEST(Levels, TurnsAboutAnAxisInDegrees) {
  json document = study();
  document["blocks"][0]["level"] = {{"path", "/orientation"}, {"axis", {0, 0, 2}}};
  const Protocol protocol = parsed(document);
  const Quat turned = at_level(protocol, protocol.blocks[0], 0, 90).object.pose.orientation;
  EXPECT_NEAR(turned.w, std::sqrt(0.5), 1e-15);
  EXPECT_NEAR(turned.z, std::sqrt(0.5), 1e-15);
}

TEST(Levels, HoldsEveryLevelThatABlockMayShow) {
  const Protocol protocol = parsed(study());
  const Protocol all = with_all_levels(protocol);
  std::set<std::string> names;
  for (const StimulusSpec& stimulus : all.stimuli) EXPECT_TRUE(names.insert(stimulus.name).second);
  for (const char* name : {"soft", "lump", "soft at 200", "soft at 400", "soft at 400 (stairs)",
                           "soft at 600", "lump at 0.008"})
    EXPECT_EQ(names.count(name), 1U) << name;
  EXPECT_EQ(
      with_all_levels(parse_protocol(PALPATE_SOURCE_DIR "/protocols/ho2000.json")).stimuli.size(),
      4U);
}

/// A block of practice, then one that counts.
Protocol practised(const char* criterion, int limit) {
  json document = study();
  json practice = json::parse(R"({"name": "try", "task": "identify", "stimuli": ["soft", "lump"],
    "renderers": ["ray"], "repetitions": 2})");
  practice["practice"] = {{"criterion", json::parse(criterion)}, {"limit", limit}};
  json counts = practice;
  counts["name"] = "main";
  counts.erase("practice");
  document["blocks"] = {practice, counts};
  return parsed(document);
}

/// Right or wrong as told, then right. \return  trials of practice
std::vector<Trial> practice_of(const Protocol& protocol, const std::string& answers) {
  TaskPlan plan(protocol, 1, 1);
  std::vector<Trial> shown;
  while (plan.next().practice) {
    const std::size_t at = shown.size();
    shown.push_back(plan.next());
    const char answer = at < answers.size() ? answers[at] : '1';
    plan.answered({answer == '1', answer == '1', answer != '-'});
    EXPECT_GE(plan.size(), plan.done());
  }
  EXPECT_EQ(plan.next().trial, static_cast<int>(shown.size()) + 1);
  EXPECT_TRUE(plan.block_begins());
  return shown;
}

TEST(Practice, IsOverOnceSoManyOfTheLastAnswersWereRight) {
  const Protocol protocol = practised(R"({"correct": 3, "of": 4})", 30);
  EXPECT_EQ(practice_of(protocol, "1111").size(), 4U);
  EXPECT_EQ(practice_of(protocol, "0111").size(), 4U);
  EXPECT_EQ(practice_of(protocol, "1010").size(), 6U);  // 1010 11: the last four have three
  EXPECT_EQ(practice_of(protocol, "11-0").size(), 7U);  // a time-out is no right answer
  EXPECT_EQ(practice_of(protocol, "0000000000").size(), 13U);
}

TEST(Practice, EndsAtItsLimitWhateverIsAnswered) {
  const Protocol protocol = practised(R"({"correct": 4, "of": 4})", 7);
  EXPECT_EQ(practice_of(protocol, "0000000000").size(), 7U);
  EXPECT_EQ(most_trials_of(protocol.blocks[0]), 7);
}

TEST(Practice, ComesAgainInRoundsOfAnOrderOfTheirOwn) {
  const Protocol protocol = practised(R"({"correct": 8, "of": 8})", 40);
  const std::vector<Trial> shown = practice_of(protocol, std::string(40, '0'));
  ASSERT_EQ(shown.size(), 40U);
  std::set<std::vector<int>> orders;
  for (std::size_t round = 0; round < 10; ++round) {
    std::vector<int> order;
    for (std::size_t i = 4 * round; i < 4 * round + 4; ++i) order.push_back(shown[i].stimulus);
    EXPECT_EQ(std::count(order.begin(), order.end(), 0), 2) << "each stimulus twice a round";
    orders.insert(order);
  }
  EXPECT_GE(orders.size(), 3U);
}

TEST(Practice, WithoutCriterionIsShownOnceAsBefore) {
  json document = study();
  document["blocks"][0]["practice"] = true;
  const Protocol protocol = parsed(document);
  EXPECT_EQ(practice_of(protocol, std::string(24, '0')).size(), 24U);
}

}  // namespace
}  // namespace palpate::protocols
