#pragma once
// Dependence of an output on parameters, over the points of a sweep: Sobol indices of Saltelli's
// samples, and rank correlations of any other design.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "analysis/statistics/paired.h"

namespace palpate::analysis {

/// Shares of the output's variance over the space. Estimates have sampling error and may be below 0
/// or above 1.
struct SobolIndex {
  std::optional<double> first;  ///< of the parameter alone
  std::optional<double> total;  ///< of the parameter, alone and together with others
  std::optional<Interval> first_ci95, total_ci95;
};

struct SobolIndices {
  std::string undefined;        ///< reason if there are none; empty: there are
  std::size_t base_points = 0;  ///< used: with an output at each of their samples
  std::size_t dropped = 0;      ///< the others
  double variance = 0;          ///< of the output, including chance, in its squared units
  /// Share of the variance due to chance: the mean squared standard error, excluded from the total
  /// indices. None: no standard errors, so every total index includes chance.
  std::optional<double> noise_share;
  std::vector<SobolIndex> of;  ///< of each parameter
};

/// From Saltelli's samples (Saltelli et al. 2010, Comput. Phys. Commun. 181, 259-270): for each
/// base point f(A), f(B), then f(A with parameter i of B) for each i. First order by their eq. (b)
/// of table 2 on outputs minus their mean, total by eq. (f), Jansen (1999). An output may be an
/// estimate with its own error in each sample: this adds its variance to Jansen's half mean square,
/// so the mean squared standard error is subtracted. Intervals: percentiles of `resamples`
/// bootstrap samples of base points. \param outputs  base points times (parameters + 2), not a
/// number where undefined \param errors  standard errors of the outputs, not a number where
/// unknown; empty: all are
SobolIndices sobol_indices(const std::vector<double>& outputs, const std::vector<double>& errors,
                           std::size_t parameters, std::uint64_t seed,
                           std::size_t resamples = 1000);

struct RankCorrelation {
  std::string undefined;  ///< reason if there is none; empty: there is one
  std::optional<double> spearman;
  std::optional<double> partial;  ///< of the ranks' residuals from regression on the others' ranks
  /// By Fisher's z with the error of Bonett & Wright (2000, Psychometrika 65, 23-28),
  /// sqrt((1 + r^2 / 2) / (n - h - 3)); h: parameters held constant.
  std::optional<Interval> spearman_ci95, partial_ci95;
};

/// \param inputs  [parameter][point] \param output  [point]; not a number: the point is left out
/// \return of each parameter
std::vector<RankCorrelation> rank_correlations(const std::vector<std::vector<double>>& inputs,
                                               const std::vector<double>& output);

/// Wilson's (1927) 95 % interval of a proportion of independent trials. \param n > 0
Interval wilson_interval(std::size_t successes, std::size_t n);

}  // namespace palpate::analysis
