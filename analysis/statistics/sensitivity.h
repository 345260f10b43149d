#pragma once
// What an output depends on, over the points of a sweep: Sobol indices of Saltelli's samples, and
// rank correlations of any other design.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "analysis/statistics/paired.h"

namespace palpate::analysis {

/// Parts of the output's variance over the space. Estimates scatter: one may be below 0 or above 1.
struct SobolIndex {
  std::optional<double> first;  ///< by the parameter alone
  std::optional<double> total;  ///< by it together with others as well
  std::optional<Interval> first_ci95, total_ci95;
};

struct SobolIndices {
  std::string undefined;        ///< why there are none; empty: there are
  std::size_t base_points = 0;  ///< used: those whose outputs are all defined
  std::size_t dropped = 0;      ///< the others
  double variance = 0;          ///< of the output
  std::vector<SobolIndex> of;   ///< of each parameter
};

/// Outputs at the samples of Saltelli et al. (2010, Comput. Phys. Commun. 181, 259-270): for each
/// base point f(A), f(B), then f(A with parameter i of B) for each i. First order by their eq. (b)
/// of table 2 on outputs less their mean, total by eq. (f), Jansen's (1999). Intervals: percentiles
/// of `resamples` bootstrap samples of base points. \param outputs  base points times (parameters +
/// 2), not a number where undefined
SobolIndices sobol_indices(const std::vector<double>& outputs, std::size_t parameters,
                           std::uint64_t seed, std::size_t resamples = 1000);

struct RankCorrelation {
  std::string undefined;  ///< why there is none; empty: there are
  std::optional<double> spearman;
  std::optional<Interval> spearman_ci95;  ///< Fisher's z with the error of Bonett & Wright (2000)
  /// Of what the other parameters do not explain linearly of both ranks.
  std::optional<double> partial;
  std::optional<Interval> partial_ci95;  ///< Fisher's z, n - parameters - 2 degrees of freedom
};

/// \param inputs  [parameter][point] \param output  [point]; not a number: the point is left out
/// \return of each parameter
std::vector<RankCorrelation> rank_correlations(const std::vector<std::vector<double>>& inputs,
                                               const std::vector<double>& output);

/// From 1; ties have the mean of their ranks.
std::vector<double> midranks(const std::vector<double>& values);

/// Wilson's (1927) 95 % interval of a proportion; n > 0.
Interval wilson_interval(std::size_t successes, std::size_t n);

/// Of sorted values, interpolated (type 7 of Hyndman & Fan 1996); not empty.
double sorted_quantile(const std::vector<double>& sorted, double share);

}  // namespace palpate::analysis
