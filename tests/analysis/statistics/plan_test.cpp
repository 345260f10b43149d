// Power against R's noncentral t; search for the number of participants; estimates from a pilot.

#include "analysis/statistics/plan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "analysis/figures/svg.h"
#include "analysis/input/trials.h"
#include "analysis/report/plan_record.h"
#include "analysis/report/plan_report.h"
#include "analysis/statistics/analysis.h"
#include "analysis/statistics/pilot.h"
#include "analysis/statistics/power.h"
#include "data/base/random.h"

namespace palpate::analysis {
namespace {

StudyModel model_of(double gain_sd, double shape_gain_sd, double residual_sd,
                    std::vector<double> log_ratios) {
  StudyModel model;
  for (std::size_t s = 0; s < log_ratios.size(); ++s) {
    model.shapes.push_back("shape" + std::to_string(s));
  }
  model.log_ratios = std::move(log_ratios);
  model.gain_sd = gain_sd;
  model.shape_gain_sd = shape_gain_sd;
  model.residual_sd = residual_sd;
  model.intercept_sd = 0.3;
  return model;
}

PowerSettings settings_of(std::size_t studies) {
  PowerSettings settings;
  settings.studies = studies;
  return settings;
}

TEST(Power, OneShapeEqualsTheTTest) {
  // R: power.t.test(n, delta, sd, type = "one.sample", strict = TRUE); sd^2 = gain_sd^2 +
  // shape_gain_sd^2 + 2 residual_sd^2 / trials.
  const Power first =
      simulate_power(model_of(0.15, 0.1, 0.4, {-0.25}), {10, 20}, settings_of(20'000));
  EXPECT_NEAR(first.proportion(first.found[0]), 0.890255, 0.01);
  EXPECT_EQ(first.all, first.found[0]);
  EXPECT_EQ(first.any, first.found[0]);
  const Power second = simulate_power(model_of(0.2, 0, 0.5, {0.12}), {6, 76}, settings_of(20'000));
  EXPECT_NEAR(second.proportion(second.found[0]), 0.199626, 0.01);
}

TEST(Power, TellsProgressUpToTheLastStudy) {
  std::vector<std::size_t> told;
  PowerSettings settings = settings_of(1'000);
  settings.progress = [&](std::size_t done) { told.push_back(done); };
  const Power power = simulate_power(model_of(0.1, 0.1, 0.4, {0.2}), {4, 4}, settings);
  EXPECT_EQ(power.studies, 1'000U);
  ASSERT_FALSE(told.empty());
  EXPECT_TRUE(std::ranges::is_sorted(told));
  EXPECT_GT(told.front(), 0U);
  EXPECT_EQ(told.back(), 1'000U);
}

TEST(Power, FamilyErrsAtRateAlphaWithoutEffects) {
  const Power power =
      simulate_power(model_of(0, 0.2, 0.4, {0, 0, 0, 0}), {8, 10}, settings_of(20'000));
  double sum = 0;
  for (const std::size_t found : power.found) sum += power.proportion(found);
  EXPECT_LT(sum, 0.06);
  EXPECT_GT(sum, 0.04);
  EXPECT_EQ(power.all, 0U);
  EXPECT_EQ(power.any, 0U);
}

TEST(Power, TrialsWithoutATimeDoNotCount) {
  StudyModel model = model_of(0, 0, 0.4, {-0.1});
  const Power half = simulate_power(model, {10, 40}, settings_of(20'000));
  model.proportion_used = 0.5;
  const Power used = simulate_power(model, {10, 80}, settings_of(20'000));
  EXPECT_NEAR(used.proportion(used.any), half.proportion(half.any), 0.02);
  EXPECT_GT(half.proportion(half.any), 0.3);
  EXPECT_LT(half.proportion(half.any), 0.9);
}

TEST(Power, IsTheSameWhateverTheJobs) {
  for (const StudyTest test : {StudyTest::paired, StudyTest::model}) {
    PowerSettings settings = settings_of(130);
    settings.test = test;
    const StudyModel model = model_of(0.1, 0.1, 0.4, {-0.2, 0, -0.1});
    const Power one = simulate_power(model, {6, 8}, settings);
    settings.jobs = 3;
    const Power three = simulate_power(model, {6, 8}, settings);
    EXPECT_EQ(one.found, three.found);
    EXPECT_EQ(one.all, three.all);
    EXPECT_EQ(one.any, three.any);
    EXPECT_GT(one.any, 0U);
  }
}

TEST(Power, ModelEqualsPairedTestsWithoutExtraVariance) {
  const StudyModel model = model_of(0.1, 0, 0.4, {-0.25, -0.25});
  PowerSettings settings = settings_of(300);
  const Power paired = simulate_power(model, {12, 20}, settings);
  settings.test = StudyTest::model;
  const Power fitted = simulate_power(model, {12, 20}, settings);
  // The model pools residual variance over shapes: somewhat more power.
  EXPECT_GT(fitted.proportion(fitted.any), paired.proportion(paired.any) - 0.05);
  EXPECT_LT(fitted.proportion(fitted.any), paired.proportion(paired.any) + 0.2);
}

TEST(Power, TwoParticipantsWithoutVarianceFindNothing) {
  const Power power = simulate_power(model_of(0, 0, 0, {-0.2}), {2, 4}, settings_of(100));
  EXPECT_EQ(power.any, 0U);
}

TEST(Plan, FindsTheFewestParticipants) {
  PlanSettings settings;
  settings.trials = {5, 40};
  settings.min_participants = 2;
  settings.max_participants = 60;
  settings.simulation = settings_of(1000);
  const Plan plan = make_plan(model_of(0.15, 0.05, 0.4, {-0.2, -0.15}), settings, {}, {});
  ASSERT_EQ(plan.curves.size(), 2U);
  for (const PlanCurve& curve : plan.curves) {
    ASSERT_TRUE(curve.smallest);
    EXPECT_GE(goal_power(plan, curve.smallest->power), 0.8);
    const std::size_t fewest = curve.smallest->design.participants;
    bool one_less = false;
    for (const PlanPoint& point : curve.points) {
      if (point.design.participants < fewest) {
        EXPECT_LT(goal_power(plan, point.power), 0.8);
      }
      one_less = one_less || point.design.participants + 1 == fewest;
    }
    EXPECT_TRUE(one_less);
  }
  EXPECT_LT(plan.curves[1].smallest->design.participants,
            plan.curves[0].smallest->design.participants);
  const auto json = nlohmann::json::parse(plan_json(plan));
  EXPECT_EQ(json["needed"][1]["participants"], plan.curves[1].smallest->design.participants);
  EXPECT_EQ(json["needed"][1]["trials_per_participant"], 160);
  // The row of the fewest participants, and no other, is marked in each curve's table.
  std::istringstream lines(plan_text(plan));
  std::vector<std::size_t> enough;
  for (std::string line; std::getline(lines, line);) {
    if (line.ends_with("<- enough")) enough.push_back(std::stoul(line));
  }
  EXPECT_EQ(enough, (std::vector{plan.curves[0].smallest->design.participants,
                                 plan.curves[1].smallest->design.participants}));
  EXPECT_NE(figure_svg(plan_figure(plan), light_palette()).find("</svg>"), std::string::npos);
}

TEST(Plan, SaysWhereTheRangeIsTooSmall) {
  PlanSettings settings;
  settings.trials = {2};
  settings.min_participants = settings.max_participants = 2;
  settings.simulation = settings_of(200);
  const Plan plan = make_plan(model_of(0.3, 0, 0.4, {-0.01}), settings, {}, {});
  EXPECT_FALSE(plan.curves[0].smallest);
  EXPECT_NE(plan_text(plan).find("not enough"), std::string::npos);
  const auto json = nlohmann::json::parse(plan_json(plan));
  EXPECT_TRUE(json["needed"][0]["participants"].is_null());
  EXPECT_EQ(json["needed"][0]["status"], "undefined");
  EXPECT_EQ(figure_svg(plan_figure(plan), light_palette()).find("nan"), std::string::npos);
}

/// A study of 60 participants with the sds given.
Analysis pilot_study(double gain_sd, double shape_gain_sd, double residual_sd, std::uint64_t seed) {
  TrialTableBuilder builder;
  Random random(seed);
  for (int p = 0; p < 60; ++p) {
    const std::string name = std::to_string(p);
    const double intercept = 0.3 * random.normal(), gain = gain_sd * random.normal();
    int trial = 0;
    for (const std::string shape : {"sphere", "cone", "cylinder", "cube"}) {
      const double own = shape_gain_sd * random.normal();
      for (const std::string renderer : {"point", "ray"}) {
        for (int i = 0; i < 15; ++i) {
          StudyTrial raw;
          raw.participant = name;
          raw.renderer = renderer;
          raw.shape = raw.response = shape;
          raw.trial = ++trial;
          raw.correct = i > 0;
          if (i == 0) raw.response = "other";
          raw.response_time = std::exp(2 + intercept + (renderer == "ray" ? gain + own - 0.2 : 0) +
                                       residual_sd * random.normal());
          builder.add(raw);
        }
      }
    }
  }
  return analyze(builder.finish({}), {}, "test");
}

TEST(Pilot, GivesBackWhatItWasDrawnFrom) {
  constexpr int kPilots = 10;
  double gain = 0, shape_gain = 0, plain_gain = 0;  // mean variances
  for (std::uint64_t seed = 1; seed <= kPilots; ++seed) {
    const Pilot pilot = read_pilot(pilot_study(0.2, 0.25, 0.3, seed));
    ASSERT_EQ(pilot.undefined, "");
    gain += pilot.model.gain_sd * pilot.model.gain_sd / kPilots;
    shape_gain += pilot.model.shape_gain_sd * pilot.model.shape_gain_sd / kPilots;
    EXPECT_NEAR(pilot.model.residual_sd, 0.3, 0.02);
    EXPECT_NEAR(pilot.model.proportion_used, 14.0 / 15, 1e-12);
    const Pilot plain = read_pilot(pilot_study(0.2, 0, 0.3, seed));
    EXPECT_LT(plain.model.shape_gain_sd, 0.06);
    plain_gain += plain.model.gain_sd * plain.model.gain_sd / kPilots;
  }
  EXPECT_NEAR(std::sqrt(gain), 0.2, 0.02);
  EXPECT_NEAR(std::sqrt(shape_gain), 0.25, 0.02);
  EXPECT_NEAR(std::sqrt(plain_gain), 0.2, 0.02);
}

/// Eight participants with participant x shape gains and equal residuals in all cells; with
/// `one_more` a ninth without times in one cell.
Analysis uneven_pilot(bool one_more, const std::string& missing_with = "ray") {
  TrialTableBuilder builder;
  constexpr std::uint64_t kSeed = 17;
  Random random(kSeed);
  for (int p = 0; p < (one_more ? 9 : 8); ++p) {
    int trial = 0;
    const std::string name = std::to_string(p);
    const double gain = 0.1 * random.normal();
    for (const std::string shape : {"sphere", "cone", "cube"}) {
      const double own = 0.3 * random.normal();
      for (const std::string renderer : {"point", "ray"}) {
        const bool empty = p == 8 && shape == "cone" && renderer == missing_with;
        const std::string response = empty ? "other" : shape;
        for (int i = 0; i < 6; ++i) {
          StudyTrial raw;
          raw.participant = name;
          raw.renderer = renderer;
          raw.shape = shape;
          raw.response = response;
          raw.trial = ++trial;
          raw.correct = !empty;
          raw.response_time = std::exp(2 + (renderer == "ray" ? gain + own : 0) + 0.02 * (i - 2.5));
          builder.add(raw);
        }
      }
    }
  }
  return analyze(builder.finish({}), {}, "test");
}

// A participant without a cell has no gain for that shape and does not enter the variance of gains.
TEST(Pilot, GainsOfShapesUseParticipantsWithEveryCell) {
  const Pilot complete = read_pilot(uneven_pilot(false));
  ASSERT_EQ(complete.undefined, "");
  EXPECT_GT(complete.model.shape_gain_sd, 0.1);
  for (const char* renderer : {"point", "ray"}) {
    const Pilot more = read_pilot(uneven_pilot(true, renderer));
    ASSERT_EQ(more.undefined, "");
    EXPECT_NEAR(more.model.shape_gain_sd, complete.model.shape_gain_sd, 1e-12) << renderer;
    EXPECT_NEAR(more.model.residual_sd, complete.model.residual_sd, 1e-12) << renderer;
  }
}

}  // namespace
}  // namespace palpate::analysis
