
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "analysis/input/trials.h"
#include "analysis/report/report.h"
#include "analysis/statistics/analysis.h"
#include "analysis/statistics/comparison.h"
#include "data/base/random.h"
#include "tests/shared/rounds.h"

namespace palpate::analysis {
namespace {

/// A participant with all trials of `first` before those of the other renderer, shapes alternating.
struct Participant {
  std::string name, first;
  double gain = 0;         ///< log ray - log point
  double learning = 0;     ///< of log time per 100 trials with a renderer
  int wrong_with_ray = 0;  ///< number of wrong answers, in the first trials
  bool mixed = false;      ///< trials of the two renderers alternate
};

constexpr int kTrials = 40;  // with each renderer

Analysis analysis_of(const std::vector<Participant>& participants) {
  TrialTableBuilder builder;
  for (const Participant& participant : participants) {
    for (const std::string renderer : {"point", "ray"}) {
      for (int i = 0; i < kTrials; ++i) {
        StudyTrial raw;
        raw.participant = participant.name;
        raw.renderer = renderer;
        raw.shape = i % 2 == 0 ? "cone" : "cube";
        raw.trial = participant.mixed ? 2 * i + (renderer == participant.first ? 0 : 1)
                                      : i + (renderer == participant.first ? 0 : kTrials);
        raw.response = raw.shape;
        if (renderer == "ray" && i < participant.wrong_with_ray) raw.response = "sphere";
        raw.correct = raw.response == raw.shape;
        raw.response_time = std::exp(2 + (renderer == "ray" ? participant.gain : 0) +
                                     (i % 2 == 0 ? 0.5 : 0) + participant.learning * i / 100);
        builder.add(raw);
      }
    }
  }
  return analyze(builder.finish({}), {}, "test");
}

TEST(Learning, SlopesEqualThoseWithinShapes) {
  const Analysis analysis = analysis_of(
      {{"A", "point", -0.2, -0.3}, {"B", "ray", -0.2, -0.1}, {"C", "point", -0.2, -0.2}});
  const Practice& practice = analysis.practice;
  ASSERT_EQ(practice.learning.size(), 2U);
  for (const Learning& learning : practice.learning) {
    EXPECT_EQ(learning.n_participants, 3U);
    EXPECT_NEAR(*learning.mean_slope, -0.2, 1e-12);
    EXPECT_NEAR(*learning.slope.t, -0.2 / (0.1 / std::sqrt(3.0)), 1e-9);
    EXPECT_EQ(*learning.slope.df, 2);
    // Bins of 5 trials, the first centred on trial 2; the mean of all is at trial 19.5.
    for (std::size_t b = 0; b < kLearningBins; ++b) {
      EXPECT_EQ(learning.bins[b].n_participants, 3U);
      EXPECT_EQ(learning.bins[b].n_trials, 15U);
    }
    // Cones have even trials, cubes odd ones: each relative to the mean of its shape.
    const double first = (3 * (2 - 19.0) + 2 * (2 - 20.0)) / 5;
    const double last = (2 * (37 - 19.0) + 3 * (37 - 20.0)) / 5;
    EXPECT_NEAR(*learning.bins[7].mean_log - *learning.bins[0].mean_log,
                -0.2 * (last - first) / 100, 1e-12);
  }
  EXPECT_NEAR(*practice.pairs[0].mean_slope_difference, 0, 1e-12);
  EXPECT_NE(practice.pairs[0].slope_difference.undefined, "");  // no variance
}

// With as many trials in every bin, the bins' mean is the mean over all participants.
TEST(Learning, BinsAverageToTheMeanOfAllParticipants) {
  const std::vector<Participant> participants{
      {"A", "point", -0.6, -0.3}, {"B", "ray", 0.2, -0.1}, {"C", "point", 0.7, 0.5}};
  double gains = 0, learning = 0;
  for (const Participant& participant : participants) {
    gains += participant.gain / 3;
    learning += participant.learning / 3;
  }
  const Analysis analysis = analysis_of(participants);
  for (std::size_t r = 0; r < 2; ++r) {
    double sum = 0;
    for (const LearningBin& bin : analysis.practice.learning[r].bins) sum += *bin.mean_log;
    // Of 2, 0.5 in every second trial, and the slope at the middle of trials 0 to 39.
    const double all = 2.25 + learning * 19.5 / 100;
    const double gain = analysis.table.renderers[r] == "ray" ? gains : 0;
    EXPECT_NEAR(sum / kLearningBins, all + gain, 1e-12) << analysis.table.renderers[r];
  }
}

TEST(RendererOrder, IsTheTwoSampleTestOfTheGains) {
  const Analysis analysis = analysis_of({{"A", "point", -0.5},
                                         {"B", "point", -0.3},
                                         {"C", "ray", 0.1},
                                         {"D", "ray", 0},
                                         {"E", "ray", -0.1},
                                         {"F", "ray", 5, 0, 0, true}});
  const PairPractice& practice = analysis.practice.pairs[0];
  EXPECT_EQ(practice.n_interleaved, 1U);
  std::vector<OrderEffect> effects = practice.shapes;
  effects.push_back(practice.all_shapes);
  for (const OrderEffect& effect : effects) {
    EXPECT_EQ(effect.reference_first.n_participants, 2U);
    EXPECT_EQ(effect.renderer_first.n_participants, 3U);
    EXPECT_NEAR(*effect.difference, -0.4, 1e-12);
    EXPECT_NEAR(*effect.balanced_log_ratio, -0.2, 1e-12);
    // R: t.test(c(-.5, -.3), c(.1, 0, -.1), var.equal = TRUE)
    EXPECT_NEAR(*effect.test.t, -3.79473319220206, 1e-10);
    EXPECT_NEAR(*effect.test.p, 0.0321194160504168, 1e-10);
    EXPECT_NEAR(effect.test.log_ratio_ci95->low, -0.735459295196136, 1e-10);
    EXPECT_NEAR(effect.test.log_ratio_ci95->high, -0.0645407048038645, 1e-10);
    const double half = (-0.0645407048038645 - -0.735459295196136) / 4;
    EXPECT_NEAR(effect.balanced_ci95->low, -0.2 - half, 1e-10);
    EXPECT_NEAR(effect.balanced_ci95->high, -0.2 + half, 1e-10);
  }
  // The warning depends on the p that is adjusted over all tests of practice.
  EXPECT_EQ(analysis.practice.n_tests, 3U) << "two shapes, all shapes; the slopes have no variance";
  EXPECT_NEAR(*practice.all_shapes.test.p_holm, 3 * 0.0321194160504168, 1e-10);
  const auto warned = [](const Analysis& of) {
    return report_text(of).find("depends on which renderer came first") != std::string::npos;
  };
  EXPECT_FALSE(warned(analysis));
  EXPECT_TRUE(warned(analysis_of({{"A", "point", -0.5},
                                  {"B", "point", -0.45},
                                  {"C", "ray", 0.1},
                                  {"D", "ray", 0},
                                  {"E", "ray", 0.05}})));
}

/// Participants without learning: noise only.
Analysis study_without_learning(Random& random) {
  TrialTableBuilder builder;
  for (int p = 0; p < 7; ++p) {
    const std::string name(1, static_cast<char>('A' + p));
    for (int i = 0; i < 2 * kTrials; ++i) {
      const bool ray = (i < kTrials) == (p % 2 == 0);
      StudyTrial raw;
      raw.participant = name;
      raw.renderer = ray ? "ray" : "point";
      raw.shape = raw.response = i % 2 == 0 ? "cone" : "cube";
      raw.trial = i + 1;
      raw.correct = true;
      raw.response_time = std::exp(2 + 0.4 * random.normal());
      builder.add(raw);
    }
  }
  return analyze(builder.finish({}), {}, "test");
}

TEST(Learning, GivesNoVerdictAndPracticeIsOneFamily) {
  for (const std::uint64_t seed : {41, 42}) {
    Random random(seed);
    constexpr int kStudies = 400;
    int any_raw = 0, any_adjusted = 0, warned = 0;
    for (int i = 0; i < kStudies; ++i) {
      const Analysis analysis = study_without_learning(random);
      const Practice& practice = analysis.practice;
      ASSERT_EQ(practice.n_tests, 6U);  // two slopes, their difference, two shapes, all shapes
      bool raw = false, adjusted = false;
      const auto look = [&](const TTest& test) {
        raw = raw || *test.p < 0.05;
        adjusted = adjusted || *test.p_holm < 0.05;
      };
      for (const Learning& learning : practice.learning) look(learning.slope);
      look(practice.pairs[0].slope_difference);
      look(practice.pairs[0].all_shapes.test);
      for (const OrderEffect& shape : practice.pairs[0].shapes) look(shape.test);
      any_raw += raw;
      any_adjusted += adjusted;
      warned += std::ranges::any_of(analysis.warnings, [](const std::string& warning) {
        return warning.find("came first") != std::string::npos;
      });
      if (i > 3) continue;
      const std::string text = report_text(analysis);
      for (const char* verdict : {"faster with practice", "slower with time"}) {
        EXPECT_EQ(text.find(verdict), std::string::npos);
      }
      EXPECT_NE(text.find("of time per 100 trials (95 % interval"), std::string::npos);
    }
    EXPECT_GT(any_raw, 0.12 * kStudies) << "unadjusted, they find something again and again";
    EXPECT_LT(any_adjusted, 0.08 * kStudies);
    EXPECT_LT(warned, 0.06 * kStudies);
  }
}

TEST(Learning, SaysNothingOfFewTrials) {
  TrialTableBuilder builder;
  for (const std::string who : {"A", "B", "C"}) {
    for (const std::string renderer : {"point", "ray"}) {
      // With the ray one trial too few for a slope.
      for (std::size_t i = 0; i < kSlopeTrials - (renderer == "ray" ? 1 : 0); ++i) {
        StudyTrial raw;
        raw.participant = who;
        raw.renderer = renderer;
        raw.shape = raw.response = "cone";
        raw.trial = static_cast<int>(i) + (renderer == "ray" ? 100 : 0);
        raw.correct = true;
        raw.response_time = 5 + 0.1 * static_cast<double>(i % 7) + (who == "A" ? 1 : 0);
        builder.add(raw);
      }
    }
  }
  const Analysis analysis = analyze(builder.finish({}), {}, "test");
  EXPECT_TRUE(analysis.practice.learning[0].mean_slope.has_value());
  EXPECT_FALSE(analysis.practice.learning[1].mean_slope.has_value());
  EXPECT_EQ(
      analysis.practice.learning[1].slope.undefined,
      "every participant has fewer than 32 times or no shape twice with it: too few for a slope");
  EXPECT_FALSE(analysis.practice.pairs[0].mean_slope_difference.has_value());
}

TEST(RendererOrder, SaysWhyItCannotBeTold) {
  const auto undefined = [](const std::vector<Participant>& participants) {
    return analysis_of(participants).practice.pairs[0].all_shapes.test.undefined;
  };
  EXPECT_EQ(undefined({{"A", "point", 0.1}, {"B", "point", 0.2}}),
            "all participants had the point first");
  EXPECT_EQ(undefined({{"A", "ray", 0.1}}), "all participants had the ray first");
  EXPECT_EQ(undefined({{"A", "ray", 0.1, 0, 0, true}}),
            "no participant did one renderer after the other");
  EXPECT_EQ(undefined({{"A", "ray", 0.1}, {"B", "point", 0.2}}),
            "one participant in each order, so no variance within the orders");
  EXPECT_EQ(undefined({{"A", "ray", 0.1}, {"B", "point", 0.2}, {"C", "ray", 0.1}}),
            "all differences are equal (no variance)");
  EXPECT_NE(report_text(analysis_of({{"A", "ray", 0.1}, {"B", "ray", 0.2}}))
                .find("All participants had the ray first"),
            std::string::npos);
}

TEST(SpeedAccuracy, SaysWhereSpeedMayBeBoughtWithErrors) {
  const Analysis trade_off = analysis_of(
      {{"A", "point", -0.3, 0, 6}, {"B", "ray", -0.2, 0, 8}, {"C", "ray", -0.1, 0, 10}});
  for (const SpeedAccuracy& shape : trade_off.comparisons[0].speed_accuracy) {
    EXPECT_EQ(shape.reading, "trade-off possible");
    EXPECT_NEAR(*shape.percent_change_time, 100 * std::expm1(-0.2), 1e-9);
    EXPECT_NEAR(*shape.accuracy_reference, 1, 1e-15);
    EXPECT_NEAR(*shape.accuracy_renderer, 0.8, 1e-15);
    EXPECT_NEAR(*shape.accuracy_change, -0.2, 1e-15);
    EXPECT_NEAR(*shape.test.t, -0.2 / (0.05 / std::sqrt(3.0)), 1e-9);
    EXPECT_EQ(shape.n_pairs, 3U);
  }
  const auto reading = [](const std::vector<Participant>& participants) {
    return analysis_of(participants).comparisons[0].speed_accuracy[0].reading;
  };
  // Slower and less accurate.
  EXPECT_EQ(reading({{"A", "point", 0.3, 0, 6}, {"B", "ray", 0.2, 0, 8}, {"C", "ray", 0.1, 0, 10}}),
            "none shown");
  // The same loss on average, but its interval includes 0.
  EXPECT_EQ(
      reading({{"A", "point", -0.3, 0, 2}, {"B", "ray", -0.2, 0, 8}, {"C", "ray", -0.1, 0, 14}}),
      "none shown");
  EXPECT_EQ(reading({{"A", "point", -0.3}, {"B", "ray", -0.2}}), "none shown") << "no errors";
  EXPECT_EQ(reading({{"A", "point", -0.3, 0, 4}, {"B", "ray", -0.2, 0, 4}}), "")
      << "all lose alike: no interval";
  EXPECT_EQ(reading({{"A", "point", -0.3}}), "") << "one participant has no interval";
  EXPECT_EQ(reading({{"A", "point", -0.3, 0, kTrials}}), "") << "no times with the ray";
}

/// Share of the cells of simulated studies in which a trade-off is possible: four shapes, ten
/// trials a cell, as fast with either renderer on average. \param loss of the ray's accuracy when
/// it is faster \param time_outs probability; a time-out is wrong
double share_of_trade_offs(int studies, double loss, double time_outs, double gain) {
  Random random(11);
  const std::vector<std::string> shapes{"sphere", "cone", "cylinder", "cube"};
  int possible = 0;
  for (int study = 0; study < studies; ++study) {
    TrialTableBuilder builder;
    for (int p = 0; p < 8; ++p) {
      int trial = 0;
      const double ability = 0.8 + 0.1 * (random.unit() - 0.5);
      for (const std::string& shape : shapes) {
        const double own_gain = gain + 0.1 * random.normal();
        for (int i = 0; i < 20; ++i) {
          const bool ray = i % 2 == 0;
          const std::string person = "P" + std::to_string(p), renderer = ray ? "ray" : "point";
          StudyTrial raw;
          raw.participant = person;
          raw.renderer = renderer;
          raw.shape = shape;
          raw.timed_out = random.unit() < time_outs;
          raw.correct = !raw.timed_out && random.unit() < ability - (ray ? loss : 0);
          raw.response = raw.timed_out  ? std::string()
                         : *raw.correct ? std::string(shape)
                                        : "other";
          raw.trial = ++trial;
          raw.response_time =
              raw.timed_out ? 30 : std::exp(2 + (ray ? own_gain : 0) + 0.4 * random.normal());
          builder.add(raw);
        }
      }
    }
    const TrialTable table = builder.finish({});
    const Description description = describe(table, 0.2);
    const RendererPair pair{"point", "ray", 0, 1};
    for (const SpeedAccuracy& one :
         speed_accuracy(table, description, pair, compare_by_shape(table, description, pair)))
      possible += one.reading == "trade-off possible" ? 1 : 0;
  }
  return possible / (4.0 * studies);
}

// By definition half of the 5 % of intervals that exclude 0 go with the faster renderer: 2.5 %.
TEST(SpeedAccuracy, IsRarelyATradeOffWithoutAnyEffect) {
  const int studies = testing::rounds(300);
  EXPECT_LT(share_of_trade_offs(studies, 0, 0, 0), 0.045);
  EXPECT_LT(share_of_trade_offs(studies, 0, 0.2, 0), 0.045);
  EXPECT_LT(share_of_trade_offs(studies, 0, 0.05, -0.2), 0.045) << "faster, as accurate";
  EXPECT_GT(share_of_trade_offs(studies, 0.3, 0.05, -0.2), 0.8) << "faster, 30 points lost";
}

TEST(Learning, LevelIsTheMeanOfAllParticipants) {
  // Without learning every bin has the mean log time: 2, half of the shapes 0.5 longer, the gain.
  const Analysis analysis =
      analysis_of({{"A", "point", 0.9}, {"B", "ray", 0.0}, {"C", "point", -0.3}});
  for (const LearningBin& bin : analysis.practice.learning[1].bins) {
    ASSERT_TRUE(bin.mean_log);
    EXPECT_NEAR(*bin.mean_log, 2 + 0.25 + (0.9 + 0.0 - 0.3) / 3, 1e-9);
  }
}

}  // namespace
}  // namespace palpate::analysis
