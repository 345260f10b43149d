// A plan written by hand as text, JSON and figure.

#include "analysis/report/plan_report.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "analysis/report/plan_record.h"
#include "analysis/statistics/plan.h"
#include "analysis/statistics/threshold_plan.h"
#include "protocols/parse.h"

namespace palpate::analysis {
namespace {
namespace plan_report {

/// Of each measure, as a plan that was made by hand.
ThresholdPlan a_plan_of(PlannedMeasure measure) {
  ThresholdPlan plan;
  plan.study.measure = measure;
  plan.study.effect = -0.25;
  plan.study.participant_sd = 0.75;
  plan.settings.trials = {42, 84};
  plan.settings.participants = {6, 12};
  plan.settings.studies = 100;
  for (const std::size_t trials : {42U, 84U}) {
    for (const std::size_t n : {6U, 12U}) {
      ThresholdPower& power = plan.powers.emplace_back();
      power.trials = trials;
      power.participants = n;
      power.studies = 100;
      power.power = trials == 84 && n == 12 ? 0.9 : 0.25;
    }
  }
  return plan;
}

TEST(PlanRecordTest, KeepsEachMeasure) {
  for (const PlannedMeasure measure :
       {PlannedMeasure::jnd, PlannedMeasure::pse, PlannedMeasure::threshold,
        PlannedMeasure::accuracy, PlannedMeasure::rating, PlannedMeasure::exponent,
        PlannedMeasure::deviation, PlannedMeasure::aftereffect, PlannedMeasure::adaptation}) {
    ThresholdPlan plan = a_plan_of(measure);
    if (measure == PlannedMeasure::rating) plan.study.bound = 0.5;
    if (measure == PlannedMeasure::adaptation) plan.study.contrast = PlannedContrast::groups;
    if (measure == PlannedMeasure::adaptation) plan.study.movement_sd = 0.3;
    const PlanRecord read = read_plan(threshold_plan_json(plan), "plan.json");
    ASSERT_NE(read.measure(), nullptr);
    EXPECT_EQ(read.times(), nullptr);
    EXPECT_EQ(read.measure()->measure, measure);
    EXPECT_EQ(read.measure()->effect, -0.25);
    EXPECT_EQ(read.measure()->participant_sd, 0.75);
    EXPECT_EQ(read.measure()->bound, plan.study.bound);
    EXPECT_EQ(read.measure()->contrast, plan.study.contrast);
    EXPECT_EQ(read.measure()->movement_sd, plan.study.movement_sd);
    ASSERT_NE(read.curve_for(84), nullptr);
    EXPECT_EQ(read.curve_for(84)->participants, 12U);
    EXPECT_EQ(read.curve_for(84)->power.at(6), 0.25);
    EXPECT_FALSE(read.curve_for(42)->participants);
    EXPECT_EQ(read.curve_for(43), nullptr);
  }
}

TEST(PlanRecordTest, NamesEveryFault) {
  auto json = nlohmann::json::parse(threshold_plan_json(a_plan_of(PlannedMeasure::jnd)));
  json["model"]["measure"] = "weight";
  json["model"]["lapse"] = 2;
  json["settings"]["alpha"] = 0;
  try {
    read_plan(json.dump(), "plan.json");
    FAIL() << "nothing is refused";
  } catch (const protocols::InputError& error) {
    EXPECT_EQ(error.faults().size(), 3U);
  }
}

PlanPoint point_of(std::size_t participants, std::size_t trials, std::vector<std::size_t> found,
                   std::size_t all, std::size_t any) {
  return {{participants, trials}, {1000, std::move(found), all, any}};
}

/// Effects on cone and cube; enough participants with 40 trials, not with 10.
Plan a_plan() {
  Plan plan;
  plan.model.shapes = {"cone", "plate", "cube"};
  plan.model.log_ratios = {std::log(0.78), 0, std::log(0.89)};
  plan.model.gain_sd = 0.125;
  plan.model.shape_gain_sd = 0.25;
  plan.model.intercept_sd = 0.375;
  plan.model.correlation = -0.5;
  plan.model.residual_sd = 0.625;
  plan.model.proportion_used = 0.875;
  plan.settings.trials = {10, 40};
  plan.settings.min_participants = 4;
  plan.settings.max_participants = 20;
  plan.settings.power = 0.8;
  plan.settings.simulation.studies = 1000;
  plan.settings.simulation.seed = 7;
  plan.notes = {"a note"};
  plan.curves.resize(2);
  plan.curves[0] = {
      10,
      {point_of(4, 10, {300, 40, 100}, 90, 330), point_of(20, 10, {700, 50, 400}, 310, 790)},
      {}};
  plan.curves[1] = {
      40,
      {point_of(4, 40, {500, 45, 300}, 200, 600), point_of(12, 40, {950, 48, 850}, 810, 990),
       point_of(20, 40, {990, 51, 970}, 960, 999)},
      point_of(12, 40, {950, 48, 850}, 810, 990)};
  return plan;
}

std::string unwrapped(const std::string& text) {
  std::istringstream words(text);
  std::string out;
  for (std::string word; words >> word;) out += (out.empty() ? "" : " ") + word;
  return out;
}

TEST(PlanText, SaysTheGoalAndHowManyAreEnough) {
  const std::string text = unwrapped(plan_text(a_plan()));
  const auto says = [&](const std::string& part) {
    EXPECT_NE(text.find(part), std::string::npos) << part << "\n" << text;
  };
  says(
      "To find the gain for cone (22.0 %) and cube (11.0 %), all of them, with power 80.0 % at "
      "alpha 0.050 (paired t-tests, Holm over 3 shapes):");
  says(
      "with 10 trials of each shape with each renderer 20 participants are not enough: power "
      "31.0 %.");
  says(
      "12 participants with 40 trials of each shape with each renderer (240 trials for each "
      "participant): power 81.0 %.");
  says("Power with 10 trials of each shape with each renderer (60 trials for each participant)");
  says(
      "participants' gains 0.125, additional gains for single shapes 0.250, single trials "
      "0.625; 87.5 % of the trials have a usable time. 1000 studies for each power (standard error "
      "of a "
      "power at most 1.6 %), seed 7.");
  says("Note: a note");
  Plan any = a_plan();
  any.settings.goal = Goal::any;
  any.settings.simulation.test = StudyTest::model;
  const std::string other = unwrapped(plan_text(any));
  EXPECT_NE(other.find("any of them, with power"), std::string::npos);
  EXPECT_NE(other.find("(the mixed model's contrasts, Holm"), std::string::npos);
  EXPECT_NE(other.find("power 99.0 %."), std::string::npos) << "of any";
}

TEST(PlanText, TablesHaveTheShapesWithAnEffectFirst) {
  std::istringstream lines(plan_text(a_plan()));
  std::vector<std::string> rows;
  for (std::string line; std::getline(lines, line);) {
    const std::string words = unwrapped(line);
    if (words.starts_with("participants ") || words.find(" % ") == std::string::npos) {
      if (words.starts_with("participants goal")) rows.push_back(words);
    } else if (line.starts_with("  ") && std::isdigit(words[0]) &&
               words.find("participants") == std::string::npos) {
      rows.push_back(words);
    }
  }
  EXPECT_EQ(rows, (std::vector<std::string>{
                      "participants goal cone cube plate", "4 9.0 % 30.0 % 10.0 % 4.0 %",
                      "20 31.0 % 70.0 % 40.0 % 5.0 %", "participants goal cone cube plate",
                      "4 20.0 % 50.0 % 30.0 % 4.5 %", "12 81.0 % 95.0 % 85.0 % 4.8 % <- enough",
                      "20 96.0 % 99.0 % 97.0 % 5.1 %"}));
}

TEST(PlanText, SplitsWideTables) {
  Plan plan = a_plan();
  plan.model.shapes.clear();
  plan.model.log_ratios.clear();
  for (int s = 0; s < 9; ++s) {
    plan.model.shapes.push_back("a shape of some length " + std::to_string(s));
    plan.model.log_ratios.push_back(-0.1);
  }
  for (PlanCurve& curve : plan.curves) {
    for (PlanPoint& point : curve.points) point.power.found.assign(9, 500);
  }
  std::istringstream lines(plan_text(plan));
  std::size_t continued = 0;
  for (std::string line; std::getline(lines, line);) {
    EXPECT_LE(line.size(), 100U) << line;
    continued += line.find("(continued)") != std::string::npos;
  }
  EXPECT_GT(continued, 0U);
  std::string text = plan_text(plan);
  for (int s = 0; s < 9; ++s) {
    EXPECT_NE(text.find("length " + std::to_string(s)), std::string::npos) << "in some table";
  }
}

TEST(PlanJson, HasEveryNumber) {
  const auto json = nlohmann::json::parse(plan_json(a_plan()));
  EXPECT_EQ(json["version"], 1);
  EXPECT_TRUE(json["pilot_label"].is_null());
  EXPECT_EQ(json["settings"], (nlohmann::json{{"power", 0.8},
                                              {"alpha", 0.05},
                                              {"goal", "all"},
                                              {"test", "paired"},
                                              {"studies", 1000},
                                              {"seed", 7},
                                              {"participants", {4, 20}}}));
  const auto& model = json["model"];
  EXPECT_NEAR(model["percent_reduction"]["cone"].get<double>(), 22, 1e-12);
  EXPECT_EQ(model["percent_reduction"]["plate"], 0);
  EXPECT_EQ(model["log_ratio"]["cube"], std::log(0.89));
  EXPECT_EQ(model["gain_sd"], 0.125);
  EXPECT_EQ(model["shape_gain_sd"], 0.25);
  EXPECT_EQ(model["intercept_sd"], 0.375);
  EXPECT_EQ(model["correlation"], -0.5);
  EXPECT_EQ(model["residual_sd"], 0.625);
  EXPECT_EQ(model["share_used"], 0.875);
  EXPECT_EQ(json["needed"][0]["status"], "undefined");
  EXPECT_FALSE(json["needed"][0]["reason"].get<std::string>().empty());
  EXPECT_TRUE(json["needed"][0]["participants"].is_null());
  EXPECT_EQ(json["needed"][1],
            (nlohmann::json{
                {"trials_per_cell", 40}, {"trials_per_participant", 240}, {"participants", 12}}));
  ASSERT_EQ(json["curves"][1]["points"].size(), 3U);
  EXPECT_EQ(json["curves"][1]["trials_per_cell"], 40);
  const auto& point = json["curves"][1]["points"][1];
  EXPECT_EQ(point["participants"], 12);
  EXPECT_EQ(point["trials_per_cell"], 40);
  EXPECT_EQ(point["power"], 0.81);
  EXPECT_EQ(point["power_all"], 0.81);
  EXPECT_EQ(point["power_any"], 0.99);
  EXPECT_EQ(point["power_by_shape"],
            (nlohmann::json{{"cone", 0.95}, {"plate", 0.048}, {"cube", 0.85}}));
  EXPECT_NEAR(point["simulation_se"].get<double>(), std::sqrt(0.81 * 0.19 / 1000), 1e-15);
  EXPECT_EQ(json["notes"], nlohmann::json{"a note"});
  Plan simulated = a_plan();
  simulated.label = "SIMULATED PARTICIPANTS";
  simulated.settings.goal = Goal::any;
  const auto other = nlohmann::json::parse(plan_json(simulated));
  EXPECT_EQ(other["pilot_label"], "SIMULATED PARTICIPANTS");
  EXPECT_EQ(other["settings"]["goal"], "any");
  EXPECT_EQ(other["curves"][1]["points"][1]["power"], 0.99);
}

TEST(PlanFigure, DrawsThePowerOfEveryPoint) {
  const Plan plan = a_plan();
  const Figure figure = plan_figure(plan);
  EXPECT_NE(figure.title.find("cone (22.0 %) and cube (11.0 %)"), std::string::npos);
  EXPECT_EQ(figure.label, "");
  ASSERT_EQ(figure.panels.size(), 1U);
  const Panel& panel = figure.panels[0];
  EXPECT_EQ(panel.y.title, "power (%)");
  EXPECT_EQ(panel.y.low, 0);
  EXPECT_EQ(panel.y.high, 100);
  EXPECT_EQ(panel.x.title, "participants");
  EXPECT_LE(panel.x.low, std::log10(4));
  EXPECT_GE(panel.x.high, std::log10(20));
  std::vector<std::string> ticks;
  for (const Tick& tick : panel.x.ticks) {
    ticks.push_back(tick.label);
    EXPECT_NEAR(std::pow(10, tick.at), std::stod(tick.label), 1e-9);
  }
  EXPECT_EQ(ticks, (std::vector<std::string>{"4", "5", "6", "8", "10", "12", "15", "20"}));
  std::vector<std::pair<double, double>> symbols;
  std::vector<Mark> lines, labels;
  for (const Mark& mark : panel.marks) {
    if (mark.kind == Mark::Kind::symbol) symbols.emplace_back(mark.x[0], mark.y[0]);
    if (mark.kind == Mark::Kind::line) lines.push_back(mark);
    if (mark.kind == Mark::Kind::label) labels.push_back(mark);
  }
  const std::vector<std::pair<double, double>> wanted{
      {4, 9}, {20, 31}, {4, 20}, {12, 81}, {20, 96}};
  ASSERT_EQ(symbols.size(), wanted.size());
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    EXPECT_NEAR(symbols[i].first, std::log10(wanted[i].first), 1e-12);
    EXPECT_NEAR(symbols[i].second, wanted[i].second, 1e-12);
  }
  ASSERT_EQ(lines.size(), 3U);
  EXPECT_TRUE(lines[0].dashed) << "the power that is wanted";
  EXPECT_EQ(lines[0].x, (std::vector<double>{panel.x.low, panel.x.high}));
  EXPECT_EQ(lines[0].y, (std::vector<double>{80, 80}));
  EXPECT_EQ(lines[1].x.size(), 2U);
  EXPECT_EQ(lines[2].x.size(), 3U);
  EXPECT_FALSE(lines[1].dashed);
  EXPECT_NE(lines[1].role, lines[2].role);
  ASSERT_EQ(labels.size(), 1U) << "of the curve that reaches it";
  EXPECT_EQ(labels[0].text, "12");
  EXPECT_NEAR(labels[0].x[0], std::log10(12), 1e-12);
  EXPECT_NEAR(labels[0].y[0], 81, 1e-12);
  ASSERT_EQ(figure.legend.size(), 2U);
  EXPECT_EQ(figure.legend[0].label, "10 trials");
  EXPECT_EQ(figure.legend[1].label, "40 trials");
  EXPECT_EQ(figure.legend[1].role, lines[2].role);
  EXPECT_NE(figure.legend[0].shape, figure.legend[1].shape);
  EXPECT_NE(figure.description.find("10 trials of each shape with each renderer: not enough."),
            std::string::npos);
  EXPECT_NE(figure.description.find("12 participants are enough."), std::string::npos);
}

TEST(PlanFigure, HasAxesForOneNumberAndManyDecades) {
  Plan plan = a_plan();
  plan.label = "SIMULATED PARTICIPANTS";
  plan.settings.min_participants = plan.settings.max_participants = 8;
  const Figure one = plan_figure(plan);
  EXPECT_LT(one.panels[0].x.low, std::log10(8));
  EXPECT_GT(one.panels[0].x.high, std::log10(8));
  EXPECT_EQ(one.label, "SIMULATED PARTICIPANTS IN THE PILOT");
  plan.settings.min_participants = 2;
  plan.settings.max_participants = 10'000;
  const Figure many = plan_figure(plan);
  for (const Tick& tick : many.panels[0].x.ticks) {
    EXPECT_NEAR(std::pow(10, tick.at), std::stod(tick.label), 1e-9 * std::stod(tick.label));
  }
  EXPECT_EQ(many.panels[0].x.ticks.back().label, "10000");
}

}  // namespace plan_report
}  // namespace
}  // namespace palpate::analysis
