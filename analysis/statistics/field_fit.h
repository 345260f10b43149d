#pragma once
// Psychometric functions of several dimensions fitted by maximum likelihood, with intervals by the
// profile likelihood, and a test of their form.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "analysis/statistics/psychometric_fit.h"
#include "protocols/procedures/procedure_spec.h"

namespace palpate::analysis {

/// Answers at one point.
struct PointCount {
  protocols::LevelPoint point;
  int trials = 0, successes = 0;
};

/// Sums the trials of equal points, in their order.
std::vector<PointCount> sum_by_point(std::vector<PointCount> counts);

struct FieldModel {
  protocols::FieldFunction function;
  /// Forms without two lapses: the guess rate, constant or free from 0 to 0.5. Catch trials are
  /// answers by it.
  RateModel guess{0, false, 0.5};
  int catch_trials = 0, catch_successes = 0;
  /// weber, power: the standard at which the JND is given; none: the median of those shown.
  std::optional<double> middle = std::nullopt;
};

/// A value with its 95 % profile interval: where twice the loss of log likelihood is the 0.95
/// quantile of chi squared with one degree of freedom. An end is infinite, or the end of what the
/// parameter can be, if the data exclude no value on that side.
struct FieldParameter {
  std::string name;  ///< "w", "c", ..., "guess", "lapse"; "jnd"
  double value = 0;
  Interval ci95;
  bool closed = false;  ///< both ends are excluded by the data
};

/// Whether the form holds: the same function with a free location at every value of the other
/// dimension (weber, power: a JND at every standard; threshold forms: a threshold at every x2;
/// cues: a shift at every conflict), by the likelihood ratio.
struct FieldMisfit {
  struct Place {
    double at = 0;  ///< the other dimension
    int trials = 0;
    double free = 0, fitted = 0;  ///< JND in its unit, threshold on the scale of x1, shift
  };
  std::string undefined;  ///< reason; empty: tested
  double deviance = 0;    ///< twice the gain of log likelihood
  int df = 0;             ///< locations beyond the form's own parameters of them
  double p = 1;           ///< chi squared
  std::vector<Place> places;
};

struct FieldFit {
  std::string undefined;                   ///< reason if there is no fit; empty: fitted
  std::vector<FieldParameter> parameters;  ///< the form's, then a free guess, then the lapse
  /// weber, power: the JND at `middle`, which is determined better than w and c, or w and a, alone.
  /// weber: where w adds less than 2 % to it, w is not told from 0, nor c from infinity.
  std::optional<FieldParameter> jnd;
  double middle = 0;  ///< of the model
  double guess = 0, lapse = 0;
  double log_likelihood = 0;
  int trials = 0;
  FieldMisfit misfit;

  /// The form's parameters, as its functions take them.
  std::vector<double> values(protocols::FieldForm form) const;
};

/// The most places at which a form is tested, and the fewest trials at each.
inline constexpr std::size_t kMostMisfitPlaces = 12;
inline constexpr int kFewestMisfitTrials = 5;

FieldFit fit_field(const std::vector<PointCount>& counts, const FieldModel& model);

}  // namespace palpate::analysis
