// Signal detection, scaling, information and mixed models against R, closed forms and definitions.

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>

#include "analysis/statistics/discrimination.h"
#include "analysis/statistics/task_analysis.h"
#include "analysis/statistics/task_comparisons.h"
#include "data/base/random.h"

namespace palpate::analysis {
namespace {

using DetectionJson = nlohmann::json;

DetectionJson detection_fixture() {
  return DetectionJson::parse(
      std::ifstream(PALPATE_SOURCE_DIR "/tests/analysis/fixtures/psychophysics.json"));
}

TEST(SignalDetection, YesNoIsTheDifferenceOfQuantiles) {
  // Corrected rates 40.5 / 51 and 10.5 / 51; quantiles and standard error by R's qnorm and dnorm.
  const Detectability d = detectability({50, 40, 50, 10}, DetectionTask::yes_no);
  EXPECT_NEAR(*d.d_prime, 1.641584, 1e-6);
  EXPECT_NEAR(*d.criterion, 0, 1e-12);
  EXPECT_NEAR(*d.d_prime_se, 0.2811019, 1e-6);
  EXPECT_EQ(detectability({0, 0, 5, 1}, DetectionTask::yes_no).undefined,
            "no trials with a signal");
}

TEST(SignalDetection, PerfectAnswersStayFinite) {
  const Detectability d = detectability({20, 20, 20, 0}, DetectionTask::yes_no);
  EXPECT_TRUE(std::isfinite(*d.d_prime));
  EXPECT_GT(d.d_prime_ci95->low, 0);
}

TEST(SignalDetection, AgreesWithPsyphy) {
  const DetectionJson fixture = detection_fixture();
  for (const auto& one : fixture["m_afc"]) {
    EXPECT_NEAR(forced_choice_d_prime(one["share"], one["alternatives"]).value(),
                one["d_prime"].get<double>(), 2e-4);
  }
  EXPECT_NEAR(forced_choice_d_prime(0.5, 2).value(), 0, 1e-12);
  EXPECT_LT(forced_choice_d_prime(0.3, 2).value(), 0);
  EXPECT_EQ(forced_choice_d_prime(0, 2), std::nullopt);
  EXPECT_EQ(forced_choice_d_prime(1, 2), std::nullopt);
  for (const auto& one : fixture["same_different"]) {
    const Detectability d =
        detectability({one["signal"], one["hits"], one["noise"], one["false_alarms"]},
                      DetectionTask::same_different);
    EXPECT_NEAR(*d.d_prime, one["d_prime"].get<double>(), 2e-4);
  }
}

TEST(SignalDetection, IntervalsCoverTheTruthIn200SimulatedStudies) {
  for (const std::uint64_t seed : {1U, 2U}) {
    Random random(seed, {0xd1});
    for (const DetectionTask task :
         {DetectionTask::yes_no, DetectionTask::two_interval, DetectionTask::same_different}) {
      int held = 0, criterion_held = 0;
      const double d = 1.5, k = task == DetectionTask::same_different ? 1.4 : 0.3;
      for (int study = 0; study < 200; ++study) {
        DetectionCounts counts{80, 0, 80, 0};
        for (int i = 0; i < 80; ++i) {
          const double first = random.normal(), second = random.normal();
          switch (task) {
            case DetectionTask::yes_no:
              counts.hits += first + d / 2 > k ? 1 : 0;
              counts.false_alarms += second - d / 2 > k ? 1 : 0;
              break;
            case DetectionTask::two_interval:  // the second less the first
              counts.hits += second - first + d > k ? 1 : 0;
              counts.false_alarms += random.normal() - random.normal() - d > k ? 1 : 0;
              break;
            case DetectionTask::same_different:
              counts.hits += std::abs(second - first + d) > k ? 1 : 0;
              counts.false_alarms += std::abs(random.normal() - random.normal()) > k ? 1 : 0;
              break;
          }
        }
        const Detectability result = detectability(counts, task);
        if (!result.d_prime_ci95) continue;
        held += result.d_prime_ci95->low <= d && d <= result.d_prime_ci95->high ? 1 : 0;
        criterion_held +=
            result.criterion_ci95->low <= k && k <= result.criterion_ci95->high ? 1 : 0;
      }
      std::printf("seed %llu, task %d: of 200 intervals hold d' %d, criterion %d\n",
                  static_cast<unsigned long long>(seed), static_cast<int>(task), held,
                  criterion_held);
      EXPECT_GE(held, 180);
      EXPECT_GE(criterion_held, 180);
    }
  }
}

TEST(Type2Area, CountsPairsOfCorrectAndWrongAnswers) {
  const Type2Roc roc = type2_roc({{true, 4}, {true, 2}, {true, 2}, {false, 2}, {false, 1}});
  // Pairs: 4 above both; each 2 ties with one and is above the other: (2 + 1.5 + 1.5) / 6.
  EXPECT_NEAR(*roc.area, 5.0 / 6, 1e-15);
  double below_curve = 0;
  for (std::size_t i = 1; i < roc.curve.size(); ++i)
    below_curve += (roc.curve[i].wrong - roc.curve[i - 1].wrong) *
                   (roc.curve[i].correct + roc.curve[i - 1].correct) / 2;
  EXPECT_NEAR(below_curve, *roc.area, 1e-15);
  EXPECT_NEAR(roc.curve.back().wrong, 1, 1e-15);
  EXPECT_NEAR(roc.curve.back().correct, 1, 1e-15);
  EXPECT_EQ(type2_roc({{true, 1}}).undefined, "no wrong answer");
}

TEST(Type2Area, IntervalCoversTheTruth) {
  for (const std::uint64_t seed : {1U, 2U}) {
    Random random(seed, {0xa2});
    const double truth = 0.5 * std::erfc(-0.8 / 2);  // Phi(0.8 / sqrt 2)
    int held = 0;
    for (int study = 0; study < 200; ++study) {
      std::vector<ConfidenceTrial> trials;
      for (int i = 0; i < 100; ++i) {
        const bool correct = i % 4 != 0;
        trials.push_back({correct, random.normal() + (correct ? 0.8 : 0)});
      }
      const Type2Roc roc = type2_roc(trials);
      held += roc.area_ci95->low <= truth && truth <= roc.area_ci95->high ? 1 : 0;
    }
    EXPECT_GE(held, 180);
    EXPECT_LE(held, 199);
  }
}

TEST(Magnitude, ExponentAndModulusEqualization) {
  std::vector<MagnitudeTrial> trials;
  // Two participants with exponents 0.5 and 0.7 and numbers of their own.
  for (const double level : {1.0, 10.0, 100.0}) {
    trials.push_back({0, level, 3 * std::pow(level, 0.5)});
    trials.push_back({1, level, 40 * std::pow(level, 0.7)});
  }
  trials.push_back({0, 10, 0});
  const MagnitudeEstimation free = magnitude_estimation(trials, false);
  EXPECT_EQ(free.without_logarithm, 1u);
  ASSERT_EQ(free.lines.size(), 2u);
  EXPECT_NEAR(*free.lines[0].exponent, 0.5, 1e-12);
  EXPECT_NEAR(*free.lines[1].log10_scale, std::log10(40), 1e-12);
  EXPECT_NEAR(*free.lines[0].r_squared, 1, 1e-12);
  EXPECT_NEAR(*free.exponent, 0.6, 1e-12);
  // Equalized: at the middle level both have the same number, so that there is no spread.
  EXPECT_NEAR(free.means[1].ci95->low, free.means[1].ci95->high, 1e-9);
  EXPECT_NEAR(free.means[1].geometric_mean,
              std::sqrt(3 * std::pow(10, 0.5) * 40 * std::pow(10, 0.7)), 1e-9);
  const MagnitudeEstimation fixed = magnitude_estimation(trials, true);
  EXPECT_GT(fixed.means[1].ci95->high, 2 * fixed.means[1].ci95->low);
  EXPECT_NEAR(fixed.means[1].geometric_mean, free.means[1].geometric_mean, 1e-9);
}

TEST(AdjustmentSettings, SpreadIsAboutTheMeanOfEachDirection) {
  const auto result =
      adjustments({{5, 10, 11, true}, {5, 10, 13, true}, {5, 10, 7, false}, {5, 10, 9, false}});
  ASSERT_EQ(result.size(), 1u);
  EXPECT_EQ(result[0].participant, 5u);
  EXPECT_EQ(result[0].pse, 10);
  EXPECT_EQ(result[0].constant_error, 0);
  EXPECT_EQ(result[0].start_effect, 4);
  EXPECT_NEAR(*result[0].sd, std::sqrt(2), 1e-12);
  EXPECT_NEAR(*result[0].jnd, 0.67449 * std::sqrt(2), 1e-5);
  EXPECT_EQ(adjustments({{0, 1, 2, true}})[0].sd, std::nullopt);
  // Two lengths: their t interval would reach far below 0. Angles may.
  EXPECT_EQ(adjustments({{0, 0.03, 0.035, true}, {0, 0.03, 0.021, false}})[0].pse_ci95->low, 0);
  EXPECT_LT(adjustments({{0, 0, 35, true}, {0, 0, 21, false}})[0].pse_ci95->low, -50);
}

TEST(Information, AgreesWithClosedForms) {
  const InformationTransfer perfect = information_transfer({{10, 0}, {0, 10}});
  EXPECT_NEAR(*perfect.plain, 1, 1e-12);
  EXPECT_NEAR(perfect.stimulus_entropy, 1, 1e-12);
  const InformationTransfer nothing = information_transfer({{10, 10}, {10, 10}});
  EXPECT_NEAR(*nothing.plain, 0, 1e-12);
  // Symmetric channel with errors of 1/4: 1 - H(1/4).
  const InformationTransfer noisy = information_transfer({{30, 10}, {10, 30}});
  EXPECT_NEAR(*noisy.plain, 1 + 0.25 * std::log2(0.25) + 0.75 * std::log2(0.75), 1e-12);
  EXPECT_NEAR(*noisy.corrected, *noisy.plain - 1 / (160 * std::log(2)), 1e-12);
  EXPECT_EQ(information_transfer({{0, 0}, {0, 0}}).undefined, "no answers");
  // One error in 30: four cells of nine are filled, and the bias is not below 0.
  const InformationTransfer few = information_transfer({{10, 0, 0}, {0, 9, 1}, {0, 0, 10}});
  EXPECT_EQ(*few.corrected, *few.plain);
}

/// Means over simulated studies of four stimuli of which half are identified, the rest guessed.
struct TransferMeans {
  double plain = 0, corrected = 0, spread = 0, se = 0;
};

TransferMeans simulate_transfer(std::size_t trials, int studies, std::uint64_t seed) {
  Random random(seed, {0x1f});
  TransferMeans means;
  double squares = 0;
  for (int study = 0; study < studies; ++study) {
    std::vector<std::vector<std::size_t>> counts(4, std::vector<std::size_t>(4, 0));
    for (std::size_t i = 0; i < trials; ++i) {
      const bool right = random.unit() < 0.5;
      ++counts[i % 4][right ? i % 4 : random.below(4)];
    }
    const InformationTransfer result = information_transfer(counts);
    means.plain += *result.plain / studies;
    means.corrected += *result.corrected / studies;
    squares += *result.plain * *result.plain / studies;
    means.se += *result.se / studies;
  }
  means.spread = std::sqrt(squares - means.plain * means.plain);
  return means;
}

// The same simulation in R has biases of 0.098 and 0.025 bit with 80 trials (plain, corrected),
// 0.0204 and 0.0042 with 400.
TEST(Information, CorrectionRemovesMostBiasOfSmallSamples) {
  const double truth = 2 + 0.625 * std::log2(0.625) + 0.375 * std::log2(0.125);
  for (const std::uint64_t seed : {1U, 2U}) {
    const TransferMeans few = simulate_transfer(80, 2000, seed);
    EXPECT_NEAR(few.plain - truth, 0.098, 0.012);
    EXPECT_NEAR(few.corrected - truth, 0.025, 0.012);
    EXPECT_NEAR(few.se / few.spread, 1, 0.15);
    const TransferMeans many = simulate_transfer(400, 1000, seed);
    EXPECT_NEAR(many.plain - truth, 0.0204, 0.007);
    EXPECT_NEAR(many.corrected - truth, 0.0042, 0.007);
  }
}

TEST(CompareThresholds, AgreesWithLmerAndPairedTests) {
  const DetectionJson fixture = detection_fixture()["thresholds"];
  std::vector<ParticipantFigure> figures;
  for (const auto& row : fixture["rows"])
    figures.push_back({row["participant"], row["condition"], row["value"]});
  const ThresholdComparison result = compare_thresholds(figures, 3);
  EXPECT_NEAR(*result.participant_sd, fixture["participant_sd"].get<double>(), 1e-4);
  EXPECT_NEAR(*result.residual_sd, fixture["residual_sd"].get<double>(), 1e-4);
  ASSERT_EQ(result.differences.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    const ConditionDifference& found = result.differences[i];
    const auto& pair = fixture["pairs"][i];
    EXPECT_NEAR(*found.mixed_estimate, fixture["estimate"][i].get<double>(), 1e-5);
    EXPECT_NEAR(*found.mixed_se, fixture["se"][i].get<double>(), 1e-5);
    EXPECT_EQ(found.n_pairs, pair["n"].get<std::size_t>());
    EXPECT_NEAR(found.mean, pair["mean"].get<double>(), 1e-9);
    EXPECT_NEAR(*found.t_test.t, pair["t"].get<double>(), 1e-6);
    EXPECT_NEAR(*found.t_test.p, pair["p"].get<double>(), 1e-8);
    EXPECT_NEAR(found.t_test.log_ratio_ci95->low, pair["low"].get<double>(), 1e-8);
  }
  EXPECT_EQ(compare_thresholds(figures, 1).undefined, "fewer than two conditions");
}

}  // namespace
}  // namespace palpate::analysis
