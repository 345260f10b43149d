#pragma once
// Psychometric functions fitted by maximum likelihood, with intervals by the profile likelihood and
// the deviance as goodness of fit.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <limits>
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

// The likelihood common to fits of psychometric functions.

/// Counts with the positions of their levels on the scale.
struct PlacedCount {
  double place = 0;
  double trials = 0, successes = 0;
};

struct PlacedData {
  std::vector<PlacedCount> counts;
  std::vector<double> places;  ///< finite ones, distinct, ascending
  double low = 0, high = 0;    ///< the first and the last
  double spacing = 0;          ///< smallest distance of two places; 0: one place only
  /// Lower bound of thresholds: 0 on a linear scale if all levels are above 0, like sizes and
  /// stiffnesses; else -infinity.
  double least = -std::numeric_limits<double>::infinity();

  /// Slopes beyond these bounds are flat or a step at these levels.
  double least_log_slope() const;
  double most_log_slope() const;
};

PlacedData place_counts(const std::vector<LevelCount>& counts,
                        const protocols::PsychometricFunction& function);

// Objective of the fit of a psychometric function, and its search.

/// Search for a minimum: a grid; local searches start from its best points.
struct PsychometricSearch {
  int thresholds = 21, slopes = 19;
  std::size_t starts = 4;
};
/// For a fit, and for the refits of simulations.
inline constexpr PsychometricSearch kWholeSearch{}, kQuickSearch{11, 9, 1};

enum class PsychometricRate { guess, lapse };

/// Minus log likelihood over (threshold on the scale, log slope, free rates), with one or none of
/// them held. A free rate is most sin^2(x), always within 0 .. most.
class PsychometricObjective {
 public:
  /// Both must outlive it. One rate for both asymptotes is the lapse rate: hold that.
  PsychometricObjective(const PlacedData& data, const PsychometricModel& model)
      : data_(data), model_(model) {}

  struct Point {
    double threshold, log_slope, guess, lapse;
  };

  void hold_threshold(std::optional<double> value) { threshold_ = value; }
  void hold_log_slope(std::optional<double> value) { log_slope_ = value; }
  void hold_rate(PsychometricRate rate, std::optional<double> value) {
    (rate == PsychometricRate::guess ? guess_ : lapse_) = value;
  }

  Point point(const std::vector<double>& x) const;
  double operator()(const std::vector<double>& x) const;

  /// The best point from a start, which has the coordinates of point() that are not held.
  SimplexMinimum best_from(const std::vector<double>& start, double step, double tolerance) const;
  /// The best point from the best grid points: the likelihood may have several maxima.
  SimplexMinimum best(const PsychometricSearch& search, double tolerance) const;
  /// With a parameter held: the best point of a grid, if it is far from `place`.
  std::optional<std::vector<double>> other_start(const std::vector<double>& place) const;

 private:
  struct Start {
    double value = 0;
    int threshold = 0, slope = 0;  ///< cell of the grid
    std::vector<double> place;
  };

  std::vector<std::vector<double>> rates_of_grid() const;
  std::vector<Start> starts_of_grid(const PsychometricSearch& search) const;

  const PlacedData& data_;
  const PsychometricModel& model_;
  std::optional<double> threshold_, log_slope_, guess_, lapse_;  ///< held
};

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
