#pragma once
// The group's d' and criterion from all answers at once (see group_model.h): counts need no
// correction, and a participant without errors says "at least", not "infinite".

#include <cstddef>
#include <vector>

#include "analysis/statistics/discrimination.h"
#include "analysis/statistics/group_model.h"

namespace palpate::analysis {

/// d' (first coordinate) and criterion (second): hits Phi(d'/2 - c), false alarms Phi(-d'/2 - c).
/// \param counts  [condition][participant]; without trials of both kinds: no trials
GroupData group_detection_data(const std::vector<std::vector<DetectionCounts>>& counts);

/// Correct answers of a forced choice.
struct ForcedChoiceCounts {
  int trials = 0, correct = 0;
};

/// d' alone. \param counts  [condition][participant] \param alternatives  2 or more
GroupData group_forced_choice_data(const std::vector<std::vector<ForcedChoiceCounts>>& counts,
                                   int alternatives);

}  // namespace palpate::analysis
