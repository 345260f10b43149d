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

struct SimplexMinimum {
  std::vector<double> place;
  double value = 0;
};

/// A local minimum by Nelder & Mead 1965, begun again from where it ends until that gains less than
/// `tolerance`. \param steps  first steps, one a parameter; not 0
SimplexMinimum minimize(const std::function<double(const std::vector<double>&)>& function,
                        const std::vector<double>& start, const std::vector<double>& steps,
                        double tolerance = 1e-11);

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

// The likelihood that the fits of psychometric functions share.

/// Counts with their levels' places on the scale.
struct PlacedCount {
  double place = 0;
  double trials = 0, successes = 0;
};

struct PlacedData {
  std::vector<PlacedCount> counts;
  std::vector<double> places;  ///< finite ones, each once, in order
  double low = 0, high = 0;    ///< the first and the last
  double spacing = 0;          ///< smallest distance of two places; 0: one place only
  /// No threshold is below: 0 on a linear scale of levels that are all above 0, as those of sizes
  /// and stiffnesses are; else -infinity.
  double least = -std::numeric_limits<double>::infinity();

  /// Slopes beyond are flat or a step, as far as these levels can tell.
  double least_log_slope() const;
  double most_log_slope() const;
};

PlacedData place_counts(const std::vector<LevelCount>& counts,
                        const protocols::PsychometricFunction& function);

/// Natural logarithm. \param threshold on the scale
double psychometric_log_likelihood(const PlacedData& data,
                                   const protocols::PsychometricFunction& function,
                                   double threshold, double slope, double guess, double lapse);

// What a fit of a psychometric function makes as small as it can be, and how it looks for that.

/// How a minimum is looked for: a grid, from whose best places searches begin.
struct PsychometricSearch {
  int thresholds = 21, slopes = 19;
  std::size_t starts = 4;
};
/// Of a fit, and of the refits of simulations.
inline constexpr PsychometricSearch kWholeSearch{}, kQuickSearch{11, 9, 1};

enum class PsychometricRate { guess, lapse };

/// Minus log likelihood over (threshold on the scale, log slope, free rates), one of them held or
/// none. A free rate is most sin^2(x): never outside 0 .. most.
class PsychometricObjective {
 public:
  /// Both must outlive it. One rate at both ends is the lapse rate: hold that.
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

  /// The best point from a start, whose places are those of point() that are not held.
  SimplexMinimum best_from(const std::vector<double>& start, double step, double tolerance) const;
  /// The best point from the best starts of a grid: the likelihood may have several maxima.
  SimplexMinimum best(const PsychometricSearch& search, double tolerance) const;
  /// With a parameter held: the best place of a grid, if that is far from `place`.
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
/// levels and half their range beyond on both sides, but not below 0 where all levels are above;
/// log slope uniform over all that the levels can
/// tell apart; free rates with density 10 (1 - rate)^9 up to their largest value (Schuett et al.
/// 2016); one rate at both ends has that density once.
struct PsychometricPosterior {
  std::string undefined;
  protocols::PsychometricParameters mean;  ///< threshold and slope: means on the scale, of the log
  double threshold_scale_sd = 0;
  Interval threshold_ci95, slope_ci95;  ///< central
  Interval guess_ci95, lapse_ci95;      ///< of a constant: both ends are it
};

PsychometricPosterior psychometric_posterior(const std::vector<LevelCount>& counts,
                                             const PsychometricModel& model);

}  // namespace palpate::analysis
