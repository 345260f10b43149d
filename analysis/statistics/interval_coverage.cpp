#include "analysis/statistics/interval_coverage.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "analysis/statistics/evenly.h"
#include "analysis/statistics/jobs.h"
#include "analysis/statistics/psychometric_fit.h"
#include "analysis/statistics/sensitivity.h"
#include "data/base/random.h"
#include "protocols/procedures/procedure.h"

namespace palpate::analysis {
namespace {

using protocols::ParameterGrid;
using protocols::ProcedureSpec;

protocols::Staircase staircase(double start, double low, double high, std::vector<double> steps,
                               int up, int down) {
  protocols::Staircase spec;
  spec.start = start;
  spec.min = low;
  spec.max = high;
  spec.steps = std::move(steps);
  spec.up = up;
  spec.down = down;
  spec.stop_trials = 70;
  return spec;
}

/// Weighted up-down (Kaernbach 1991).
protocols::Staircase weighted(double start, double target) {
  protocols::Staircase spec = staircase(start, 60, 140, {6, 3}, 1, 1);
  spec.step_ratio = protocols::step_ratio_for(target, 1);
  return spec;
}

protocols::QuestPlus quest(const protocols::PsychometricFunction& function,
                           std::vector<double> levels, ParameterGrid threshold, ParameterGrid slope,
                           double guess) {
  protocols::QuestPlus spec;
  spec.function = function;
  spec.levels = std::move(levels);
  spec.threshold = std::move(threshold);
  spec.slope = std::move(slope);
  spec.guess.values = {guess};
  spec.lapse.values = {0.02};
  spec.stop_trials = 140;
  return spec;
}

struct PlacedLevels {
  const char* name;
  std::vector<ProcedureSpec> tracks;
};

/// The standard is 100, the JND 10, the PSE 103.
void add_two_sided(std::vector<CoverageDesign>& designs, double lapse) {
  CoverageDesign design;
  design.task = "two intervals, levels on both sides";
  const double slope = std::log(3.0) / 10;
  design.truth.parameters = {103, slope, lapse, lapse};
  design.model.lapse = {0, true, kMostLapse};
  design.model.guess_is_lapse = true;
  const PlacedLevels placed[] = {
      {"constant, 7 levels, 140 trials", {protocols::ConstantStimuli{evenly(70, 130, 7), 20}}},
      {"constant, 7 levels, 280 trials", {protocols::ConstantStimuli{evenly(70, 130, 7), 40}}},
      {"two staircases, to 71 and 29 %",
       {staircase(130, 60, 140, {10, 5}, 1, 2), staircase(70, 60, 140, {10, 5}, 2, 1)}},
      {"two weighted staircases, to 75 and 25 %", {weighted(130, 0.75), weighted(70, 0.25)}},
      {"QUEST+",
       {quest({}, evenly(60, 140, 17), {evenly(90, 116, 14), {}},
              {{slope / 2, slope / 1.4, slope, slope * 1.4, slope * 2}, {}}, 0.02)}}};
  for (const PlacedLevels& one : placed) {
    design.procedure = one.name;
    design.tracks = one.tracks;
    designs.push_back(design);
  }
}

/// The standard is 100, the threshold 115.
void add_forced_choice(std::vector<CoverageDesign>& designs, double lapse) {
  CoverageDesign design;
  design.task = "forced choice, two intervals";
  constexpr double kSlope = 0.2;
  design.truth.parameters = {115, kSlope, 0.5, lapse};
  design.model.guess.value = 0.5;
  design.model.lapse = {0, true, kMostLapse};
  const PlacedLevels placed[] = {
      {"constant, 7 levels, 210 trials",
       {protocols::ConstantStimuli{{103, 107, 111, 115, 119, 125, 135}, 30}}},
      {"two staircases, to 71 and 79 %",
       {staircase(140, 101, 150, {8, 4, 2}, 1, 2), staircase(140, 101, 150, {8, 4, 2}, 1, 3)}},
      {"QUEST+",
       {quest({}, evenly(102, 150, 25), {evenly(104, 134, 16), {}},
              {{kSlope / 2, kSlope / 1.4, kSlope, kSlope * 1.4, kSlope * 2}, {}}, 0.5)}}};
  for (const PlacedLevels& one : placed) {
    design.procedure = one.name;
    design.tracks = one.tracks;
    designs.push_back(design);
  }
}

/// The threshold is 5; one false alarm in ten.
void add_yes_no(std::vector<CoverageDesign>& designs, double lapse) {
  CoverageDesign design;
  design.task = "yes/no with catch trials";
  constexpr double kSlope = 1.2, kFalseAlarms = 0.1;
  design.truth.parameters = {5, kSlope, kFalseAlarms, lapse};
  design.model.guess = {0, true, 0.5};
  design.model.lapse = {0, true, kMostLapse};
  design.catch_trials = 40;
  protocols::Limits limits;
  limits.low = 0.5;
  limits.high = 9.5;
  limits.step = 0.5;
  limits.series = 20;
  limits.jitter_steps = 4;
  const PlacedLevels placed[] = {
      {"constant, 9 levels, 180 trials", {protocols::ConstantStimuli{evenly(1, 9, 9), 20}}},
      {"two staircases, to 50 %",
       {staircase(9, 0.5, 9.5, {2, 1, 0.5}, 1, 1), staircase(1, 0.5, 9.5, {2, 1, 0.5}, 1, 1)}},
      {"QUEST+",
       {quest({}, evenly(0.5, 9.5, 19), {evenly(2, 8, 13), {}},
              {{kSlope / 2, kSlope / 1.4, kSlope, kSlope * 1.4, kSlope * 2}, {}}, kFalseAlarms)}},
      {"limits, 20 series", {limits}}};
  for (const PlacedLevels& one : placed) {
    design.procedure = one.name;
    design.tracks = one.tracks;
    designs.push_back(design);
  }
}

std::vector<LevelCount> answers_to(const CoverageDesign& design,
                                   const protocols::InterleavedTracks& first, Random& random,
                                   int& trials) {
  protocols::InterleavedTracks tracks = first;
  std::vector<LevelCount> counts;
  while (const auto asked = tracks.next()) {
    const bool success = design.truth.succeeds(asked->level, random);
    tracks.record({asked->level, success});
    counts.push_back({asked->level, 1, success ? 1 : 0});
  }
  trials = static_cast<int>(counts.size()) + design.catch_trials;
  LevelCount nothing{-std::numeric_limits<double>::infinity(), design.catch_trials, 0};
  for (int i = 0; i < design.catch_trials; ++i)
    nothing.successes += random.unit() < design.truth.parameters.guess ? 1 : 0;
  if (design.catch_trials > 0) counts.push_back(nothing);
  return sum_by_level(std::move(counts));
}

/// A posterior with two free rates has ten times the grid points.
constexpr std::size_t kStudiesOfAPosterior = 4;

/// Contribution of one study to the counts.
struct CoverageStudy {
  bool fitted = false, open = false, called_bad = false, has_posterior = false;
  CoverageCounts likelihood, bayes;
  int trials = 0;
  double slope = 0;
};

std::size_t holds(const Interval& interval, double value) {
  // Bounds of rates come from a search: 0 appears as 1e-9.
  constexpr double kNear = 1e-6;
  return interval.low - kNear <= value && value <= interval.high + kNear ? 1 : 0;
}

CoverageStudy one_study(const CoverageDesign& design, std::uint64_t seed, std::size_t design_number,
                        std::size_t study, int simulations) {
  Random random(seed, {0xc7, design_number, study});
  CoverageStudy result;
  const protocols::InterleavedTracks tracks(design.tracks, random.next());
  const auto counts = answers_to(design, tracks, random, result.trials);
  const PsychometricFit fit = fit_psychometric(counts, design.model);
  if (!fit.undefined.empty()) return result;
  result.fitted = true;
  result.slope = fit.parameters.slope;
  result.open = !std::isfinite(fit.threshold_ci95.low) || !std::isfinite(fit.threshold_ci95.high);
  const auto& [threshold, slope, guess, lapse] = design.truth.parameters;
  result.likelihood = {holds(fit.threshold_ci95, threshold), holds(fit.slope_ci95, slope),
                       holds(fit.lapse_ci95, lapse)};
  result.has_posterior = !design.model.guess_is_free() || study % kStudiesOfAPosterior == 0;
  if (result.has_posterior) {
    const PsychometricPosterior posterior = psychometric_posterior(counts, design.model);
    result.bayes = {holds(posterior.threshold_ci95, threshold), holds(posterior.slope_ci95, slope),
                    holds(posterior.lapse_ci95, lapse)};
  }
  const GoodnessOfFit goodness =
      goodness_of_fit(counts, design.model, fit, simulations, random.next());
  result.called_bad = goodness.p.value_or(1) <= 0.05;
  return result;
}

void add(CoverageCounts& sum, const CoverageCounts& one) {
  sum.threshold += one.threshold;
  sum.slope += one.slope;
  sum.lapse += one.lapse;
}

CoverageResult result_of(const CoverageDesign& design, const CoverageStudy* studies,
                         std::size_t count) {
  CoverageResult result;
  result.design = design;
  std::vector<double> slopes;
  for (std::size_t i = 0; i < count; ++i) {
    const CoverageStudy& one = studies[i];
    result.mean_trials += one.trials;
    if (!one.fitted) {
      ++result.unfitted;
      continue;
    }
    ++result.studies;
    result.open += one.open ? 1 : 0;
    result.called_bad += one.called_bad ? 1 : 0;
    add(result.likelihood, one.likelihood);
    add(result.bayes, one.bayes);
    result.bayes_studies += one.has_posterior ? 1 : 0;
    slopes.push_back(one.slope);
  }
  result.mean_trials /= static_cast<double>(count);
  if (slopes.empty()) return result;
  const auto middle = slopes.begin() + static_cast<std::ptrdiff_t>(slopes.size() / 2);
  std::nth_element(slopes.begin(), middle, slopes.end());
  result.slope_bias = *middle / design.truth.parameters.slope - 1;
  return result;
}

}  // namespace

Interval coverage_interval(std::size_t held, std::size_t studies) {
  return wilson_interval(held, studies);
}

std::vector<CoverageDesign> coverage_designs(const std::vector<double>& lapses) {
  std::vector<CoverageDesign> designs;
  for (const auto add_designs : {add_two_sided, add_forced_choice, add_yes_no}) {
    for (const double lapse : lapses) add_designs(designs, lapse);
  }
  return designs;
}

std::vector<CoverageResult> interval_coverage(const CoverageSettings& settings) {
  const std::vector<CoverageDesign> designs = coverage_designs(settings.lapses);
  const std::size_t all = designs.size() * settings.studies;
  std::vector<CoverageStudy> studies(all);
  do_jobs(
      all, settings.jobs,
      [&](std::size_t i) {
        const std::size_t design = i / settings.studies;
        studies[i] = one_study(designs[design], settings.seed, design, i % settings.studies,
                               settings.simulations);
      },
      settings.progress);
  std::vector<CoverageResult> results;
  for (std::size_t i = 0; i < designs.size(); ++i)
    results.push_back(result_of(designs[i], &studies[i * settings.studies], settings.studies));
  return results;
}

}  // namespace palpate::analysis
