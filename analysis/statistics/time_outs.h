#pragma once
// Trials that ended at the time limit, by cell and participant. Their times are right-censored at
// the limit.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "analysis/input/trials.h"
#include "analysis/statistics/describe.h"

namespace palpate::analysis {

/// Time-outs of one participant in one cell with the same limit.
struct TimeOutGroup {
  std::uint32_t participant = 0;
  double limit = 0;  ///< s; unknown if not finite or not above 0
  std::size_t n = 0;

  bool has_limit() const;
};

/// Time-outs of a renderer and shape.
struct TimeOutCell {
  std::size_t n_trials = 0, n_timeouts = 0;
  std::vector<TimeOutGroup> groups;  ///< by participant, then limit
  std::optional<std::size_t>
      most_affected;              ///< participant with the largest proportion; none: no time-outs
  double largest_proportion = 0;  ///< time-outs of that participant's trials
  std::optional<double> lowest_limit, highest_limit;  ///< s; none: no known limit

  double proportion() const;  ///< of n_trials; 0 without trials
};

/// Time-outs of the study.
struct TimeOuts {
  bool any = false;
  std::vector<std::vector<TimeOutCell>> cells;  ///< [renderer][shape]
};

TimeOuts time_outs(const TrialTable& table, const Description& description);

}  // namespace palpate::analysis
