#pragma once
// Evidence of a paired t-test for the absence of a difference: equivalence within given bounds, and
// the Bayes factor of Rouder et al. (2009).

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "analysis/statistics/paired.h"

namespace palpate::analysis {

/// Two one-sided t-tests against -bound and +bound (Schuirmann 1987). Equivalent with p < 0.05: the
/// 90 % interval lies within the bounds.
struct Equivalence {
  std::string undefined;
  std::optional<double> bound, p;       ///< the larger p of both tests
  std::optional<double> p_low, p_high;  ///< against -bound, +bound
  std::optional<Interval> ci90;         ///< needs no bound
};

/// \param bound  > 0, on the scale of the differences
Equivalence equivalence(const std::vector<double>& differences, double bound);

/// Evidence for a difference over none, from t of n pairs: effect sizes have a Cauchy prior of
/// scale sqrt(1/2) ("JZS"; Rouder et al. 2009, eq. 1, with the scale of R's BayesFactor).
double jzs_bayes_factor(double t, std::size_t n);
/// With fewer pairs it is above 1/3 even at t = 0: it can never support "no difference".
inline constexpr std::size_t kLeastForBayes = 9;

/// The evidence of a paired t-test for no difference.
struct PairedEvidence {
  std::optional<Interval> ci90;
  /// The least bound with which two one-sided tests at 5 % show equivalence.
  std::optional<double> least_bound;
  std::optional<double> bayes_factor;  ///< for a difference over none
};

/// \param mean  of the differences \param test  of them
PairedEvidence evidence_of(double mean, const TTest& test);

}  // namespace palpate::analysis
