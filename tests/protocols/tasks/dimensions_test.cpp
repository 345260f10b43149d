// Levels of several dimensions: which stimuli have which numbers, and what follows from answers.

#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>

#include "protocols/parse.h"
#include "protocols/session_plan.h"
#include "protocols/tasks/block_order.h"
#include "protocols/tasks/block_procedures.h"
#include "protocols/tasks/levels.h"

namespace palpate::protocols {
namespace {
namespace dimensions_by_hand {

using nlohmann::json;

const json kStandard{{"name", "reference"}, {"path", "/stiffness_n_per_m"}, {"of", "standard"}};
const json kComparison{{"name", "stiffness"}, {"path", "/stiffness_n_per_m"}};
const json kFriction{{"name", "friction"}, {"path", "/friction_static"}, {"of", "both"}};

json study(const json& dimensions, const json& procedure, const json& more = json::object()) {
  json block{{"name", "pairs"},
             {"task", "compare"},
             {"stimuli", {"comparison"}},
             {"standard", "standard"},
             {"level", {{"dimensions", dimensions}}},
             {"procedure", procedure}};
  block.update(more);
  const json ball{{"shape", "sphere"},
                  {"radius_m", 0.03},
                  {"stiffness_n_per_m", 300},
                  {"friction_static", 0.3},
                  {"friction_dynamic", 0.1}};
  json standard = ball, comparison = ball;
  standard["name"] = "standard";
  comparison["name"] = "comparison";
  return {{"version", 2},           {"name", "field"},   {"seed", 3},
          {"renderers", {"point"}}, {"blocks", {block}}, {"stimuli", {standard, comparison}}};
}

Protocol parsed_study(const json& text) { return parse_protocol_text(text.dump(), "p.json"); }

json constant(const json& levels) {
  return {{"kind", "constant"}, {"levels", levels}, {"repetitions", 3}};
}

json weber(int trials) {
  return {{"kind", "quest_plus"},
          {"function", {{"form", "weber"}}},
          {"grid",
           {{"reference", {200, 400}}, {"stiffness", {{"from", 120}, {"to", 600}, {"count", 9}}}}},
          {"w", {0.05, 0.1, 0.2}},
          {"c", {0, 60}},
          {"stop", {{"trials", trials}}}};
}

TEST(Dimensions, EveryPointIsShownEquallyOften) {
  const Protocol protocol =
      parsed_study(study({kStandard, kComparison}, constant({{200, 150}, {200, 260}, {400, 420}})));
  std::map<LevelPoint, int> shown;
  for (SessionPlan plan(protocol, 1, 1); !plan.finished(); plan.answered({true, true, true})) {
    const Trial& trial = plan.next();
    ++shown[trial.point];
    EXPECT_FALSE(trial.level.has_value());
    ASSERT_EQ(trial.intervals.size(), 2u);
    for (const Interval& interval : trial.intervals) EXPECT_EQ(interval.point, trial.point);
  }
  EXPECT_EQ(shown, (std::map<LevelPoint, int>{{{200, 150}, 3}, {{200, 260}, 3}, {{400, 420}, 3}}));
}

TEST(Dimensions, SetTheNumbersOfTheirOwnStimuli) {
  const Protocol protocol = parsed_study(
      study({kStandard, kComparison, kFriction}, constant({{200, 150, 0.2}, {400, 500, 0.25}})));
  const TaskBlock& block = protocol.blocks.front();
  const LevelPoint point{200, 150, 0.2};
  const StimulusSpec standard = at_point(protocol, block, 0, point, true);
  const StimulusSpec comparison = at_point(protocol, block, 1, point, false);
  EXPECT_EQ(standard.object.material.stiffness, 200);
  EXPECT_EQ(comparison.object.material.stiffness, 150);
  EXPECT_EQ(standard.object.material.friction_static, 0.2);
  EXPECT_EQ(comparison.object.material.friction_static, 0.2);
  EXPECT_EQ(standard.name, "standard at reference 200, friction 0.2");
  EXPECT_EQ(comparison.name, "comparison at stiffness 150, friction 0.2");
  EXPECT_EQ(point_text(block, point), "reference 200, stiffness 150, friction 0.2");
}

TEST(Dimensions, AllStimuliOfAllPointsAreChecked) {
  const Protocol protocol = parsed_study(study({kStandard, kComparison}, weber(5)));
  std::set<std::string> names;
  for (const StimulusSpec& stimulus : with_all_levels(protocol).stimuli)
    names.insert(stimulus.name);
  // Two plain ones, two standards, nine comparisons.
  EXPECT_EQ(names.size(), 13u);
  EXPECT_TRUE(names.contains("standard at reference 400"));
  EXPECT_TRUE(names.contains("comparison at stiffness 600"));
}

TEST(Dimensions, TheJudgedValueIsOfTheSamePath) {
  const Protocol protocol =
      parsed_study(study({kComparison, kFriction}, constant({{350, 0.2}, {250, 0.2}})));
  const TaskBlock& block = protocol.blocks.front();
  EXPECT_EQ(judged_dimension(block).name, "stiffness");
  Interval interval{1, RendererKind::point, std::nullopt, false, {350, 0.2}};
  EXPECT_EQ(judged_value(protocol, block, interval), 350);
  interval.stimulus = 0;
  interval.standard = true;
  EXPECT_EQ(judged_value(protocol, block, interval), 300);  // its own
}

TEST(Dimensions, RangesAreOfAllProcedures) {
  const json asked{
      {"kind", "ask"},
      {"ranges",
       {{"reference", {{"min", 100}, {"max", 300}}}, {"stiffness", {{"min", 50}, {"max", 700}}}}},
      {"stop", {{"trials", 5}}}};
  const Protocol protocol = parsed_study(study({kStandard, kComparison}, {weber(5), asked}));
  const std::vector<DimensionRange> ranges = ranges_of(protocol.blocks.front());
  EXPECT_EQ(ranges[0].min, 100);
  EXPECT_EQ(ranges[0].max, 400);
  EXPECT_EQ(ranges[1].min, 50);
  EXPECT_EQ(ranges[1].max, 700);
  EXPECT_EQ(block_that_asks(protocol), &protocol.blocks.front());
}

/// The point of each trial, with answers that depend on their numbers alone.
std::vector<LevelPoint> points_of(SessionPlan plan) {
  std::vector<LevelPoint> points;
  for (int i = 0; !plan.finished(); ++i) {
    points.push_back(plan.next().point);
    plan.answered({i % 3 != 0, i % 3 != 0, i % 7 != 6});
  }
  return points;
}

TEST(Dimensions, ASessionGoesOnFromItsAnswers) {
  const Protocol protocol = parsed_study(study({kStandard, kComparison}, weber(12)));
  const SessionPlan whole(protocol, 2, 1);
  const std::vector<LevelPoint> all = points_of(whole);
  ASSERT_GE(all.size(), 12u);
  for (std::size_t done = 0; done < all.size(); ++done) {
    SessionPlan resumed(protocol, 2, 1);
    for (std::size_t i = 0; i < done; ++i) {
      TrialOutcome outcome{i % 3 != 0, i % 3 != 0, i % 7 != 6};
      outcome.point = all[i];
      outcome.block = 1;
      resumed.answered(outcome);
    }
    EXPECT_EQ(resumed.next().point, all[done]) << done;
  }
}

TEST(Dimensions, ProposedPointsAreShownAndCount) {
  const Protocol protocol = parsed_study(study({kStandard, kComparison}, weber(12)));
  SessionPlan plan(protocol, 1, 1);
  plan.propose(LevelPoint{222, 333});
  for (const Interval& interval : plan.next().intervals)
    EXPECT_EQ(interval.point, (LevelPoint{222, 333}));
  plan.answered({true, true, true});
  EXPECT_EQ(plan.tracks()->tracks().front().history().back().point, (LevelPoint{222, 333}));
}

TEST(Dimensions, AProgramMayEndABlock) {
  json text = study({kStandard, kComparison}, weber(12));
  text["blocks"].push_back(text["blocks"][0]);
  text["blocks"][1]["name"] = "later";
  const Protocol protocol = parsed_study(text);
  SessionPlan plan(protocol, 1, 1);
  plan.answered({true, true, true});
  plan.end_block();
  EXPECT_EQ(plan.block().name, "later");
  EXPECT_EQ(plan.next().trial, 2);
  const Trial after = plan.next();
  // The record of the later block says that the first had ended.
  SessionPlan resumed(protocol, 1, 1);
  TrialOutcome outcome{true, true, true};
  outcome.block = 1;
  resumed.answered(outcome);
  outcome.block = 2;
  resumed.answered(outcome);
  plan.answered(outcome);
  EXPECT_EQ(resumed.next().point, plan.next().point);
  EXPECT_EQ(resumed.next().block, after.block);
  resumed.end_block();
  EXPECT_TRUE(resumed.finished());
}

TEST(Dimensions, CatchTrialsHaveNoPoint) {
  json text = study({{{"name", "stiffness"}, {"path", "/stiffness_n_per_m"}},
                     {{"name", "friction"}, {"path", "/friction_static"}}},
                    constant({{350, 0.2}, {400, 0.25}}));
  text["blocks"][0].erase("standard");
  text["blocks"][0]["task"] = "detect";
  text["blocks"][0]["catch_trials"] = 0.25;
  const Protocol protocol = parsed_study(text);
  int catches = 0;
  for (SessionPlan plan(protocol, 1, 1); !plan.finished(); plan.answered({true, true, true})) {
    catches += plan.next().catch_trial ? 1 : 0;
    EXPECT_EQ(plan.next().point.empty(), plan.next().catch_trial);
    EXPECT_EQ(plan.next().intervals[0].point, plan.next().point);
  }
  EXPECT_EQ(catches, 2);
}

TEST(Dimensions, OldStudiesKeepTheirProcedures) {
  const json text = study({kStandard, kComparison}, weber(12));
  const auto blocks = procedures_of_blocks(text.dump(), "p.json");
  ASSERT_EQ(blocks.at("pairs").dimensions.size(), 2u);
  EXPECT_EQ(blocks.at("pairs").dimensions[1].name, "stiffness");
  const Protocol protocol = parsed_study(text);
  Procedure track = blocks.at("pairs").begin(2, 1);
  EXPECT_EQ(track.next_point(), SessionPlan(protocol, 2, 1).next().point);
}

}  // namespace dimensions_by_hand
}  // namespace
}  // namespace palpate::protocols
