#pragma once
// Analysis of a sweep: share of settings with a pattern, distribution of gains over the space, and
// their drivers.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "analysis/input/sweep_table.h"
#include "analysis/statistics/pattern.h"
#include "analysis/statistics/sensitivity.h"

namespace palpate::analysis {

/// Number of settings with a pattern. Of Saltelli's samples only A and B count: the others share
/// coordinates with them and are not independent.
struct PatternShare {
  std::string expression;
  bool of_the_paper = false;     ///< default pattern of the paper, if its shapes are present
  std::size_t holds = 0, n = 0;  ///< n: counted settings with a defined outcome
  std::size_t undefined = 0;     ///< other counted settings: failed, or a needed figure is missing
  std::optional<double> share;   ///< none: n is 0
  /// Wilson's. None on a grid, as its levels are not a sample of the distributions.
  std::optional<Interval> ci95;
  std::vector<double> at;  ///< for each row, counted or not: 1, 0 or NaN
};

/// A shape's gain over the points, in percent; shares are proportions.
struct Spread {
  std::size_t n = 0;                                ///< points with a defined gain
  std::optional<double> mean, sd, least, greatest;  ///< percent
  std::optional<double> q05, q25, q50, q75, q95;    ///< quantiles, percent
  std::optional<double> share_positive;
  /// Part of the variance due to chance within the points: mean of squared standard errors.
  std::optional<double> noise_share;
};

/// Drivers of one output: Sobol indices with the design saltelli, rank correlations with others.
struct Drivers {
  std::string output;          ///< "gain_cone", "pattern"
  std::vector<double> values;  ///< of each row
  std::optional<SobolIndices> sobol;
  std::vector<RankCorrelation> ranks;
  /// Parameters with a figure, strongest first: by total index, or by size of the partial
  /// correlation (Spearman's if there is none).
  std::vector<std::size_t> strongest;
  /// The key of that order; 0 if there is none.
  double strength(std::size_t parameter) const;
};

struct SweepAnalysis {
  SweepTable table;
  std::string program_version;  ///< of the analysing program
  std::size_t n_failed = 0;
  std::optional<PatternShare> pattern;
  std::vector<Spread> gains;     ///< of each shape
  std::vector<Drivers> drivers;  ///< of each shape's gain, then of the pattern
  std::uint64_t seed = 2000;     ///< of the bootstrap
  std::vector<std::string> notes;
};

/// \throws PatternError
PatternShare pattern_share(const SweepTable& table, const std::string& expression);

/// \param pattern  empty: the paper's, if point and ray are compared with its four shapes. A
/// shape's name denotes its gain (percent), other names denote columns. \throws PatternError
SweepAnalysis analyze_sweep(SweepTable table, const std::string& pattern,
                            const std::string& program_version);

}  // namespace palpate::analysis
