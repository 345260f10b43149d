// Time-outs as censored times: against R's survreg, against the likelihood maximised directly, and
// the coverage of the interval.

#include "analysis/statistics/censored.h"

#include <gtest/gtest.h>

#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "analysis/input/trials.h"
#include "analysis/statistics/analysis.h"
#include "data/base/random.h"

namespace palpate::analysis {
namespace {

using Json = nlohmann::json;

const std::string kCensoredFixtures = PALPATE_SOURCE_DIR "/tests/analysis/fixtures/";

/// The estimate from the rows, also without time-outs.
CensoredEstimate estimate_all(const TrialTable& table) {
  const Description description = describe(table, 0.2);
  TimeOuts outs = time_outs(table, description);
  // A time-out of another participant, so that there is an estimate.
  outs.cells[0].emplace_back().n_timeouts = 1;
  return censored_by_shape(description, outs, {"point", "ray", 0, 1})[0];
}

TEST(Censored, AgreesWithSurvreg) {
  const Json all = Json::parse(std::ifstream(kCensoredFixtures + "censored.json"));
  for (const auto& [name, shapes] : all.items()) {
    const TrialTable table = read_trials_csv(kCensoredFixtures + name + ".csv");
    const Description description = describe(table, 0.2);
    TimeOuts outs = time_outs(table, description);
    outs.cells[0].emplace_back().n_timeouts = 1;
    const auto estimates = censored_by_shape(description, outs, {"point", "ray", 0, 1});
    for (const auto& [shape, expected] : shapes.items()) {
      SCOPED_TRACE(name + ", " + shape);
      const auto at = std::ranges::find(table.shapes, shape) - table.shapes.begin();
      const CensoredEstimate& found = estimates[static_cast<std::size_t>(at)];
      EXPECT_EQ(found.n_participants, expected["n_participants"].get<std::size_t>());
      if (!expected.contains("log_ratio")) {
        EXPECT_NE(found.undefined, "");
        continue;
      }
      ASSERT_EQ(found.undefined, "");
      EXPECT_EQ(found.n_observed, expected["n_observed"].get<std::size_t>());
      EXPECT_EQ(found.n_censored, expected["n_censored"].get<std::size_t>());
      const auto near = [&answer = expected](const std::optional<double>& value, const char* key,
                                             double relative) {
        const auto wanted = answer[key].get<double>();
        EXPECT_NEAR(value.value(), wanted, relative * std::max(1e-2, std::fabs(wanted))) << key;
      };
      near(found.log_ratio, "log_ratio", 1e-6);
      near(found.residual_sd, "residual_sd", 1e-6);
      near(found.log_likelihood, "log_likelihood", 1e-10);
      near(found.se_model, "se_model", 1e-6);
      near(found.se_log_ratio, "se_log_ratio", 1e-6);
      near(found.df, "df", 1e-15);
      near(found.log_ratio_ci95->low, "log_ratio_ci95_low", 1e-6);
      near(found.log_ratio_ci95->high, "log_ratio_ci95_high", 1e-6);
      const Interval percent = percent_reduction(*found.log_ratio_ci95);
      near(percent_reduction(*found.log_ratio), "percent_reduction", 1e-6);
      near(percent.low, "percent_reduction_ci95_low", 1e-5);
      near(percent.high, "percent_reduction_ci95_high", 1e-5);
    }
  }
}

/// Makes trials one by one.
struct Row {
  std::string participant, renderer;
  double time;
  bool timed_out = false;
};

TrialTable table_of(const std::vector<Row>& rows) {
  TrialTableBuilder builder;
  int trial = 0;
  for (const char* renderer : {"point", "ray"}) {  // the order of renderers
    for (const Row& row : rows) {
      if (row.renderer != renderer) continue;
      StudyTrial raw;
      raw.participant = row.participant;
      raw.renderer = row.renderer;
      raw.shape = "cone";
      raw.trial = ++trial;
      raw.timed_out = row.timed_out;
      raw.correct = !row.timed_out;
      if (*raw.correct) raw.response = "cone";
      raw.response_time = row.time;
      builder.add(raw);
    }
  }
  return builder.finish({});
}

/// A simulated study with random gains; times beyond the limit are time-outs.
std::vector<Row> simulated(Random& random, int participants, int trials, double gain,
                           double gain_sd, double limit, double residual_sd = 0.5) {
  std::vector<Row> rows;
  for (int p = 0; p < participants; ++p) {
    const double own = 3.0 + 0.3 * random.normal(), own_gain = gain + gain_sd * random.normal();
    for (const char* renderer : {"point", "ray"}) {
      for (int i = 0; i < trials; ++i) {
        const double m = own + (renderer == std::string("ray") ? own_gain : 0);
        const double time = std::exp(m + residual_sd * random.normal());
        rows.push_back({std::string(1, static_cast<char>('A' + p)), renderer, std::min(time, limit),
                        time >= limit});
      }
    }
  }
  return rows;
}

TEST(Censored, MaximizesTheLikelihoodWrittenOut) {
  for (const std::uint64_t seed : {3, 4, 5}) {
    Random random(seed);
    const auto rows = simulated(random, 4, 9, -0.4, 0.1, 30);
    const CensoredEstimate found = estimate_all(table_of(rows));
    ASSERT_EQ(found.undefined, "");
    ASSERT_GT(found.n_censored, 3U);
    // Profile likelihood: intercepts by ternary search for each slope and sd (unimodal).
    const auto log_likelihood = [&](double slope, double sd) {
      const boost::math::normal normal;
      double sum = 0;
      for (char who = 'A'; who < 'E'; ++who) {
        const auto of_person = [&](double intercept) {
          double value = 0;
          for (const Row& row : rows) {
            if (row.participant[0] != who) continue;
            const double m = intercept + (row.renderer == "ray" ? slope : 0);
            const double z = (std::log(row.time) - m) / sd;
            value += row.timed_out ? std::log(cdf(complement(normal, z)))
                                   : std::log(pdf(normal, z)) - std::log(sd * row.time);
          }
          return value;
        };
        double low = 0, high = 8;
        for (int i = 0; i < 120; ++i) {
          const double a = low + (high - low) / 3, b = high - (high - low) / 3;
          (of_person(a) < of_person(b) ? low : high) = of_person(a) < of_person(b) ? a : b;
        }
        sum += of_person((low + high) / 2);
      }
      return sum;
    };
    const double b = *found.log_ratio, sd = *found.residual_sd;
    const double top = log_likelihood(b, sd);
    EXPECT_NEAR(top, *found.log_likelihood, 1e-9);
    for (const auto& [db, ds] : {std::pair{1e-3, 0.0},
                                 {-1e-3, 0.0},
                                 {0.0, 1e-3},
                                 {0.0, -1e-3},
                                 {1e-3, 1e-3},
                                 {-1e-3, 1e-3},
                                 {1e-3, -1e-3},
                                 {0.2, 0.0},
                                 {0.0, 0.2}}) {
      EXPECT_LT(log_likelihood(b + db, sd + ds), top) << db << " " << ds;
    }
    // The model's standard error from second differences of the profile likelihood.
    const double h = 1e-3;
    const auto at = [&](int i, int k) { return log_likelihood(b + i * h, sd + k * h); };
    const double bb = -(at(1, 0) - 2 * top + at(-1, 0)) / (h * h);
    const double ss = -(at(0, 1) - 2 * top + at(0, -1)) / (h * h);
    const double bs = -(at(1, 1) - at(1, -1) - at(-1, 1) + at(-1, -1)) / (4 * h * h);
    EXPECT_NEAR(*found.se_model, std::sqrt(ss / (bb * ss - bs * bs)), 1e-4 * *found.se_model);
  }
}

TEST(Censored, EqualsPairedTTestIfBalancedAndUncensored) {
  constexpr std::uint64_t kSeed = 8;
  Random random(kSeed);
  const TrialTable table = table_of(simulated(random, 6, 5, -0.3, 0.2, 1e9));
  const CensoredEstimate found = estimate_all(table);
  const Description description = describe(table, 0.2);
  const PairedShape paired = compare_by_shape(table, description, {"point", "ray", 0, 1})[0];
  EXPECT_EQ(found.n_censored, 0U);
  EXPECT_NEAR(*found.log_ratio, *paired.mean_log_ratio, 1e-9);
  EXPECT_NEAR(*found.se_log_ratio, *paired.t_test.se, 1e-9);
  EXPECT_EQ(found.df, paired.t_test.df);
  EXPECT_NEAR(found.log_ratio_ci95->low, paired.t_test.log_ratio_ci95->low, 1e-8);
  EXPECT_NEAR(found.log_ratio_ci95->high, paired.t_test.log_ratio_ci95->high, 1e-8);
}

TEST(Censored, IntervalHoldsTruthWhereThePrimaryDoesNot) {
  // 7 participants, gain 0.4 with sd 0.1; a fifth of the trials with the point are time-outs.
  constexpr double kGain = -0.4;
  constexpr int kStudies = 1000;
  for (const std::uint64_t seed : {21, 22}) {
    Random random(seed);
    int held = 0, primary_held = 0;
    double bias = 0, primary_bias = 0;
    for (int i = 0; i < kStudies; ++i) {
      const TrialTable table = table_of(simulated(random, 7, 20, kGain, 0.1, 32));
      const CensoredEstimate found = estimate_all(table);
      ASSERT_EQ(found.undefined, "");
      const auto paired = compare_by_shape(table, describe(table, 0.2), {"point", "ray", 0, 1})[0];
      const auto holds = [&](const Interval& ends) {
        return ends.low <= kGain && kGain <= ends.high;
      };
      held += holds(*found.log_ratio_ci95);
      primary_held += holds(*paired.t_test.log_ratio_ci95);
      bias += (*found.log_ratio - kGain) / kStudies;
      primary_bias += (*paired.mean_log_ratio - kGain) / kStudies;
    }
    EXPECT_NEAR(held / double{kStudies}, 0.95, 0.02) << "three standard errors of 1000 studies";
    EXPECT_NEAR(bias, 0, 0.01);
    EXPECT_LT(primary_held / double{kStudies}, 0.75);
    EXPECT_GT(primary_bias, 0.08) << "time-outs left out hide a part of the gain";
  }
}

TEST(Censored, TakesParticipantsAlwaysLateWithOneRenderer) {
  constexpr std::uint64_t kSeed = 12;
  Random random(kSeed);
  auto rows = simulated(random, 4, 6, -0.3, 0.1, 60);
  const double without = *estimate_all(table_of(rows)).log_ratio;
  for (int i = 0; i < 6; ++i) {
    rows.push_back({"Z", "point", 60, true});
    rows.push_back({"Z", "ray", 20.0 + i});
  }
  const CensoredEstimate with = estimate_all(table_of(rows));
  EXPECT_EQ(with.undefined, "");
  EXPECT_EQ(with.n_participants, 5U);
  EXPECT_LT(*with.log_ratio, without) << "slower than the limit with the point: a greater gain";
}

TEST(Censored, SaysWhatCannotBeKnown) {
  const auto undefined = [](const std::vector<Row>& rows) {
    return estimate_all(table_of(rows)).undefined;
  };
  const std::vector<Row> never{{"A", "point", 60, true}, {"A", "ray", 9}, {"A", "ray", 8},
                               {"B", "point", 60, true}, {"B", "ray", 7}, {"B", "ray", 5}};
  EXPECT_EQ(undefined(never),
            "no time with the point: how much longer than the limit its trials take is not known");
  EXPECT_EQ(
      undefined({{"A", "point", 9}, {"A", "point", 8}, {"A", "ray", 60, true}, {"A", "ray", 7}}),
      "one participant, so no variance between participants");
  EXPECT_EQ(undefined({{"A", "point", 9}, {"B", "ray", 8}}),
            "no participant has trials with both renderers and a time");
  EXPECT_NE(undefined({{"A", "point", 8}, {"A", "ray", 4}, {"B", "point", 6}, {"B", "ray", 3}}), "")
      << "every ratio is 2: no residual, no spread";
  EXPECT_EQ(
      undefined({{"A", "point", 8}, {"A", "ray", 4}, {"B", "point", 0, true}, {"B", "ray", 3}}),
      "a time-out has no time: its limit is not known");
}

}  // namespace
}  // namespace palpate::analysis
