#pragma once
// Thresholds (or PSEs, JNDs, slopes) of the same participants under several conditions.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "analysis/statistics/paired.h"

namespace palpate::analysis {

/// A figure of a participant under a condition, on the scale of the comparison: take logarithms of
/// what is compared as a ratio.
struct ParticipantFigure {
  std::size_t participant = 0, condition = 0;
  double value = 0;
};

/// A condition less the first one.
struct ConditionDifference {
  std::size_t condition = 0;
  /// Over participants with both.
  std::size_t n_pairs = 0;
  double mean = 0;
  TTest t_test;  ///< its interval is one of the difference; p_holm over the conditions
  EffectSize effect_size;
  /// From the mixed model, which also uses participants who lack one of the two.
  std::optional<double> mixed_estimate, mixed_se;
};

struct ThresholdComparison {
  std::string undefined;
  std::vector<ConditionDifference> differences;
  /// value ~ condition + (1 | participant), REML.
  std::optional<double> participant_sd, residual_sd;
};

/// \param conditions  how many there are; each participant at most one value in each
ThresholdComparison compare_thresholds(const std::vector<ParticipantFigure>& figures,
                                       std::size_t conditions);

}  // namespace palpate::analysis
