#pragma once
// Cells of a study from its single log times.

#include <cmath>
#include <cstddef>
#include <vector>

#include "analysis/statistics/describe.h"

namespace palpate::analysis {

/// \param logs  [condition][shape][participant], of each its log times
inline ParticipantCells cells_of_times(
    const std::vector<std::vector<std::vector<std::vector<double>>>>& logs) {
  ParticipantCells out;
  for (const auto& condition : logs) {
    auto& shapes = out.emplace_back();
    for (const auto& shape : condition) {
      auto& people = shapes.emplace_back();
      for (const std::vector<double>& own : shape) {
        ParticipantCell& cell = people.emplace_back();
        cell.n_trials = cell.n_correct = cell.n_used = own.size();
        if (own.empty()) continue;
        cell.mean_log = mean(own);
        for (const double log : own) cell.sum_of_squares_log += std::pow(log - cell.mean_log, 2);
      }
    }
  }
  return out;
}

}  // namespace palpate::analysis
