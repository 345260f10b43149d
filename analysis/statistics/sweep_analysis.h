#pragma once
// What a sweep tells: in how many settings a pattern holds, how gains are spread over the space,
// and what they depend on.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "analysis/input/sweep_table.h"
#include "analysis/statistics/pattern.h"
#include "analysis/statistics/sensitivity.h"

namespace palpate::analysis {

/// In how many settings a pattern holds. Of Saltelli's samples, A and B alone count: the others
/// share coordinates with them, and are no independent settings.
struct PatternShare {
  std::string expression;
  bool of_the_paper = false;     ///< not asked for: the paper's pattern, as there are its shapes
  std::size_t holds = 0, n = 0;  ///< n: settings that count and in which it is defined
  std::size_t undefined = 0;  ///< the others that count: failed, or a figure that it needs is none
  std::optional<double> share;  ///< none: n is 0
  /// Wilson's. None on a grid, whose levels are no sample of the distributions.
  std::optional<Interval> ci95;
  std::vector<double> at;  ///< of each row, whether it counts or not: 1, 0, or not a number
};

/// A shape's gain over the points, in percent; shares are proportions.
struct Spread {
  std::size_t n = 0;                                ///< points where it is defined
  std::optional<double> mean, sd, least, greatest;  ///< percent
  std::optional<double> q05, q25, q50, q75, q95;    ///< quantiles, percent
  std::optional<double> share_positive;
  /// Of the variance, how much is chance within the points: mean of squared standard errors.
  std::optional<double> noise_share;
};

/// What one output depends on: Sobol indices with the design saltelli, rank correlations with
/// others.
struct Drivers {
  std::string output;          ///< "gain_cone", "pattern"
  std::vector<double> values;  ///< of each row
  std::optional<SobolIndices> sobol;
  std::vector<RankCorrelation> ranks;
  /// Parameters with a figure, the strongest first: by total index, or by size of the partial
  /// correlation (Spearman's where there is none).
  std::vector<std::size_t> strongest;
  /// What it is ordered by; 0 where there is none.
  double strength(std::size_t parameter) const;
};

struct SweepAnalysis {
  SweepTable table;
  std::string program_version;  ///< of the program that analyses
  std::size_t n_failed = 0;
  std::optional<PatternShare> pattern;
  std::vector<Spread> gains;     ///< of each shape
  std::vector<Drivers> drivers;  ///< of each shape's gain, then of the pattern
  std::uint64_t seed = 2000;     ///< of the bootstrap
  std::vector<std::string> notes;
};

/// \throws PatternError
PatternShare pattern_share(const SweepTable& table, const std::string& expression);

/// \param pattern  empty: the paper's, where point and ray are compared with its four shapes. In it
/// a shape's name stands for its gain (percent), other names for columns. \throws PatternError
SweepAnalysis analyze_sweep(SweepTable table, const std::string& pattern,
                            const std::string& program_version);

}  // namespace palpate::analysis
