#pragma once
// Paired comparison of two renderers for each shape. Differences are participants' mean log times
// with the renderer minus with the reference (ray minus point), natural logs: negative if the
// renderer is faster. The percent reduction of a mean difference m is 100 (1 - exp m): positive if
// the renderer is faster.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "analysis/input/trials.h"
#include "analysis/statistics/describe.h"

namespace palpate {
class Random;
}

namespace palpate::analysis {

/// Of every test, two-sided.
inline constexpr double kAlpha = 0.05;

/// 95 % confidence interval, of log ratios or of percent reductions.
struct Interval {
  double low = 0, high = 0;
};

/// 100 (1 - exp m), in percent.
double percent_reduction(double log_ratio);
/// The interval as percent reductions; low and high swap.
Interval percent_reduction(const Interval& log_ratio);

/// Result of a t-test. Here and below `undefined` is the reason for missing values; empty: all are
/// defined.
struct TTest {
  std::string undefined;
  std::optional<double> sd, se, t, df, p;  ///< p is two-sided
  std::optional<Interval> log_ratio_ci95;
  std::optional<double> p_holm;  ///< Holm-adjusted over all shapes and comparisons with a p
};
/// Student's t-test of differences against 0: t = mean / (sd / sqrt(n)), df = n - 1.
TTest t_test(const std::vector<double>& differences);

/// Standardised mean difference of pairs.
struct EffectSize {
  std::string undefined;
  std::optional<double> dz, hedges_gz;
};
/// dz = mean / sd; Hedges' gz = J dz, J exact (Hedges 1981, eq. 6e).
EffectSize effect_size(const std::vector<double>& differences);

/// Result of the signed-rank test.
struct Wilcoxon {
  std::string undefined;
  std::size_t n_nonzero = 0;
  std::optional<double> positive_rank_sum;  ///< V, as named in R
  std::optional<double> p;                  ///< two-sided
  bool exact = true;                        ///< false: normal approximation, beyond kExactWilcoxon
};
/// Largest number of pairs with an exact Wilcoxon p.
constexpr std::size_t kExactWilcoxon = 500;
/// Wilcoxon signed-rank test: zeros dropped, midranks for ties, exact p from the distribution over
/// all 2^n signs. Differences within rounding (1e-10) of each other are ties, of 0 are zeros.
Wilcoxon wilcoxon(const std::vector<double>& differences);

/// BCa bootstrap interval of a mean.
struct Bootstrap {
  std::string undefined;
  std::size_t resamples = 0;
  std::uint64_t seed = 0;
  std::optional<double> bias_correction, acceleration;  ///< z0 and a of Efron (1987)
  std::optional<Interval> log_ratio_ci95;
};
constexpr std::size_t kResamples = 9999;
/// Coverage of the 95 % BCa interval for the mean of normal differences; none from 20 pairs on
/// (near 0.95) and below 2.
std::optional<double> bca_coverage(std::size_t pairs);
/// BCa interval of the mean (Efron 1987) from `resamples` resamples of the participants.
Bootstrap bootstrap_mean(const std::vector<double>& differences, Random& random,
                         std::size_t resamples = kResamples);
/// The interval from the resamples' means. \param means reordered
Bootstrap bca_interval(const std::vector<double>& differences, std::vector<double>& means);

/// p values adjusted (Holm 1979) over the defined ones.
std::vector<std::optional<double>> holm(const std::vector<std::optional<double>>& p);

/// A participant with trials of a shape, but without a usable time with one or both renderers of
/// the pair.
struct DroppedParticipant {
  std::size_t participant = 0;         ///< index into TrialTable::participants
  std::vector<std::string> renderers;  ///< those without a usable time
};

/// Comparison of a pair of renderers for one shape.
struct PairedShape {
  std::size_t n_pairs = 0;
  std::string undefined;            ///< reason if there are no pairs
  std::vector<double> differences;  ///< of mean log times, one for each pair
  std::optional<double> percent_reduction_arithmetic;
  std::optional<double> mean_log_ratio, percent_reduction_geometric;
  TTest t_test;
  EffectSize effect_size;
  Wilcoxon wilcoxon;
  Bootstrap bootstrap;
  std::vector<DroppedParticipant> dropped;
};

/// Compares each of table.shapes; leaves out `bootstrap` and `t_test.p_holm`.
std::vector<PairedShape> compare_by_shape(const TrialTable& table, const Description& description,
                                          const RendererPair& pair);
/// Sets `bootstrap` of each. Random stream i of the seed is that of tests[i].
void bootstrap_all(const std::vector<PairedShape*>& tests, std::uint64_t seed);
/// Sets `t_test.p_holm` by Holm's adjustment over all.
void adjust_all(const std::vector<PairedShape*>& tests);

}  // namespace palpate::analysis
