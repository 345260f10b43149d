#include "analysis/statistics/time_outs.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace palpate::analysis {

bool TimeOutGroup::has_limit() const { return std::isfinite(limit) && limit > 0; }

double TimeOutCell::proportion() const {
  return n_trials == 0 ? 0 : static_cast<double>(n_timeouts) / static_cast<double>(n_trials);
}

namespace {

void find_most_affected(const std::vector<ParticipantCell>& participants, TimeOutCell& cell) {
  std::map<std::size_t, std::size_t> by_participant;
  for (const TimeOutGroup& group : cell.groups) {
    by_participant[group.participant] += group.n;
    if (!group.has_limit()) continue;
    cell.lowest_limit = std::min(cell.lowest_limit.value_or(group.limit), group.limit);
    cell.highest_limit = std::max(cell.highest_limit.value_or(group.limit), group.limit);
  }
  for (const auto& [participant, n] : by_participant) {
    const double proportion =
        static_cast<double>(n) / static_cast<double>(participants[participant].n_trials);
    if (cell.most_affected && proportion <= cell.largest_proportion) continue;
    cell.most_affected = participant;
    cell.largest_proportion = proportion;
  }
}

}  // namespace

TimeOuts time_outs(const TrialTable& table, const Description& description) {
  TimeOuts out;
  const std::size_t n_shapes = table.shapes.size();
  out.cells.assign(table.renderers.size(), std::vector<TimeOutCell>(n_shapes));
  using ParticipantAndLimit = std::pair<std::uint32_t, double>;  // participant and limit
  std::vector<std::map<ParticipantAndLimit, std::size_t>> counts(table.renderers.size() * n_shapes);
  for (const TrialRow& row : table.rows) {
    if (!row.timed_out) continue;
    // NaN would break the ordering of the map.
    const double limit = std::isfinite(row.response_time) ? row.response_time : 0;
    ++counts[row.renderer * n_shapes + row.shape][{row.participant, limit}];
  }
  for (std::size_t r = 0; r < out.cells.size(); ++r) {
    for (std::size_t s = 0; s < n_shapes; ++s) {
      TimeOutCell& cell = out.cells[r][s];
      cell.n_trials = description.accuracy[r][s].n_trials;
      for (const auto& [key, n] : counts[r * n_shapes + s]) {
        cell.groups.push_back({key.first, key.second, n});
        cell.n_timeouts += n;
      }
      out.any = out.any || cell.n_timeouts > 0;
      find_most_affected(description.participant_cells[r][s], cell);
    }
  }
  return out;
}

}  // namespace palpate::analysis
