// Tables of time-outs and of the estimates with time-outs as censored times.

#include <cmath>
#include <optional>
#include <string>

#include "analysis/report/table_cells.h"
#include "analysis/report/tables.h"
#include "analysis/statistics/conclusions.h"
#include "analysis/text.h"

namespace palpate::analysis {

namespace {

std::string proportion_of(const TimeOutCell& cell) {
  return cell.n_trials == 0 ? kMissing : percent(100 * cell.proportion());
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
      analysis, "Time-outs as censored times: reduction of response time",
      {"answered only", "with time-outs", "95 % interval", "time-outs " + first.reference,
       has_several_comparisons(analysis) ? "own time-outs" : "time-outs " + first.renderer, "n"});
  Reasons reasons;
  for (const Comparison& comparison : analysis.comparisons) {
    for (std::size_t s = 0; s < comparison.censored.size(); ++s) {
      const CensoredEstimate& censored = comparison.censored[s];
      const std::string& name = analysis.table.shapes[s];
      std::optional<double> reduction;
      if (censored.log_ratio) reduction = percent_reduction(*censored.log_ratio);
      auto& row = table.rows.emplace_back(row_names(analysis, comparison.pair, name));
      row.insert(row.end(),
                 {percent(comparison.shapes[s].percent_reduction_geometric), percent(reduction),
                  reduction_interval(censored.log_ratio_ci95),
                  proportion_of(analysis.time_outs.cells[*comparison.pair.reference_at][s]),
                  proportion_of(analysis.time_outs.cells[*comparison.pair.renderer_at][s]),
                  std::to_string(censored.n_participants)});
      reasons.add(censored.undefined, listed_shape(analysis, comparison.pair, name));
    }
  }
  table.notes = {
      "A trial that ends at the limit would have taken longer: leaving it out biases the times of "
      "a slow condition downwards. Here log time ~ participant + renderer with normal residuals, "
      "time-outs censored at their limit, by maximum likelihood; interval by t from scores summed "
      "by "
      "participant. It assumes log-normal times beyond the limit and complements the paired "
      "t-test; without time-outs and with equally many trials in all cells both are equal."};
  reasons.put(table.notes);
  return table;
}

Table time_outs_table(const Analysis& analysis) {
  Table table;
  table.caption = caption(analysis, "Time-outs: trials that ended at the limit");
  table.n_names = 2;
  table.header = {
      "shape", "renderer", "trials", "time-outs", "percent", "limit", "most in one participant"};
  for (std::size_t s = 0; s < analysis.table.shapes.size(); ++s) {
    for (std::size_t r = 0; r < analysis.table.renderers.size(); ++r) {
      const TimeOutCell& cell = analysis.time_outs.cells[r][s];
      table.rows.push_back(
          {analysis.table.shapes[s], analysis.table.renderers[r], std::to_string(cell.n_trials),
           std::to_string(cell.n_timeouts), proportion_of(cell), limit_of(cell),
           cell.most_affected
               ? percent(100 * cell.largest_proportion) + " (" +
                     shortened(analysis.table.participants[*cell.most_affected], 12) + ")"
               : kMissing});
    }
  }
  return table;
}

}  // namespace palpate::analysis
