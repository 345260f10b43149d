#include <gtest/gtest.h>

#include <cmath>

#include "data/base/random.h"
#include "protocols/procedures/procedure.h"

namespace palpate::protocols {
namespace {

/// Watson 2017, section "QUEST+", step by step, without tables and with the standard library: for
/// every stimulus the posterior for either answer, its entropy, and the mean entropy.
class PlainQuestPlus {
 public:
  explicit PlainQuestPlus(QuestPlus spec) : spec_(std::move(spec)) {
    const auto prior = [](const ParameterGrid& grid, std::size_t i) {
      return grid.weights.empty() ? 1.0 : grid.weights[i];
    };
    for (std::size_t t = 0; t < spec_.threshold.values.size(); ++t) {
      for (std::size_t s = 0; s < spec_.slope.values.size(); ++s) {
        for (std::size_t g = 0; g < spec_.guess.values.size(); ++g) {
          for (std::size_t l = 0; l < spec_.lapse.values.size(); ++l) {
            psi_.push_back({spec_.threshold.values[t], spec_.slope.values[s], spec_.guess.values[g],
                            spec_.lapse.values[l]});
            posterior_.push_back(prior(spec_.threshold, t) * prior(spec_.slope, s) *
                                 prior(spec_.guess, g) * prior(spec_.lapse, l));
          }
        }
      }
    }
    scale(posterior_);
  }

  double expected_entropy(double x) const {
    double mean = 0;
    for (const bool success : {false, true}) {
      std::vector<double> after = product(x, success);
      const double probability = scale(after);
      double entropy = 0;
      for (const double p : after) entropy -= p > 0 ? p * std::log2(p) : 0;
      mean += probability * entropy;
    }
    return mean;
  }

  void record(double x, bool success) {
    posterior_ = product(x, success);
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

  /// Psychometric functions as the paper writes them, log10 and dB included.
  double success(double x, const PsychometricParameters& psi) const {
    const auto on_scale = [&](double level) {
      return spec_.function.scale == LevelScale::linear  ? level
             : spec_.function.scale == LevelScale::log10 ? std::log10(level)
                                                         : 20 * std::log10(level);
    };
    double d = on_scale(x) - on_scale(psi.threshold);
    if (spec_.function.easier == Easier::lower) d = -d;
    double f = 0;
    switch (spec_.function.shape) {
      case PsychometricShape::logistic:
        f = 0.5 * (1 + std::tanh(0.5 * psi.slope * d));
        break;
      case PsychometricShape::normal:
        f = 0.5 * std::erfc(-psi.slope * d / std::sqrt(2.0));
        break;
      case PsychometricShape::weibull:
        if (spec_.function.scale == LevelScale::decibel) d /= 20;
        f = -std::expm1(-std::pow(10, psi.slope * d));
        break;
    }
    return psi.guess + (1 - psi.guess - psi.lapse) * f;
  }

  std::vector<double> product(double x, bool answer) const {
    std::vector<double> after;
    for (std::size_t i = 0; i < psi_.size(); ++i) {
      const double p = success(x, psi_[i]);
      after.push_back(posterior_[i] * (answer ? p : 1 - p));
    }
    return after;
  }

  QuestPlus spec_;
  std::vector<PsychometricParameters> psi_;
  std::vector<double> posterior_;
};

QuestPlus small_quest(PsychometricShape shape, LevelScale scale, Easier easier) {
  QuestPlus spec;
  spec.function = {shape, scale, easier};
  spec.levels = {1, 1.5, 2, 3, 4, 6, 8};
  spec.threshold = {{1.2, 2.2, 3.1, 5}, {1, 2, 2, 1}};
  spec.slope = {{0.7, 2, 4}, {}};
  spec.guess = {{0, 0.5}, {3, 1}};
  spec.lapse = {{0, 0.02, 0.1}, {}};
  spec.stop_trials = 30;
  return spec;
}

/// Runs both side by side.
void expect_as_plain(const QuestPlus& spec, std::uint64_t seed) {
  QuestPlusRun run(spec);
  PlainQuestPlus plain(spec);
  Random random(seed);
  while (const auto level = run.next_level()) {
    const double before = run.entropy_bits();
    const std::vector<double> information = run.expected_information();
    double smallest = before;
    for (std::size_t x = 0; x < spec.levels.size(); ++x) {
      const double entropy = plain.expected_entropy(spec.levels[x]);
      EXPECT_NEAR(before - information[x], entropy, 1e-11);
      smallest = std::min(smallest, entropy);
    }
    EXPECT_NEAR(plain.expected_entropy(*level), smallest, 1e-9);
    const bool success = random.unit() < (*level > 2.5 ? 0.9 : 0.4);
    run.record({*level, success});
    plain.record(*level, success);
    for (std::size_t i = 0; i < plain.posterior().size(); ++i)
      ASSERT_NEAR(run.posterior()[i], plain.posterior()[i], 1e-12);
  }
}

TEST(QuestPlusProcedure, EqualsTheDefinitionOfThePaper) {
  for (const std::uint64_t seed : {1U, 2U}) {
    for (const Easier easier : {Easier::higher, Easier::lower}) {
      expect_as_plain(small_quest(PsychometricShape::weibull, LevelScale::log10, easier), seed);
      expect_as_plain(small_quest(PsychometricShape::weibull, LevelScale::decibel, easier), seed);
      expect_as_plain(small_quest(PsychometricShape::normal, LevelScale::linear, easier), seed);
      expect_as_plain(small_quest(PsychometricShape::logistic, LevelScale::log10, easier), seed);
    }
  }
}

TEST(QuestPlusProcedure, EquallyGoodLevelsAreChosenInOrder) {
  // Fully symmetric about 0: both sides of a threshold at 0 are equally good.
  QuestPlus spec;
  spec.levels = {2, -2};
  spec.threshold = {{-1, 0, 1}, {}};
  spec.slope = {{1}, {}};
  spec.guess = {{0}, {}};
  spec.lapse = {{0}, {}};
  EXPECT_EQ(QuestPlusRun(spec).next_level(), 2);
  std::swap(spec.levels[0], spec.levels[1]);
  EXPECT_EQ(QuestPlusRun(spec).next_level(), -2);
}

TEST(QuestPlusProcedure, RecordsLevelsOffTheGridAtTheirValue) {
  QuestPlus spec = small_quest(PsychometricShape::logistic, LevelScale::linear, Easier::higher);
  QuestPlusRun run(spec);
  PlainQuestPlus plain(spec);
  run.record({2.7, true});
  plain.record(2.7, true);
  for (std::size_t i = 0; i < plain.posterior().size(); ++i)
    EXPECT_NEAR(run.posterior()[i], plain.posterior()[i], 1e-14);
}

TEST(QuestPlusProcedure, EndsAtAnEntropyOrAfterItsTrials) {
  QuestPlus spec = small_quest(PsychometricShape::logistic, LevelScale::linear, Easier::higher);
  spec.stop_entropy_bits = 4;
  QuestPlusRun run(spec);
  double entropy = run.entropy_bits();
  int trials = 0;
  while (const auto level = run.next_level()) {
    EXPECT_GT(entropy, 4);
    run.record({*level, *level > 2.5});
    entropy = run.entropy_bits();
    ++trials;
  }
  EXPECT_TRUE(entropy <= 4 || trials == 30);
  EXPECT_LT(trials, 30);
  EXPECT_GT(trials, 2);
}

TEST(QuestPlusProcedure, ImpossibleAnswersAreIgnored) {
  QuestPlus spec = small_quest(PsychometricShape::weibull, LevelScale::log10, Easier::higher);
  spec.guess = {{0}, {}};
  QuestPlusRun run(spec);
  const std::vector<double> before = run.posterior();
  run.record({0, true});  // no stimulus and no guessing, yet "yes"
  EXPECT_EQ(run.posterior(), before);
  EXPECT_EQ(run.estimate().trials, 1);
}

TEST(QuestPlusProcedure, MarginalsSumThePosterior) {
  QuestPlusRun run(small_quest(PsychometricShape::normal, LevelScale::linear, Easier::higher));
  run.record({4, true});
  for (const std::size_t parameter : {0U, 1U, 2U, 3U}) {
    double sum = 0;
    for (const double p : run.marginal(parameter)) sum += p;
    EXPECT_NEAR(sum, 1, 1e-12);
  }
  // The guess rate 0 was three times as likely; an answer "yes" favours guessing.
  EXPECT_LT(run.marginal(2)[0], 0.75);
  EXPECT_NEAR(*run.estimate().guess, 0.5 * run.marginal(2)[1], 1e-12);
}

}  // namespace
}  // namespace palpate::protocols
