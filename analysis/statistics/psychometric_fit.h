#pragma once
// Psychometric functions fitted by maximum likelihood, with intervals by the profile likelihood and
// the deviance as goodness of fit.

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "analysis/statistics/paired.h"
#include "protocols/procedures/psychometric.h"

namespace palpate::analysis {

/// Answers at one level.
struct LevelCount {
  double level = 0;
  int trials = 0, successes = 0;
};

/// Sums the trials of equal levels; in order of level.
std::vector<LevelCount> sum_by_level(std::vector<LevelCount> counts);

/// The guess or lapse rate: a constant, or free from 0 to `most`.
struct RateModel {
  double value = 0;
  bool free = false;
  double most = 0.1;
};

/// The largest lapse rate that `analyze` looks for.
inline constexpr double kMostLapse = 0.06;

struct PsychometricModel {
  protocols::PsychometricFunction function;
  RateModel guess, lapse;
  /// Both ends are lapses, as where levels lie on both sides of a standard: a key pressed by chance
  /// lifts the lower end by as much as it lowers the upper one. The guess rate is the lapse rate,
  /// and `guess` is not used.
  bool guess_is_lapse = false;

  bool guess_is_free() const { return guess.free && !guess_is_lapse; }
};

struct PsychometricFit {
  std::string undefined;  ///< why there is no fit; empty: fitted
  protocols::PsychometricParameters parameters;
  double log_likelihood = 0;  ///< of the answers in their order: without binomial coefficients
  int trials = 0;
  /// 95 %, where twice the loss of profile log likelihood is the 0.95 quantile of chi squared with
  /// one degree of freedom. An end is infinite (threshold: +-, or 0 and infinity where levels are
  /// above 0) where the data exclude no value on that side.
  Interval threshold_ci95, slope_ci95;
  /// Likewise; an end of a free rate is 0 or its most where no value on that side is excluded. Of a
  /// constant: both ends are it. One rate at both ends has one interval.
  Interval guess_ci95, lapse_ci95;
  bool slope_at_bound =
      false;  ///< answers change between two levels at once: no slope is too steep
};

PsychometricFit fit_psychometric(const std::vector<LevelCount>& counts,
                                 const PsychometricModel& model);

/// The same without intervals, by a quicker search: for simulations.
PsychometricFit quick_fit(const std::vector<LevelCount>& counts, const PsychometricModel& model);

/// Deviance from the saturated model and its place in the distribution of refitted simulations.
struct GoodnessOfFit {
  double deviance = 0;
  int levels = 0;
  /// (1 + number at least as large) / (1 + simulations); deviances within 2e-4 are equally large.
  std::optional<double> p;
  int simulations = 0;
};

/// \param simulations  0: without p
GoodnessOfFit goodness_of_fit(const std::vector<LevelCount>& counts, const PsychometricModel& model,
                              const PsychometricFit& fit, int simulations, std::uint64_t seed);

}  // namespace palpate::analysis
