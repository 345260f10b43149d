// Functions of several dimensions against their formulas, and QUEST+ over points against a plain
// sum of the expected entropy.

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <map>
#include <set>

#include "data/base/random.h"
#include "data/base/sobol.h"
#include "protocols/procedures/procedure.h"

namespace palpate::protocols {
namespace {
namespace points_by_hand {

double phi(double z) { return 0.5 * std::erfc(-z / std::sqrt(2.0)); }

/// As the schema writes the forms, with libm. Two dimensions: S or x2, then x or x1; cues: D last.
double formula(FieldForm form, const std::vector<double>& v, const LevelPoint& p) {
  const double l = v.back();
  switch (form) {
    case FieldForm::weber:
      return l + (1 - 2 * l) * phi(0.6744897501960817 * (p[1] - p[0]) / (v[0] * (p[0] + v[1])));
    case FieldForm::power:
      return l +
             (1 - 2 * l) * phi(0.6744897501960817 * (p[1] - p[0]) / (v[0] * std::pow(p[0], v[1])));
    case FieldForm::threshold_line:
      return v[3] + (1 - v[3] - l) * phi(v[0] * (p[1] - (v[1] + v[2] * p[0])));
    case FieldForm::threshold_parabola:
      return v[4] + (1 - v[4] - l) * phi(v[0] * (p[1] - (v[1] + v[2] * p[0] + v[3] * p[0] * p[0])));
    case FieldForm::cues:
      return l + (1 - 2 * l) * phi((p[1] - p[0] - (v[0] - 0.5) * p[2]) / v[1]);
  }
  return 0;
}

std::vector<double> parameters_of(FieldForm form) {
  switch (form) {
    case FieldForm::weber:
      return {0.12, 60, 0.02};
    case FieldForm::power:
      return {0.4, 0.7, 0.05};
    case FieldForm::threshold_line:
      return {0.02, 20, 0.8, 0.1, 0.02};
    case FieldForm::threshold_parabola:
      return {0.02, 20, 0.8, 0.001, 0.1, 0.02};
    case FieldForm::cues:
      return {0.3, 25, 0.01};
  }
  return {};
}

constexpr FieldForm kForms[] = {FieldForm::weber, FieldForm::power, FieldForm::threshold_line,
                                FieldForm::threshold_parabola, FieldForm::cues};

TEST(FieldFunction, EveryFormIsItsFormula) {
  Random random(3);
  for (const FieldForm form : kForms) {
    const std::vector<double> parameters = parameters_of(form);
    ASSERT_EQ(parameters.size(), grid_names(form).size());
    for (int i = 0; i < 500; ++i) {
      const LevelPoint point{100 + 700 * random.unit(), 50 + 900 * random.unit(),
                             200 * random.unit() - 100};
      FieldFunction function;
      function.form = form;
      const double p = formula(form, parameters, point);
      ASSERT_NEAR(field_success(function, parameters, point), p, 1e-13) << to_string(form);
      function.easier = Easier::lower;
      const double floor = formula(form, parameters, {1e-9, -1e9, 0});
      const double top = formula(form, parameters, {1e-9, 1e9, 0});
      if (has_two_lapses(form))
        ASSERT_NEAR(field_success(function, parameters, point), floor + top - p, 1e-12);
    }
  }
}

TEST(FieldFunction, ThreeQuartersLieAJndAboveTheStandard) {
  FieldFunction weber;
  for (const double standard : {100.0, 800.0}) {
    const double jnd = field_jnd(FieldForm::weber, {0.12, 60}, standard);
    EXPECT_DOUBLE_EQ(jnd, 0.12 * (standard + 60));
    EXPECT_NEAR(field_share(weber, {0.12, 60}, {standard, standard + jnd}), 0.75, 1e-12);
    weber.form = FieldForm::power;
    const double power = field_jnd(FieldForm::power, {0.4, 0.7}, standard);
    EXPECT_NEAR(power, 0.4 * std::pow(standard, 0.7), 1e-12 * power);
    EXPECT_NEAR(field_share(weber, {0.4, 0.7}, {standard, standard + power}), 0.75, 1e-12);
    weber.form = FieldForm::weber;
  }
}

TEST(FieldFunction, ThresholdsAreMeasuredOnTheirScales) {
  FieldFunction line;
  line.form = FieldForm::threshold_line;
  line.shape = PsychometricShape::weibull;
  line.x = 0;
  line.other = 1;
  line.x_scale = line.other_scale = LevelScale::log10;
  const double x = 0.03, x2 = 40;
  const double t = -2 + 0.5 * std::log10(x2);
  EXPECT_NEAR(field_share(line, {3, -2, 0.5}, {x, x2}),
              1 - std::exp(-std::pow(x / std::pow(10, t), 3)), 1e-12);
}

/// Watson 2017 without tables, in double precision: for each point the posterior for either answer,
/// its marginal over the parameters of interest, that marginal's entropy, and the mean entropy.
class PlainFieldQuestPlus {
 public:
  explicit PlainFieldQuestPlus(FieldQuestPlus spec) : spec_(std::move(spec)) {
    std::vector<std::vector<double>> values;
    for (const ParameterGrid& grid : spec_.parameters) values.push_back(grid.values);
    all_ = product_of(values);
    for (const auto& one : all_) {
      double weight = 1;
      for (std::size_t k = 0; k < one.size(); ++k) {
        const ParameterGrid& grid = spec_.parameters[k];
        const auto at = std::find(grid.values.begin(), grid.values.end(), one[k]);
        if (!grid.weights.empty())
          weight *= grid.weights[static_cast<std::size_t>(at - grid.values.begin())];
      }
      posterior_.push_back(weight);
    }
    scale(posterior_);
  }

  double expected_entropy(const LevelPoint& point) const {
    double mean = 0;
    for (const bool success : {false, true}) {
      std::vector<double> after = product(point, success);
      const double probability = scale(after);
      std::map<std::vector<double>, double> marginal;
      for (std::size_t i = 0; i < all_.size(); ++i) {
        std::vector<double> key;
        for (std::size_t k = 0; k < spec_.interest.size(); ++k)
          if (spec_.interest[k]) key.push_back(all_[i][k]);
        marginal[key] += after[i];
      }
      double entropy = 0;
      for (const auto& [key, p] : marginal) entropy -= p > 0 ? p * std::log2(p) : 0;
      mean += probability * entropy;
    }
    return mean;
  }

  void record(const LevelPoint& point, bool success) {
    posterior_ = product(point, success);
    scale(posterior_);
  }
  const std::vector<double>& posterior() const { return posterior_; }

 private:
  static double scale(std::vector<double>& weights) {
    double sum = 0;
    for (const double w : weights) sum += w;
    for (double& w : weights) w /= sum;
    return sum;
  }
  std::vector<double> product(const LevelPoint& point, bool success) const {
    std::vector<double> out = posterior_;
    for (std::size_t i = 0; i < out.size(); ++i) {
      const double p = formula(spec_.function.form, all_[i], point);
      out[i] *= success ? p : 1 - p;
    }
    return out;
  }

  FieldQuestPlus spec_;
  std::vector<std::vector<double>> all_;
  std::vector<double> posterior_;
};

FieldQuestPlus spec_of(FieldForm form, const std::vector<bool>& interest) {
  FieldQuestPlus spec;
  spec.function.form = form;
  spec.levels = {{100, 400, 800}, {80, 130, 250, 380, 440, 700, 900, 1100}};
  if (form == FieldForm::cues) spec.levels.push_back({-60, 0, 60});
  for (const double value : parameters_of(form)) {
    const bool rate = value <= 0.1;
    spec.parameters.push_back(
        {{rate ? value / 2 : 0.7 * value, value, rate ? 1.5 * value : 1.6 * value}, {}});
  }
  spec.parameters.front().weights = {1, 3, 2};
  spec.interest = interest.empty() ? std::vector<bool>(spec.parameters.size(), true) : interest;
  spec.stop_trials = 30;
  return spec;
}

void expect_least_entropy(const FieldQuestPlus& spec) {
  FieldQuestPlusRun run(spec);
  PlainFieldQuestPlus plain(spec);
  Random random(11);
  const std::vector<LevelPoint> points = product_of(spec.levels);
  for (int trial = 0; trial < 12; ++trial) {
    const std::vector<double> information = run.expected_information();
    double least = 1e9;
    for (const LevelPoint& point : points) least = std::min(least, plain.expected_entropy(point));
    // Information is the entropy now less the expected one: the same up to a constant.
    const double now = information[0] + plain.expected_entropy(points[0]);
    for (std::size_t x = 0; x < points.size(); ++x)
      ASSERT_NEAR(information[x], now - plain.expected_entropy(points[x]), 2e-6);
    const LevelPoint next = run.next_point().value();
    EXPECT_NEAR(plain.expected_entropy(next), least, 2e-6);
    const bool success = random.unit() < 0.6;
    run.record({0, success, next});
    plain.record(next, success);
    for (std::size_t i = 0; i < run.posterior().size(); ++i)
      ASSERT_NEAR(run.posterior()[i], plain.posterior()[i], 1e-6);
  }
}

TEST(FieldQuestPlus, ExpectedEntropyIsThePlainSum) {
  for (const FieldForm form : kForms) {
    SCOPED_TRACE(to_string(form));
    expect_least_entropy(spec_of(form, {}));
  }
}

TEST(FieldQuestPlus, OnlyParametersOfInterestCount) {
  expect_least_entropy(spec_of(FieldForm::weber, {true, true, false}));
  expect_least_entropy(spec_of(FieldForm::power, {false, true, false}));
  expect_least_entropy(spec_of(FieldForm::threshold_line, {false, true, true, false, false}));
}

TEST(FieldQuestPlus, EquallyGoodPointsGoToTheFirst) {
  FieldQuestPlus spec = spec_of(FieldForm::weber, {});
  spec.levels = {{400}, {500, 500.0000000001, 500.0000000002}};
  EXPECT_EQ(FieldQuestPlusRun(spec).next_point(), (LevelPoint{400, 500}));
}

TEST(FieldQuestPlus, PointsOffTheGridCountAtTheirPlace) {
  const FieldQuestPlus spec = spec_of(FieldForm::weber, {});
  FieldQuestPlusRun run(spec);
  PlainFieldQuestPlus plain(spec);
  run.record({0, true, {333, 345}});
  plain.record({333, 345}, true);
  for (std::size_t i = 0; i < run.posterior().size(); ++i)
    EXPECT_NEAR(run.posterior()[i], plain.posterior()[i], 1e-12);
}

TEST(FieldQuestPlus, PosteriorFindsTheParticipant) {
  FieldQuestPlus spec;
  spec.levels = {{100, 200, 400, 800}, {}};
  for (int i = 0; i < 25; ++i) spec.levels[1].push_back(60 * std::pow(20.0, i / 24.0));
  for (int i = 0; i < 12; ++i) {
    spec.parameters.resize(3);
    spec.parameters[0].values.push_back(0.04 * std::pow(10, i / 11.0));
    spec.parameters[1].values.push_back(15.0 * i);
  }
  spec.parameters[2].values = {0.02};
  spec.interest = {true, true, true};
  spec.stop_trials = 400;
  Random random(4);
  FieldQuestPlusRun run(spec);
  int trials = 0;
  while (const auto point = run.next_point()) {
    const double p = formula(FieldForm::weber, {0.12, 60, 0.02}, *point);
    run.record({0, random.unit() < p, *point});
    ++trials;
  }
  EXPECT_EQ(trials, 400);
  const std::vector<double> found = run.estimate().parameters;
  for (const double standard : {100.0, 800.0})
    EXPECT_NEAR(std::log(found[0] * (standard + found[1]) / (0.12 * (standard + 60))), 0, 0.25);
  EXPECT_LT(run.entropy_bits(), std::log2(144.0) - 2);
}

TEST(SobolPoints, FillTheRangesOnTheirScales) {
  SobolPoints spec;
  spec.ranges = {{100, 800, LevelScale::linear}, {0.001, 0.1, LevelScale::log10}};
  spec.trials = 64;
  Procedure procedure(spec, 9);
  std::map<int, int> linear, logarithmic;
  std::set<LevelPoint> all;
  for (std::uint64_t i = 0; const auto point = procedure.next_point(); ++i) {
    const std::vector<double> share = shifted_sobol(i, 2, 9);
    EXPECT_NEAR((*point)[0], 100 + 700 * share[0], 1e-8);
    EXPECT_NEAR(std::log10((*point)[1]), -3 + 2 * share[1], 1e-9);
    ++linear[static_cast<int>(8 * share[0])];
    ++logarithmic[static_cast<int>(8 * share[1])];
    all.insert(*point);
    procedure.record({0, i % 2 == 0, *point});
  }
  EXPECT_EQ(all.size(), 64u);
  for (int part = 0; part < 8; ++part) {
    EXPECT_EQ(linear[part], 8);
    EXPECT_EQ(logarithmic[part], 8);
  }
  EXPECT_NE(Procedure(spec, 10).next_point(), Procedure(spec, 9).next_point());
  EXPECT_EQ(Procedure(AskedPoints{spec}, 9).next_point(), Procedure(spec, 9).next_point());
}

TEST(ProductOf, TheLastDimensionVariesFastest) {
  EXPECT_EQ(product_of({{1, 2}, {3, 4}}),
            (std::vector<LevelPoint>{{1, 3}, {1, 4}, {2, 3}, {2, 4}}));
}

TEST(ConstantPoints, EachRoundHasEveryPoint) {
  ConstantStimuli spec;
  spec.points = product_of({{1, 2}, {3, 4}});
  spec.repetitions = 3;
  Procedure procedure(spec, 2);
  std::map<LevelPoint, int> shown;
  for (int i = 0; const auto point = procedure.next_point(); ++i) {
    ++shown[*point];
    if (i % 4 == 3)
      for (const LevelPoint& one : spec.points) EXPECT_EQ(shown[one], i / 4 + 1);
    procedure.record({0, true, *point});
  }
  EXPECT_EQ(most_trials(ProcedureSpec(spec)), 12u);
}

}  // namespace points_by_hand
}  // namespace
}  // namespace palpate::protocols
