#pragma once
// Trials that ended at the limit: who and where. Their times are not known, only that they are
// longer than the limit.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "analysis/input/trials.h"
#include "analysis/statistics/describe.h"

namespace palpate::analysis {

/// Time-outs of one participant in one cell that share a limit.
struct TimeOutGroup {
  std::uint32_t participant = 0;
  double limit = 0;  ///< s; not above 0, or not finite: not known
  std::size_t n = 0;

  bool has_limit() const;
};

struct TimeOutCell {
  std::size_t n_trials = 0, n_timeouts = 0;
  std::vector<TimeOutGroup> groups;    ///< by participant, then limit
  std::optional<std::size_t> most_in;  ///< participant with the largest share; none: no time-out
  double largest_share = 0;            ///< of that participant's trials
  std::optional<double> lowest_limit, highest_limit;  ///< s; none: no time-out with a known one

  double share() const;  ///< of n_trials; 0 without trials
};

struct TimeOuts {
  bool any = false;
  std::vector<std::vector<TimeOutCell>> cells;  ///< [renderer][shape]
};

TimeOuts time_outs(const TrialTable& table, const Description& description);

}  // namespace palpate::analysis
