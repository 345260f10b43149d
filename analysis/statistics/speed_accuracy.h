#pragma once
// Speed-accuracy trade-off: change of accuracy and change of time.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "analysis/input/trials.h"
#include "analysis/statistics/describe.h"
#include "analysis/statistics/paired.h"

namespace palpate::analysis {

/// Changes of one shape, renderer minus reference. Accuracies are proportions, 0 to 1.
struct SpeedAccuracy {
  std::optional<double> percent_change_time;  ///< of the geometric mean; negative: faster
  std::optional<double> accuracy_reference, accuracy_renderer;  ///< means over participants
  std::optional<double> accuracy_change;  ///< mean over participants with trials of both
  std::size_t n_pairs = 0;                ///< participants with trials of both
  TTest test;                             ///< of the changes; log_ratio_ci95 is of accuracy_change
  /// "trade-off possible", "no trade-off", or empty: undefined.
  std::string reading;
};

/// One for each of table.shapes. \param shapes comparison of times of the same pair
std::vector<SpeedAccuracy> speed_accuracy(const TrialTable& table, const Description& description,
                                          const RendererPair& pair,
                                          const std::vector<PairedShape>& shapes);

}  // namespace palpate::analysis
