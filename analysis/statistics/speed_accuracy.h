#pragma once
// Is speed bought with errors?

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "analysis/input/trials.h"
#include "analysis/statistics/describe.h"
#include "analysis/statistics/paired.h"

namespace palpate::analysis {

/// Change of accuracy beside the change of time, renderer minus reference. Shares, 0 to 1.
struct SpeedAccuracy {
  std::optional<double> percent_change_time;  ///< of the geometric mean; negative: faster
  std::optional<double> accuracy_reference, accuracy_renderer;  ///< means of participants'
  std::optional<double> accuracy_change;  ///< mean over participants with trials of both
  std::size_t n_pairs = 0;                ///< of them
  TTest test;                             ///< of the changes; log_ratio_ci95 is of accuracy_change
  /// "trade-off possible", "no trade-off", or empty where it cannot be said.
  std::string reading;
};

/// One for each of table.shapes. \param shapes the times of the same pair
std::vector<SpeedAccuracy> speed_accuracy(const TrialTable& table, const Description& description,
                                          const RendererPair& pair,
                                          const std::vector<PairedShape>& shapes);

}  // namespace palpate::analysis
