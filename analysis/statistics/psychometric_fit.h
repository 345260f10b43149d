#pragma once
// Psychometric functions fitted by maximum likelihood, with intervals by the profile likelihood and
// the deviance as goodness of fit.

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "analysis/statistics/paired.h"
#include "protocols/procedures/psychometric.h"

namespace palpate::analysis {

/// Half the 95 % quantile of chi-squared with one degree of freedom: differences of log-likelihood
/// beyond it are significant.
inline constexpr double kHalfChiSquared95 = 0.5 * 3.841458820694124;

struct SimplexMinimum {
  std::vector<double> place;
  double value = 0;
};

/// A local minimum by Nelder & Mead 1965, restarted from its end until a restart gains less than
/// `tolerance`. \param steps initial steps, one per parameter; not 0
SimplexMinimum minimize(const std::function<double(const std::vector<double>&)>& function,
                        const std::vector<double>& start, const std::vector<double>& steps,
                        double tolerance = 1e-11);

/// Answers at one level.
struct LevelCount {
  double level = 0;
  int trials = 0, successes = 0;
};

/// Sums the trials of equal levels, in order of level.
std::vector<LevelCount> sum_by_level(std::vector<LevelCount> counts);

/// The guess or lapse rate: a constant, or free from 0 to `most`.
struct RateModel {
  double value = 0;
  bool free = false;
  double most = 0.1;
};

/// The largest lapse rate that `analyze` fits.
inline constexpr double kMostLapse = 0.06;

struct PsychometricModel {
  protocols::PsychometricFunction function;
  RateModel guess, lapse;
  /// Both asymptotes are lapses, for levels on both sides of a standard: a key pressed by chance
  /// raises the lower asymptote by as much as it lowers the upper one. The guess rate equals the
  /// lapse rate, and `guess` is not used.
  bool guess_is_lapse = false;

  bool guess_is_free() const { return guess.free && !guess_is_lapse; }
};

struct PsychometricFit {
  std::string undefined;  ///< reason if there is no fit; empty: fitted
  protocols::PsychometricParameters parameters;
  double log_likelihood = 0;  ///< of the answers in their order: without binomial coefficients
  int trials = 0;
  /// 95 %: where twice the loss of profile log likelihood is the 0.95 quantile of chi squared with
  /// one degree of freedom. An end is infinite (threshold: +-infinity, or 0 and infinity if levels
  /// are above 0) if the data exclude no value on that side.
  Interval threshold_ci95, slope_ci95;
  /// The same; an end of a free rate is 0 or its maximum if no value on that side is excluded. A
  /// constant: both ends equal it. One rate for both asymptotes has one interval.
  Interval guess_ci95, lapse_ci95;
  bool slope_at_bound =
      false;  ///< perfect separation between two neighbouring levels: no slope is too steep
};

PsychometricFit fit_psychometric(const std::vector<LevelCount>& counts,
                                 const PsychometricModel& model);

/// The same without intervals, by a quicker search, for simulations.
PsychometricFit quick_fit(const std::vector<LevelCount>& counts, const PsychometricModel& model);

/// Deviance from the saturated model and its rank among refitted simulations.
struct GoodnessOfFit {
  double deviance = 0;
  int levels = 0;
  /// (1 + number at least as large) / (1 + simulations); deviances within 2e-4 count as equal.
  std::optional<double> p;
  int simulations = 0;
};

/// \param simulations  0: without p
GoodnessOfFit goodness_of_fit(const std::vector<LevelCount>& counts, const PsychometricModel& model,
                              const PsychometricFit& fit, int simulations, std::uint64_t seed);

/// Posterior of a psychometric function on a grid. Priors: threshold uniform on the scale over the
/// levels and half their range beyond on both sides, but not below 0 if all levels are above 0; log
/// slope uniform over the range that the levels can resolve; free rates with density 10 (1 -
/// rate)^9 up to their largest value (Schuett et al. 2016); one rate for both asymptotes has that
/// density once.
struct PsychometricPosterior {
  std::string undefined;
  protocols::PsychometricParameters mean;  ///< threshold: mean on the scale; slope: mean of the log
  double threshold_scale_sd = 0;
  Interval threshold_ci95, slope_ci95;  ///< central
  Interval guess_ci95, lapse_ci95;      ///< of a constant: both ends equal it
};

PsychometricPosterior psychometric_posterior(const std::vector<LevelCount>& counts,
                                             const PsychometricModel& model);

}  // namespace palpate::analysis
