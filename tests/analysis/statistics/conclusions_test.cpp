// Warnings, the conclusion, excluded participants, and the tests that a plan simulates.

#include "analysis/statistics/conclusions.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "analysis/input/trials.h"
#include "analysis/statistics/analysis.h"
#include "analysis/statistics/pilot.h"
#include "analysis/statistics/plan.h"
#include "analysis/statistics/power.h"

namespace palpate::analysis {
namespace {

/// Modifies a trial, by default a correct answer after 5 s; returns false to leave it out.
using Change = std::function<bool(int participant, int repetition, StudyTrial& trial)>;

/// Sphere and cone with both renderers, point first, shapes alternating.
Analysis analysis_with(int participants, int repetitions, const Change& change) {
  TrialTableBuilder builder;
  for (int p = 0; p < participants; ++p) {
    int number = 0;
    for (const std::string renderer : {"point", "ray"}) {
      for (int i = 0; i < repetitions; ++i) {
        for (const std::string shape : {"sphere", "cone"}) {
          StudyTrial raw;
          const std::string name = "P" + std::to_string(p);
          raw.participant = name;
          raw.renderer = renderer;
          raw.shape = raw.response = shape;
          raw.trial = ++number;
          raw.correct = true;
          raw.response_time = 5;
          if (change(p, i, raw)) builder.add(raw);
        }
      }
    }
  }
  return analyze(builder.finish({}), {}, "test");
}

bool warns(const Analysis& analysis, const std::string& of) {
  return std::any_of(
      analysis.warnings.begin(), analysis.warnings.end(),
      [&](const std::string& warning) { return warning.find(of) != std::string::npos; });
}

void answer_wrongly(StudyTrial& trial) {
  trial.response = trial.shape == "cone" ? "sphere" : "cone";
  trial.correct = false;
}

TEST(Exclusions, AreCountedByTheirReason) {
  const Analysis analysis = analysis_with(2, 10, [](int, int i, StudyTrial& trial) {
    if (trial.renderer == "point" || trial.shape == "sphere") return true;
    if (i < 2) answer_wrongly(trial);
    if (i == 1 || i == 2) trial.response_time = 0.1;  // a wrong and a correct one
    if (i >= 7) {
      trial.response = "";
      trial.timed_out = true;
      trial.correct = false;
    }
    return true;
  });
  const Exclusions& ray = analysis.exclusions[1];
  EXPECT_EQ(ray.n_trials, 40U);
  EXPECT_EQ(ray.n_wrong, 4U);
  EXPECT_EQ(ray.n_too_fast, 2U) << "the wrong one is among the wrong";
  EXPECT_EQ(ray.n_timeouts, 6U);
  EXPECT_EQ(ray.n_used, 28U);
  EXPECT_EQ(analysis.exclusions[0].n_used, 40U);
}

TEST(Exclusions, AboveTenPercentAreWarnedOf) {
  const auto with_wrong = [](int of_25) {
    return analysis_with(2, 50, [=](int, int i, StudyTrial& trial) {
      if (i % 25 < of_25) answer_wrongly(trial);
      return true;
    });
  };
  EXPECT_TRUE(warns(with_wrong(3), "12.0 % of the trials with point are excluded from the times"));
  EXPECT_TRUE(warns(with_wrong(3), "12.0 % of the trials with ray are excluded from the times"));
  EXPECT_FALSE(warns(with_wrong(2), "are excluded from the times (wrong"));
  const Analysis limit = analysis_with(2, 10, [](int, int i, StudyTrial& trial) {
    if (i == 0) answer_wrongly(trial);
    return true;
  });
  EXPECT_FALSE(warns(limit, "are excluded from the times (wrong")) << "10 % itself";
}

TEST(Exclusions, ThatDifferAreWarnedOfWhicheverHasMore) {
  for (const char* more : {"point", "ray"}) {
    const Analysis analysis = analysis_with(2, 20, [&](int, int i, StudyTrial& trial) {
      if (trial.renderer == more && i < 2) answer_wrongly(trial);
      return true;
    });
    EXPECT_TRUE(warns(analysis, "Exclusions differ between renderers")) << more;
  }
  const Analysis equal = analysis_with(2, 20, [&](int, int i, StudyTrial& trial) {
    if (i < 2) answer_wrongly(trial);
    return true;
  });
  EXPECT_FALSE(warns(equal, "Exclusions differ"));
}

TEST(DroppedParticipant, AreNamedWithTheRendererThatIsMissing) {
  const Analysis analysis = analysis_with(4, 3, [](int p, int, StudyTrial& trial) {
    return (p != 1 || trial.renderer == "ray") && (p != 2 || trial.renderer == "point");
  });
  for (const PairedShape& shape : analysis.comparisons[0].shapes) {
    ASSERT_EQ(shape.dropped.size(), 2U);
    EXPECT_EQ(shape.dropped[0].renderers, std::vector<std::string>{"point"});
    EXPECT_EQ(shape.dropped[1].renderers, std::vector<std::string>{"ray"});
    EXPECT_EQ(shape.n_pairs, 2U);
  }
  EXPECT_TRUE(warns(analysis, "P1 (point: every shape) and P2 (ray: every shape)"));
}

TEST(Anova, IsUndefinedWhereEveryEffectIs) {
  // Effects are equal in all participants: the denominator of F is 0.
  const Analysis flat = analysis_with(4, 2, [](int p, int, StudyTrial& trial) {
    trial.response_time = std::exp(1 + 0.3 * p + (trial.renderer == "ray" ? -0.2 : 0) +
                                   (trial.shape == "cone" ? 0.5 : 0));
    return true;
  });
  EXPECT_NE(flat.rm_anova.undefined, "");
  for (const AnovaEffect& effect : flat.rm_anova.effects) {
    EXPECT_NE(effect.undefined, "") << effect.name;
    EXPECT_FALSE(effect.generalized_eta_squared.has_value()) << effect.name;
  }
  // A single effect without variance does not affect the others.
  const Analysis one = analysis_with(4, 2, [](int p, int, StudyTrial& trial) {
    trial.response_time =
        std::exp(1 + (trial.renderer == "ray" ? -0.2 : 0) + (trial.shape == "cone" ? 0.1 * p : 0));
    return true;
  });
  EXPECT_EQ(one.rm_anova.undefined, "");
  EXPECT_NE(one.rm_anova.effects[0].undefined, "");
  EXPECT_TRUE(one.rm_anova.effects[0].generalized_eta_squared.has_value());
  EXPECT_EQ(one.rm_anova.effects[1].undefined, "");
}

/// Cones with the point take 40 s and more, with time-outs at 60 s: their number by participant.
Analysis with_time_outs(const std::vector<int>& timed_out) {
  return analysis_with(
      static_cast<int>(timed_out.size()), 20, [&](int p, int i, StudyTrial& trial) {
        trial.response_time = std::exp(2 + 0.05 * p + 0.3 * std::sin(3.7 * i + p) +
                                       (trial.renderer == "ray" ? 0.1 * (p % 2) : 0));
        if (trial.shape == "cone" && trial.renderer == "point") {
          *trial.response_time *= 3;
          if (i < timed_out[static_cast<std::size_t>(p)]) {
            trial.response_time = 60;
            trial.response = "";
            trial.timed_out = true;
            trial.correct = false;
          }
        }
        return true;
      });
}

TEST(TimeOuts, AreSaidOfTheCellThatHasThem) {
  const Analysis analysis = with_time_outs({0, 1, 6, 0});
  const TimeOutCell& cone = analysis.time_outs.cells[0][1];
  EXPECT_EQ(cone.n_trials, 80U);
  EXPECT_EQ(cone.n_timeouts, 7U);
  EXPECT_EQ(cone.most_affected, 2U);
  EXPECT_DOUBLE_EQ(cone.largest_proportion, 0.3);
  EXPECT_EQ(cone.lowest_limit, 60);
  EXPECT_EQ(cone.highest_limit, 60);
  EXPECT_EQ(analysis.time_outs.cells[0][0].n_timeouts, 0U);
  // 7 of 160 trials with the point, 4.4 %: too few over all shapes for a warning.
  EXPECT_FALSE(warns(analysis, "are excluded from the times (wrong"));
  EXPECT_TRUE(warns(analysis, "cone 8.8 % with the point (30.0 % in P2) and 0.0 % with the ray"));
  EXPECT_FALSE(warns(analysis, "sphere 0.0 %"));
  ASSERT_EQ(analysis.comparisons[0].censored.size(), 2U);
  EXPECT_EQ(analysis.comparisons[0].censored[1].n_censored, 7U);
  EXPECT_LT(*analysis.comparisons[0].censored[1].log_ratio,
            *analysis.comparisons[0].shapes[1].mean_log_ratio);
  EXPECT_NEAR(*analysis.comparisons[0].censored[0].log_ratio,
              *analysis.comparisons[0].shapes[0].mean_log_ratio, 1e-9)
      << "no time-outs with a sphere";
  EXPECT_TRUE(with_time_outs({0, 0, 0, 0}).comparisons[0].censored.empty());
  EXPECT_FALSE(warns(with_time_outs({1, 0, 0, 0}), "Time-outs")) << "1.3 % in one cell";
}

TEST(Answer, GoesByHolmsP) {
  Analysis analysis;
  analysis.table.shapes = {"sphere", "cone"};
  Comparison& comparison = analysis.comparisons.emplace_back();
  comparison.pair = {"point", "ray", 0, 1};
  comparison.shapes.resize(2);
  for (PairedShape& shape : comparison.shapes) {
    shape.mean_log_ratio = -0.2;
    shape.percent_reduction_geometric = percent_reduction(-0.2);
    shape.t_test.p = 0.03;
    shape.t_test.p_holm = 0.06;
  }
  EXPECT_EQ(conclusion(analysis), "No clear difference between ray and point for sphere and cone.");
  comparison.shapes[1].t_test.p_holm = 0.04;
  EXPECT_EQ(conclusion(analysis),
            "The ray is faster than the point for cone (18 %); no clear difference for sphere.");
}

TEST(Answer, HasASentenceForEachComparison) {
  Analysis analysis;
  analysis.table.shapes = {"sphere", "cone"};
  analysis.table.renderers = {"point", "ray", "tube"};
  const auto add = [&](const RendererPair& pair, double log_ratio, double p_holm) {
    Comparison& comparison = analysis.comparisons.emplace_back();
    comparison.pair = pair;
    comparison.shapes.resize(2);
    for (PairedShape& shape : comparison.shapes) {
      shape.mean_log_ratio = log_ratio;
      shape.percent_reduction_geometric = percent_reduction(log_ratio);
      shape.t_test.p_holm = p_holm;
    }
  };
  add({"point", "ray", 0, 1}, -0.2, 0.01);
  add({"point", "tube", 0, 2}, 0.1, 0.02);
  EXPECT_EQ(conclusion(analysis),
            "The ray is faster than the point for sphere (18 %) and cone (18 %). tube is slower "
            "than the point for sphere (11 %) and cone (11 %).");
  EXPECT_EQ(with_renderer(analysis, "than with"), "than with the point");
  EXPECT_TRUE(compares_as_paper(analysis));
  analysis.comparisons.erase(analysis.comparisons.begin());
  analysis.comparisons[0].pair = {"tip1", "tip2", 0, 1};
  EXPECT_EQ(conclusion(analysis), "tip2 is slower than tip1 for sphere (11 %) and cone (11 %).");
  EXPECT_EQ(with_renderer(analysis, "than with"), "with tip2 than with tip1");
  EXPECT_EQ(paper_reduction(analysis.comparisons[0].pair, "cone"), "");
  EXPECT_FALSE(compares_as_paper(analysis));
}

TEST(SpeedAccuracy, SlowerAndBetterIsATradeOffToo) {
  const Analysis analysis = analysis_with(3, 10, [](int p, int i, StudyTrial& trial) {
    if (trial.renderer == "ray") trial.response_time = 6;
    if (trial.renderer == "point" && i < 2 + p) answer_wrongly(trial);
    return true;
  });
  EXPECT_EQ(analysis.comparisons[0].speed_accuracy[0].reading, "trade-off possible");
  EXPECT_NEAR(*analysis.comparisons[0].speed_accuracy[0].accuracy_change, 0.3, 1e-12);
}

TEST(Learning, DiffersBetweenRenderersAsRayLessPoint) {
  // Log times fall by 1 % of a unit a trial with the point, by 3 % and more with the ray.
  const Analysis analysis = analysis_with(3, 16, [](int p, int i, StudyTrial& trial) {
    const int number = 2 * i + (trial.shape == "cone" ? 1 : 0);
    const double slope = trial.renderer == "point" ? -0.01 : -0.03 - 0.01 * p;
    trial.response_time = std::exp(2 + slope * number);
    return true;
  });
  EXPECT_NEAR(*analysis.practice.pairs[0].mean_slope_difference, -3, 1e-9);
  EXPECT_NEAR(*analysis.practice.pairs[0].slope_difference.sd, 1, 1e-9);
  // The first of 8 bins holds trials 0 to 3 of each participant, 14 before the middle of either
  // shape; persons' slopes have an sd of 0.01.
  EXPECT_NEAR(*analysis.practice.learning[1].bins[0].se_mean_log, 0.14 / std::sqrt(3.0), 1e-9);
}

TEST(RendererOrder, AllShapesCountOnlyWhoHasThemAll) {
  const Analysis analysis = analysis_with(
      4, 3, [](int p, int, StudyTrial& trial) { return p != 3 || trial.shape == "cone"; });
  const auto of = [&](const OrderEffect& effect) { return effect.reference_first.n_participants; };
  EXPECT_EQ(of(analysis.practice.pairs[0].shapes[0]), 3U);
  EXPECT_EQ(of(analysis.practice.pairs[0].shapes[1]), 4U);
  EXPECT_EQ(of(analysis.practice.pairs[0].all_shapes), 3U);
}

TEST(Sphericity, SaysThatMauchlyNeedsMoreParticipants) {
  const std::string fixtures = PALPATE_SOURCE_DIR "/tests/analysis/fixtures/";
  const Analysis analysis = analyze(read_trials_csv(fixtures + "two_people.csv"), {}, "test");
  const Sphericity& shape = analysis.rm_anova.effects[1].sphericity;
  EXPECT_FALSE(shape.mauchly_w || shape.mauchly_p || shape.mauchly_p_box);
  EXPECT_NE(shape.undefined.find("Mauchly's test needs more participants than degrees of freedom"),
            std::string::npos);
}

TEST(SingularFit, IsNamedByWhatDoesNotVary) {
  const auto singular = [](const Change& change) {
    return analysis_with(4, 4, change).mixed_model.singular;
  };
  // The same alternating noise for all: participants vary less than by chance.
  const auto noise = [](int i) { return i % 2 == 0 ? 0.3 : -0.3; };
  EXPECT_EQ(singular([&](int, int i, StudyTrial& trial) {
              trial.response_time = std::exp(2 + noise(i));
              return true;
            }),
            "participants' intercepts do not vary; participants' slopes for ray do not vary");
  EXPECT_EQ(singular([&](int p, int i, StudyTrial& trial) {
              trial.response_time = std::exp(2 + 0.5 * p + noise(i));
              return true;
            }),
            "participants' slopes for ray do not vary");
  EXPECT_EQ(singular([&](int p, int i, StudyTrial& trial) {
              const double gain = trial.renderer == "ray" ? 1.5 : 1;
              trial.response_time = std::exp(2 + 0.5 * p * gain + noise(i));
              return true;
            }),
            "a correlation of +1 between participants' effects");
}

TEST(Power, CountsOnlyEffectsInTheRightDirection) {
  StudyModel model;
  model.shapes = {"cone"};
  model.log_ratios = {-1e-9};
  model.gain_sd = 0.2;
  model.residual_sd = 0.3;
  PowerSettings settings;
  const Power power = simulate_power(model, {8, 10}, settings);
  EXPECT_NEAR(power.proportion(power.found[0]), 0.025, 0.006) << "half of alpha";
}

TEST(Power, AllShapesHaveLessPowerThanAny) {
  StudyModel model;
  model.shapes = {"sphere", "cone"};
  model.gain_sd = 0.2;
  model.residual_sd = 0.3;
  PowerSettings settings;
  settings.studies = 2000;
  for (const std::vector<double>& effects : {std::vector{-1.0, -1e-9}, std::vector{-1e-9, -1.0}}) {
    model.log_ratios = effects;
    const Power power = simulate_power(model, {8, 10}, settings);
    EXPECT_GT(power.proportion(power.any), 0.99);
    EXPECT_LT(power.proportion(power.all), 0.1);
  }
}

TEST(Power, ModelEqualsTrialsWithoutParticipantsVariance) {
  StudyModel model;
  model.shapes = {"cone"};
  model.log_ratios = {-0.13};
  model.residual_sd = 0.4;
  PowerSettings settings;
  settings.studies = 1000;
  settings.test = StudyTest::model;
  // The standard error is 0.4 sqrt(2 / 160), the effect 2.91 of them: a z-test finds 0.829. Times
  // that vary more within a cell than their model says would leave much less of it.
  const Power power = simulate_power(model, {40, 4}, settings);
  EXPECT_NEAR(power.proportion(power.found[0]), 0.81, 0.05);
}

TEST(Plan, AsksForTheGoalThatIsSet) {
  Plan plan;
  const Power power{100, {10, 90}, 10, 90};
  plan.settings.goal = Goal::all;
  EXPECT_EQ(goal_power(plan, power), 0.1);
  plan.settings.goal = Goal::any;
  EXPECT_EQ(goal_power(plan, power), 0.9);
}

TEST(Pilot, LeavesTooFastTrialsOutOfTheShare) {
  const Analysis analysis = analysis_with(4, 8, [](int p, int i, StudyTrial& trial) {
    trial.response_time = std::exp(2 + 0.1 * p + 0.1 * ((i * i + p) % 5) +
                                   (trial.renderer == "ray" ? 0.07 * (p % 3) : 0));
    if (i == 0) trial.response_time = 0.1;
    return true;
  });
  const Pilot pilot = read_pilot(analysis);
  ASSERT_EQ(pilot.undefined, "");
  EXPECT_EQ(pilot.model.proportion_used, 7.0 / 8);
}

}  // namespace
}  // namespace palpate::analysis
