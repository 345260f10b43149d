#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

namespace palpate::analysis {

/// Information that answers transmit about stimuli, bit (Garner & Hake 1951).
struct InformationTransfer {
  std::string undefined;
  std::size_t trials = 0;
  double stimulus_entropy = 0;  ///< plain: what perfect identification would transmit
  std::optional<double> plain;  ///< of the observed shares; too large with few trials
  /// Less the bias to first order, (cells - rows - columns + 1) / (2 n ln 2), with the cells, rows
  /// and columns in which there are trials (Miller 1955, Miller-Madow); at most the stimulus
  /// entropy. May be below 0 where there is no information.
  std::optional<double> corrected;
  /// 2^corrected, at least 1: as many categories, identified without error, transmit as much.
  std::optional<double> categories;
  std::optional<double> se;  ///< jackknife over trials, of the plain figure
};

/// \param counts  [stimulus][answer]; trials without an answer are no part of it
InformationTransfer information_transfer(const std::vector<std::vector<std::size_t>>& counts);

}  // namespace palpate::analysis
