// Functions of several dimensions fitted to answers of a known function.

#include "analysis/statistics/field_fit.h"

#include <gtest/gtest.h>

#include <cmath>

#include "data/base/random.h"

namespace palpate::analysis {
namespace {

using protocols::FieldForm;
using protocols::FieldFunction;

constexpr double kStandards[] = {20, 60, 200, 600, 2000};

/// Answers at random comparisons within some JNDs of five standards.
std::vector<PointCount> answers_of(const FieldFunction& truth, const std::vector<double>& values,
                                   int trials, std::uint64_t seed) {
  Random random(seed);
  std::vector<PointCount> counts;
  for (int i = 0; i < trials; ++i) {
    const double standard = kStandards[i % 5];
    const double jnd = protocols::field_jnd(truth.form, values, standard);
    const double x = std::round(10 * (standard + jnd * (5 * random.unit() - 2.5))) / 10;
    const protocols::LevelPoint point{standard, x};
    const bool success = random.unit() < field_success(truth, values, point);
    counts.push_back({point, 1, success ? 1 : 0});
  }
  return sum_by_point(std::move(counts));
}

const FieldParameter& parameter(const FieldFit& fit, const std::string& name) {
  for (const FieldParameter& one : fit.parameters)
    if (one.name == name) return one;
  throw std::out_of_range(name);
}

bool holds(const FieldParameter& one, double truth) {
  return one.ci95.low <= truth && truth <= one.ci95.high;
}

TEST(FieldFit, IntervalsHoldTheTruth) {
  int held_w = 0, held_c = 0, held_jnd = 0;
  constexpr int kPeople = 30;
  FieldModel model;
  model.middle = 200;
  for (int person = 0; person < kPeople; ++person) {
    const auto counts = answers_of({}, {0.12, 60, 0.02}, 300, 100 + person);
    const FieldFit fit = fit_field(counts, model);
    ASSERT_EQ(fit.undefined, "");
    held_w += holds(parameter(fit, "w"), 0.12) ? 1 : 0;
    held_c += holds(parameter(fit, "c"), 60) ? 1 : 0;
    held_jnd += holds(*fit.jnd, 0.12 * 260) ? 1 : 0;
    EXPECT_NEAR(fit.jnd->value, parameter(fit, "w").value * (200 + parameter(fit, "c").value),
                1e-6);
  }
  // 95 %: fewer than 25 of 30 would come by chance in one of 200 tests.
  EXPECT_GE(held_w, 25);
  EXPECT_GE(held_c, 25);
  EXPECT_GE(held_jnd, 25);
}

// Brute force: no other parameters on a fine grid are likelier.
TEST(FieldFit, NoPlaceOfAGridIsLikelier) {
  const FieldFunction truth;
  const auto counts = answers_of(truth, {0.12, 60, 0.02}, 200, 9);
  const FieldFit fit = fit_field(counts, {});
  const auto log_likelihood = [&](double w, double c, double lapse) {
    double sum = 0;
    for (const PointCount& count : counts) {
      const double z =
          0.6744897501960817 * (count.point[1] - count.point[0]) / (w * (count.point[0] + c));
      const double p = lapse + (1 - 2 * lapse) * 0.5 * std::erfc(-z / std::sqrt(2.0));
      sum += count.successes * std::log(p) + (count.trials - count.successes) * std::log(1 - p);
    }
    return sum;
  };
  double most = -1e9;
  for (int i = 0; i < 60; ++i)
    for (int k = 0; k < 60; ++k)
      for (const double lapse : {1e-6, 0.01, 0.02, 0.03, 0.045, 0.06})
        most = std::max(most, log_likelihood(0.05 + 0.005 * i, -15 + 5 * k, lapse));
  EXPECT_GE(fit.log_likelihood, most - 1e-6);
  EXPECT_NEAR(fit.log_likelihood,
              log_likelihood(parameter(fit, "w").value, parameter(fit, "c").value,
                             std::max(fit.lapse, 1e-12)),
              1e-4);
}

/// Deviance and degrees of freedom over people whose JND is a power of the standard, or Weber's
/// law.
FieldMisfit summed_misfit(FieldForm form, const std::vector<double>& values) {
  FieldMisfit sum;
  for (std::uint64_t person = 0; person < 12; ++person) {
    FieldFunction truth;
    truth.form = form;
    const FieldFit fit = fit_field(answers_of(truth, values, 400, 40 + person), {});
    EXPECT_EQ(fit.misfit.undefined, "");
    EXPECT_EQ(fit.misfit.df, 3);
    sum.deviance += fit.misfit.deviance;
    sum.df += fit.misfit.df;
  }
  return sum;
}

TEST(FieldFit, APowerLawDoesNotFitWebersLaw) {
  const FieldMisfit wrong = summed_misfit(FieldForm::power, {1, 0.7, 0.02});
  const FieldMisfit right = summed_misfit(FieldForm::weber, {0.12, 60, 0.02});
  ASSERT_EQ(wrong.df, 36);
  EXPECT_GT(wrong.deviance, 51.0);  // 95 % quantile of chi squared with 36 degrees of freedom
  EXPECT_LT(right.deviance, 51.0);
}

double log_likelihood_of(const FieldFunction& function, const std::vector<double>& values,
                         const std::vector<PointCount>& counts, const FieldModel& model) {
  const auto of = [](int trials, int successes, double p) {
    return successes * std::log(p) + (trials - successes) * std::log(1 - p);
  };
  double sum = 0;
  for (const PointCount& count : counts)
    sum += of(count.trials, count.successes, field_success(function, values, count.point));
  if (model.catch_trials > 0)
    sum += of(model.catch_trials, model.catch_successes, values[values.size() - 2]);
  return sum;
}

TEST(FieldFit, EveryFormFindsItsParameters) {
  struct Case {
    FieldFunction function;
    std::vector<double> values;
  };
  FieldFunction line, parabola, cues, power;
  power.form = FieldForm::power;
  line.form = FieldForm::threshold_line;
  parabola.form = FieldForm::threshold_parabola;
  parabola.shape = protocols::PsychometricShape::logistic;
  cues.form = FieldForm::cues;
  const Case cases[] = {{power, {0.8, 0.75, 0.02}},
                        {line, {0.08, 20, 0.5, 0.1, 0.02}},
                        {parabola, {0.15, 30, 0.2, 0.004, 0.1, 0.02}},
                        {cues, {0.3, 25, 0.02}}};
  for (const Case& one : cases) {
    for (const std::uint64_t seed : {17, 18, 19}) {
      SCOPED_TRACE(std::string(to_string(one.function.form)) + ", seed " + std::to_string(seed));
      Random random(seed);
      std::vector<PointCount> counts;
      FieldModel model;
      model.function = one.function;
      const bool detects = !has_two_lapses(one.function.form);
      model.guess.free = detects;
      for (int i = 0; i < 1200; ++i) {
        const double other = detects ? 25.0 * (i % 5) : 100.0 * (1 + i % 4);
        const double conflict = one.function.form == FieldForm::cues ? 40.0 * (i % 3) - 40 : 0;
        const double x = detects ? 10 * std::round(14 * random.unit())
                                 : other + 10 * std::round(16 * random.unit() - 8);
        const protocols::LevelPoint point{other, x, conflict};
        const bool success = random.unit() < field_success(one.function, one.values, point);
        counts.push_back({point, 1, success ? 1 : 0});
      }
      if (detects) {
        model.catch_trials = 200;
        for (int i = 0; i < 200; ++i) model.catch_successes += random.unit() < 0.1 ? 1 : 0;
      }
      counts = sum_by_point(std::move(counts));
      const FieldFit fit = fit_field(counts, model);
      ASSERT_EQ(fit.undefined, "");
      // Twice the gain over the truth follows chi squared with a degree of freedom for each
      // parameter: of 6 it is beyond 27.9 once in 10,000 times.
      const double gain =
          fit.log_likelihood - log_likelihood_of(one.function, one.values, counts, model);
      EXPECT_GE(gain, 0);
      EXPECT_LT(2 * gain, 27.9);
      for (std::size_t k = 0; k < parameter_names(one.function.form).size(); ++k) {
        const FieldParameter& found = fit.parameters[k];
        SCOPED_TRACE(found.name);
        EXPECT_LT(found.ci95.low, found.value);
        EXPECT_GT(found.ci95.high, found.value);
        // Four standard errors, as the interval has two.
        EXPECT_GT(one.values[k], found.value - 2 * (found.value - found.ci95.low));
        EXPECT_LT(one.values[k], found.value + 2 * (found.ci95.high - found.value));
      }
      EXPECT_EQ(fit.misfit.undefined, "");
      EXPECT_GT(fit.misfit.p, 0.0005);
    }
  }
}

TEST(FieldFit, AConstantJndLeavesWAndCOpen) {
  FieldFunction flat;
  flat.form = FieldForm::power;
  const FieldFit fit = fit_field(answers_of(flat, {30, 0, 0.02}, 200, 3), {});
  EXPECT_FALSE(parameter(fit, "w").closed);
  EXPECT_EQ(parameter(fit, "w").ci95.low, 0);
  EXPECT_TRUE(std::isinf(parameter(fit, "c").ci95.high));
  EXPECT_TRUE(fit.jnd->closed);
}

// The profile of c by brute force: at each c the likeliest w and lapse of a grid.
TEST(FieldFit, IntervalsOfAFlatFitAreTheProfiles) {
  constexpr double kHalf = 0.5 * 3.841458820694124;
  int flat = 0;
  for (const std::uint64_t seed : {4, 5, 6, 7, 8, 9}) {
    SCOPED_TRACE(seed);
    FieldFunction truth;
    truth.form = FieldForm::power;
    const auto counts = answers_of(truth, {30, 0.1, 0.02}, 80, seed);
    const FieldFit fit = fit_field(counts, {});
    ASSERT_EQ(fit.undefined, "");
    const FieldParameter &w = parameter(fit, "w"), &c = parameter(fit, "c");
    flat += c.value > 20 * fit.middle ? 1 : 0;
    for (const double at : {-10.0, 0.0, 100.0, 1000.0, 5000.0}) {
      double most = -1e9;
      for (int i = 0; i < 240; ++i)
        for (const double lapse : {1e-9, 0.01, 0.02, 0.03, 0.04, 0.05, 0.06})
          most = std::max(most,
                          log_likelihood_of({}, {1e-3 * std::pow(1.04, i), at, lapse}, counts, {}));
      const double loss = fit.log_likelihood - most;
      if (loss < kHalf - 0.1) {
        EXPECT_LE(c.ci95.low, at) << loss;
        EXPECT_GE(c.ci95.high, at) << loss;
      } else if (loss > kHalf + 0.1) {
        EXPECT_FALSE(c.ci95.low < at && at < c.ci95.high) << at << " " << loss;
      }
    }
    for (const double at : {0.03, 0.1, 0.3, 1.0, 3.0}) {
      double most = -1e9;
      for (int i = 0; i < 240; ++i)
        for (const double lapse : {1e-9, 0.01, 0.02, 0.03, 0.04, 0.05, 0.06})
          most = std::max(
              most,
              log_likelihood_of({}, {at, -19.99 + 0.01 * std::pow(1.06, i), lapse}, counts, {}));
      const double loss = fit.log_likelihood - most;
      if (loss < kHalf - 0.1) EXPECT_GE(w.ci95.high, at) << loss;
      if (loss > kHalf + 0.1) EXPECT_FALSE(w.ci95.low < at && at < w.ci95.high) << at;
    }
  }
  EXPECT_GT(flat, 0);
}

TEST(FieldFit, SaysWhyThereIsNone) {
  EXPECT_EQ(fit_field({}, {}).undefined, "no answers");
  EXPECT_EQ(fit_field({{{100, 120}, 5, 5}, {{200, 300}, 5, 5}}, {}).undefined,
            "all answers are alike");
  EXPECT_EQ(fit_field({{{100, 120}, 5, 5}, {{100, 90}, 5, 1}}, {}).undefined,
            "fewer than 2 values of the dimension over which it changes");
  FieldModel power;
  power.function.form = FieldForm::power;
  EXPECT_EQ(fit_field({{{0, 120}, 5, 5}, {{100, 90}, 5, 1}}, power).undefined,
            "a standard is not above 0");
  const FieldFit two = fit_field(
      {{{100, 80}, 9, 2}, {{100, 130}, 9, 7}, {{400, 300}, 9, 2}, {{400, 500}, 9, 8}}, {});
  EXPECT_EQ(two.misfit.undefined, "no more places than the form has parameters for them");
}

}  // namespace
}  // namespace palpate::analysis
