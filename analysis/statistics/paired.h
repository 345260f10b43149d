#pragma once
// Is a shape identified faster with one renderer than with another? Differences over participants,
// always renderer minus reference (ray minus point) on the natural log scale: negative when the
// renderer is faster. Percent reductions are then positive.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "analysis/input/renderers.h"
#include "analysis/input/trials.h"
#include "analysis/statistics/describe.h"

namespace palpate::stimuli {
class Random;
}

namespace palpate::analysis {

/// Ends of a 95 % interval. Of log ratios, or of the percent reductions they stand for.
struct Interval {
  double low = 0, high = 0;
};

/// 100 (1 - exp m), in percent.
double percent_reduction(double log_ratio);
/// The same interval as percent reductions: the ends swap.
Interval percent_reduction(const Interval& log_ratio);

/// In each of these `undefined` says in words why something is missing; empty: all is there.
struct TTest {
  std::string undefined;
  std::optional<double> sd, se, t, df, p;  ///< p two-sided
  std::optional<Interval> log_ratio_ci95;
  std::optional<double> p_holm;  ///< over the shapes and comparisons with a p
};
/// Student's paired t-test on differences.
TTest t_test(const std::vector<double>& differences);

struct EffectSize {
  std::string undefined;
  std::optional<double> dz, hedges_gz;
};
/// dz = mean / sd; Hedges' gz = J dz, J exact (Hedges 1981, eq. 6e).
EffectSize effect_size(const std::vector<double>& differences);

struct Wilcoxon {
  std::string undefined;
  std::size_t n_nonzero = 0;
  std::optional<double> positive_rank_sum;  ///< V
  std::optional<double> p;                  ///< two-sided
  bool exact = true;                        ///< false: normal approximation, beyond kExactWilcoxon
};
/// Pairs up to which Wilcoxon's p is exact.
constexpr std::size_t kExactWilcoxon = 500;
/// Signed-rank test: zeros dropped, midranks for ties, p from all 2^n signs. Differences that
/// agree up to rounding (1e-10) are ties, as they are zeros.
Wilcoxon wilcoxon(const std::vector<double>& differences);

struct Bootstrap {
  std::string undefined;
  std::size_t resamples = 0;
  std::uint64_t seed = 0;
  std::optional<double> bias_correction, acceleration;  ///< z0 and a
  std::optional<Interval> log_ratio_ci95;
};
constexpr std::size_t kResamples = 9999;
/// How often BCa's 95 % interval holds the mean of so many normal differences; none from 20 on,
/// where it comes close, and below 2.
std::optional<double> bca_coverage(std::size_t pairs);
/// BCa interval of the mean (Efron 1987) from `resamples` draws of all participants.
Bootstrap bootstrap_mean(const std::vector<double>& differences, stimuli::Random& random,
                         std::size_t resamples = kResamples);
/// The part of it after the draws. \param means of the resamples; reorders
Bootstrap bca_interval(const std::vector<double>& differences, std::vector<double>& means);

/// Holm's (1979) adjustment over those that have a p.
std::vector<std::optional<double>> holm(const std::vector<std::optional<double>>& p);

/// A participant who has trials of a shape but no time for it in one renderer of the pair or both.
struct Dropped {
  std::size_t participant = 0;         ///< index into TrialTable::participants
  std::vector<std::string> renderers;  ///< without a usable time
};

struct PairedShape {
  std::size_t n_pairs = 0;
  std::string undefined;  ///< why there are no pairs
  std::vector<double> differences;
  std::optional<double> percent_reduction_arithmetic;
  std::optional<double> mean_log_ratio, percent_reduction_geometric;
  TTest t_test;
  EffectSize effect_size;
  Wilcoxon wilcoxon;
  Bootstrap bootstrap;
  std::vector<Dropped> dropped;
};

/// One for each of table.shapes, still without `bootstrap` and `t_test.p_holm`.
std::vector<PairedShape> compare_by_shape(const TrialTable& table, const Description& description,
                                          const RendererPair& pair);
/// Each has its own stream of the seed, by its number.
void bootstrap_all(const std::vector<PairedShape*>& tests, std::uint64_t seed);
/// Holm's adjustment over all of them.
void adjust_all(const std::vector<PairedShape*>& tests);

}  // namespace palpate::analysis
