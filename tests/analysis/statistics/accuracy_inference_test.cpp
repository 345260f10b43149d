// Accuracy between renderers against R (t.test, lme4's glmer with (1 + r || id)) and at the limits.

#include "analysis/statistics/accuracy_inference.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "analysis/statistics/slope_logistic.h"

namespace palpate::analysis {
namespace {

using AccuracyJson = nlohmann::json;

const std::string kAccuracyFixtures = PALPATE_SOURCE_DIR "/tests/analysis/fixtures/group/";

template <class Names>
std::size_t number_of(const std::string& name, Names& names) {
  const auto at = std::ranges::find(names, name);
  if (at == names.end()) names.push_back(name);
  return static_cast<std::size_t>(std::ranges::find(names, name) - names.begin());
}

/// Trials from counts by participant, renderer and shape.
TrialTable read_table() {
  std::ifstream file(kAccuracyFixtures + "accuracy.csv");
  TrialTable table;
  table.renderers = {"point", "ray"};
  std::vector<std::string> participants;
  std::string line;
  std::getline(file, line);
  while (std::getline(file, line)) {
    std::stringstream fields(line);
    std::string field[6];
    for (std::string& one : field) std::getline(fields, one, ',');
    TrialRow row;
    row.participant = static_cast<std::uint32_t>(number_of(field[0], participants));
    row.renderer = static_cast<std::uint16_t>(number_of(field[1], table.renderers));
    row.shape = static_cast<std::uint16_t>(number_of(field[2], table.shapes));
    const int trials = std::stoi(field[3]), correct = std::stoi(field[4]),
              timed_out = std::stoi(field[5]);
    for (int i = 0; i < trials; ++i) {
      row.correct = i < correct;
      row.timed_out = i >= trials - timed_out;
      table.rows.push_back(row);
    }
  }
  table.participants.resize(participants.size());
  return table;
}

void expect_shares(const AccuracyDifference& found, const AccuracyJson& want) {
  EXPECT_EQ(found.n, 6U);
  EXPECT_NEAR(*found.difference, want["mean"].get<double>(), 1e-7);
  EXPECT_NEAR(*found.test.t, want["t"].get<double>(), 1e-6);
  EXPECT_EQ(*found.test.df, want["df"].get<double>());
  EXPECT_NEAR(*found.test.p, want["p"].get<double>(), 1e-7);
  EXPECT_NEAR(found.test.log_ratio_ci95->low, want["ci95"][0].get<double>(), 1e-7);
  EXPECT_NEAR(found.test.log_ratio_ci95->high, want["ci95"][1].get<double>(), 1e-7);
}

/// lme4 ends its search some 1e-4 from the maximum of the log likelihood: two searches of ours,
/// with and without exact derivatives, agree in eight digits beyond it.
void expect_model(const AccuracyModel& found, const AccuracyJson& want) {
  EXPECT_EQ(found.participants, want["n"]);
  EXPECT_EQ(found.left_out, std::vector<std::string>{"sphere: no errors"});
  EXPECT_NEAR(*found.log_odds_ratio, want["log_odds_ratio"].get<double>(), 3e-3);
  EXPECT_NEAR(found.participant_sd, want["participant_sd"].get<double>(), 3e-3);
  EXPECT_NEAR(found.slope_sd, want["slope_sd"].get<double>(), 3e-3);
  EXPECT_NEAR(*found.likelihood_ratio, want["lr"].get<double>(), 4e-4);
  EXPECT_NEAR(*found.t, want["t"].get<double>(), 2e-4);
  EXPECT_NEAR(*found.p, want["p"].get<double>(), 1e-4);
  EXPECT_NEAR(*found.ci95_low, want["ci95"][0].get<double>(), 3e-3);
  EXPECT_NEAR(*found.ci95_high, want["ci95"][1].get<double>(), 3e-3);
}

TEST(AccuracyInference, SharesAndModelAgreeWithR) {
  const AccuracyJson expected =
      AccuracyJson::parse(std::ifstream(kAccuracyFixtures + "expected.json"))["accuracy.csv"];
  const AccuracyComparison found = compare_accuracy(read_table(), {"point", "ray", 0, 1});
  expect_shares(found.all, expected["shares_all"]);
  expect_shares(found.answered, expected["shares_answered"]);
  expect_model(found.all.model, expected["model_all"]);
  expect_model(found.answered.model, expected["model_answered"]);
  EXPECT_FALSE(found.depends_on_time_outs);
}

/// Laplace's approximation from the definition, by a plain search for the effects.
double plain_laplace(const std::vector<RenderedAnswers>& answers, double delta,
                     const std::vector<double>& shapes, double tau, double omega) {
  const auto joint = [&](double u, double s) {
    double sum = -0.5 * (u * u + s * s);
    for (const RenderedAnswers& one : answers) {
      const double r = one.compared ? 0.5 : -0.5;
      const double eta = delta * r + shapes[one.shape] + tau * u + omega * r * s;
      sum += one.correct * eta - one.trials * std::log1p(std::exp(eta));
    }
    return sum;
  };
  double u = 0, s = 0, best = joint(0, 0);
  for (double step = 1; step > 1e-9; step /= 2) {
    for (bool moved = true; moved;) {
      moved = false;
      for (const auto& [du, ds] : {std::pair{step, 0.0}, {-step, 0.0}, {0.0, step}, {0.0, -step}}) {
        const double value = joint(u + du, s + ds);
        if (!(value > best)) continue;
        best = value;
        u += du;
        s += ds;
        moved = true;
      }
    }
  }
  const double h = 1e-3;
  const double uu = (2 * best - joint(u + h, s) - joint(u - h, s)) / (h * h);
  const double ss = (2 * best - joint(u, s + h) - joint(u, s - h)) / (h * h);
  const double us =
      -(joint(u + h, s + h) - joint(u + h, s - h) - joint(u - h, s + h) + joint(u - h, s - h)) /
      (4 * h * h);
  return best - 0.5 * std::log(uu * ss - us * us);
}

TEST(SlopeLogistic, FitIsTheMaximumOfLaplacesApproximation) {
  std::vector<RenderedAnswers> answers;
  for (std::size_t p = 0; p < 5; ++p) {
    for (std::size_t s = 0; s < 2; ++s) {
      for (const bool compared : {false, true}) {
        const auto correct = static_cast<double>((3 * p + 5 * s + (compared ? 4 + p : 1)) % 9 + 2);
        answers.push_back({p, s, compared, 12, correct});
      }
    }
  }
  const SlopeLogistic model(answers);
  const SlopeLogisticFit& fit = model.best();
  const auto log_likelihood = [&](double delta, std::vector<double> shapes, double tau,
                                  double omega) {
    double sum = 0;
    for (std::size_t p = 0; p < 5; ++p) {
      std::vector<RenderedAnswers> own;
      for (const RenderedAnswers& one : answers) {
        if (one.participant == p) own.push_back(one);
      }
      sum += plain_laplace(own, delta, shapes, tau, omega);
    }
    return sum;
  };
  const auto at = [&](double by_delta, double by_first, double by_tau, double by_omega) {
    std::vector<double> shapes = fit.shapes;
    shapes[0] += by_first;
    return log_likelihood(fit.log_odds_ratio + by_delta, shapes, fit.sds[0] + by_tau,
                          fit.sds[1] + by_omega);
  };
  EXPECT_NEAR(at(0, 0, 0, 0), fit.log_likelihood, 1e-6);
  for (const double step : {-0.05, 0.05}) {
    EXPECT_LT(at(step, 0, 0, 0), fit.log_likelihood);
    EXPECT_LT(at(0, step, 0, 0), fit.log_likelihood);
    EXPECT_LT(at(0, 0, step, 0), fit.log_likelihood);
    EXPECT_LT(at(0, 0, 0, step), fit.log_likelihood);
  }
  EXPECT_NEAR(model.likelihood_ratio(fit.log_odds_ratio), 0, 1e-9);
}

TEST(AccuracyInference, ExchangedRenderersChangeTheSign) {
  const TrialTable table = read_table();
  const AccuracyDifference a = compare_accuracy(table, {"point", "ray", 0, 1}).all;
  const AccuracyDifference b = compare_accuracy(table, {"ray", "point", 1, 0}).all;
  EXPECT_NEAR(*a.difference, -*b.difference, 1e-12);
  EXPECT_NEAR(*a.model.log_odds_ratio, -*b.model.log_odds_ratio, 1e-5);
  EXPECT_NEAR(*a.model.likelihood_ratio, *b.model.likelihood_ratio, 1e-6);
}

TEST(AccuracyInference, EqualRenderersHaveNoDifference) {
  TrialTable table = read_table();
  std::vector<TrialRow> rows;
  for (TrialRow row : table.rows) {
    if (row.renderer == 1) continue;
    rows.push_back(row);
    row.renderer = 1;
    rows.push_back(row);
  }
  table.rows = rows;
  const AccuracyModel found = compare_accuracy(table, {"point", "ray", 0, 1}).all.model;
  EXPECT_NEAR(*found.log_odds_ratio, 0, 1e-6);
  EXPECT_NEAR(*found.likelihood_ratio, 0, 1e-8);
}

TEST(AccuracyInference, WithoutErrorsNothingIsTested) {
  TrialTable table = read_table();
  for (TrialRow& row : table.rows) {
    row.correct = true;
    row.timed_out = false;
  }
  const AccuracyDifference found = compare_accuracy(table, {"point", "ray", 0, 1}).all;
  EXPECT_EQ(found.test.undefined, "no errors differ");
  EXPECT_EQ(found.model.undefined, "no shape with both errors and correct answers");
  EXPECT_EQ(found.model.left_out.size(), 4U);
}

TEST(AccuracyInference, PerfectRendererLeavesTheOddsOpen) {
  TrialTable table = read_table();
  for (TrialRow& row : table.rows) row.correct |= row.renderer == 1;
  const AccuracyModel found = compare_accuracy(table, {"point", "ray", 0, 1}).all.model;
  EXPECT_TRUE(found.undefined.empty());
  EXPECT_FALSE(found.ci95_high);
  ASSERT_TRUE(found.ci95_low);
  EXPECT_GT(*found.ci95_low, 0);
}

}  // namespace
}  // namespace palpate::analysis
