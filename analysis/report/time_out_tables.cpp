#include <cmath>
#include <optional>
#include <string>

#include "analysis/report/table_cells.h"
#include "analysis/report/tables.h"
#include "analysis/statistics/wording.h"
#include "analysis/text.h"

namespace palpate::analysis {

namespace {

std::string share_of(const TimeOutCell& cell) {
  return cell.n_trials == 0 ? kMissing : percent(100 * cell.share());
}

std::string limit_of(const TimeOutCell& cell) {
  if (!cell.lowest_limit) return kMissing;
  const auto seconds = [](double s) { return fixed(s, s == std::floor(s) ? 0 : 2); };
  if (*cell.lowest_limit == *cell.highest_limit) return seconds(*cell.lowest_limit) + " s";
  return seconds(*cell.lowest_limit) + " to " + seconds(*cell.highest_limit) + " s";
}

}  // namespace

Table censored_table(const Analysis& analysis) {
  const RendererPair& first = analysis.comparisons.front().pair;
  Table table = comparison_table(
      analysis,
      "The same with time-outs as times longer than the limit: reduction of response time",
      {"answered only", "with time-outs", "95 % interval", "time-outs " + first.reference,
       several(analysis) ? "own time-outs" : "time-outs " + first.renderer, "people"});
  Reasons reasons;
  for (const Comparison& comparison : analysis.comparisons) {
    for (std::size_t s = 0; s < comparison.censored.size(); ++s) {
      const CensoredEstimate& censored = comparison.censored[s];
      const std::string& name = analysis.table.shapes[s];
      std::optional<double> reduction;
      if (censored.log_ratio) reduction = percent_reduction(*censored.log_ratio);
      auto& row = table.rows.emplace_back(row_names(analysis, comparison.pair, name));
      row.insert(row.end(), {percent(comparison.shapes[s].percent_reduction_geometric),
                             percent(reduction), reduction_interval(censored.log_ratio_ci95),
                             share_of(analysis.time_outs.cells[*comparison.pair.reference_at][s]),
                             share_of(analysis.time_outs.cells[*comparison.pair.renderer_at][s]),
                             std::to_string(censored.n_participants)});
      reasons.add(censored.undefined, listed_shape(analysis, comparison.pair, name));
    }
  }
  table.notes = {
      "A trial that ends at the limit would have taken longer: without it a slow condition looks "
      "faster than it is. Here log time ~ participant + renderer with normal residuals, time-outs "
      "censored at their limit, by maximum likelihood; interval by t from scores summed by "
      "participant. It leans on the log-normal beyond the limit, and stands beside the paired "
      "t-test, "
      "not instead of it; without time-outs and with equally many trials in all cells both are the "
      "same."};
  reasons.put(table.notes);
  return table;
}

Table time_outs_table(const Analysis& analysis) {
  Table table;
  table.caption = caption(analysis, "Time-outs: trials that ended at the limit");
  table.n_names = 2;
  table.header = {"shape", "renderer",          "trials", "time-outs", "share",
                  "limit", "most in one person"};
  for (std::size_t s = 0; s < analysis.table.shapes.size(); ++s) {
    for (std::size_t r = 0; r < analysis.table.renderers.size(); ++r) {
      const TimeOutCell& cell = analysis.time_outs.cells[r][s];
      table.rows.push_back(
          {analysis.table.shapes[s], analysis.table.renderers[r], std::to_string(cell.n_trials),
           std::to_string(cell.n_timeouts), share_of(cell), limit_of(cell),
           cell.most_in ? percent(100 * cell.largest_share) + " (" +
                              shortened(analysis.table.participants[*cell.most_in], 12) + ")"
                        : kMissing});
    }
  }
  return table;
}

}  // namespace palpate::analysis
