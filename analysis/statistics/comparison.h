#pragma once
// All comparisons of a renderer with the reference, for each shape.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "analysis/input/trials.h"
#include "analysis/statistics/accuracy_inference.h"
#include "analysis/statistics/censored.h"
#include "analysis/statistics/describe.h"
#include "analysis/statistics/paired.h"

namespace palpate::analysis {

/// Percent reduction of the mean time to identify a shape with the ray, compared with the point:
/// Ho, Basdogan & Srinivasan (2000), fig. 15.
struct PaperEffect {
  std::string_view shape;
  std::optional<double> percent_reduction;  ///< none: the difference was not significant
};

inline constexpr std::array<PaperEffect, 4> kPaperEffects{
    {{"sphere", std::nullopt}, {"cone", 22.0}, {"cylinder", std::nullopt}, {"cube", 11.0}}};

/// \return null for a shape that is not in the paper
constexpr const PaperEffect* find_paper_effect(std::string_view shape) {
  const auto* found = std::ranges::find(kPaperEffects, shape, &PaperEffect::shape);
  return found == kPaperEffects.end() ? nullptr : found;
}

/// Speed-accuracy trade-off: changes of accuracy and time of one shape, renderer minus reference.
/// Accuracies are proportions, 0 to 1.
struct SpeedAccuracy {
  std::optional<double> percent_change_time;  ///< of the geometric mean; negative: faster
  std::optional<double> accuracy_reference, accuracy_renderer;  ///< means over participants
  std::optional<double> accuracy_change;  ///< mean over participants with trials of both
  std::size_t n_pairs = 0;                ///< participants with trials of both
  TTest test;                             ///< of the changes; log_ratio_ci95 is of accuracy_change
  /// "trade-off possible": the interval of the faster renderer's change of accuracy lies below 0.
  /// "none shown": it does not. Empty: undefined.
  std::string reading;
};

/// One for each of table.shapes. \param shapes comparison of times of the same pair
std::vector<SpeedAccuracy> speed_accuracy(const TrialTable& table, const Description& description,
                                          const RendererPair& pair,
                                          const std::vector<PairedShape>& shapes);

/// Results of one pair of renderers.
struct Comparison {
  RendererPair pair;
  std::vector<PairedShape> shapes;            ///< one for each of table.shapes
  std::vector<SpeedAccuracy> speed_accuracy;  ///< likewise
  std::vector<CensoredEstimate> censored;     ///< likewise; empty without time-outs
  AccuracyComparison accuracy;
};

/// Compares each of renderer_pairs(). Holm's adjustment is over all shapes of all comparisons.
/// \param seed of the bootstrap
std::vector<Comparison> compare_renderers(const TrialTable& table, const Description& description,
                                          const TimeOuts& time_outs, std::uint64_t seed);

}  // namespace palpate::analysis
