// Tables of reductions, times, accuracy, confusion, tests, exclusions and provenance.

#include <algorithm>
#include <iterator>
#include <optional>
#include <utility>

#include "analysis/report/table_cells.h"
#include "analysis/report/tables.h"
#include "analysis/statistics/conclusions.h"
#include "analysis/text.h"

namespace palpate::analysis {

Table reduction_table(const Analysis& analysis) {
  const bool paper_too = compares_as_paper(analysis);
  std::vector<std::string> header{"geometric", "95 % interval", "arithmetic", "p (Holm)", "pairs"};
  if (paper_too) header.emplace_back("paper");
  Table table = comparison_table(
      analysis,
      "How much faster " + with_renderer(analysis, "than with") + ": reduction of response time",
      header);
  Reasons reasons;
  for (const Comparison& comparison : analysis.comparisons) {
    for (std::size_t s = 0; s < comparison.shapes.size(); ++s) {
      const PairedShape& shape = comparison.shapes[s];
      const std::string& name = analysis.table.shapes[s];
      auto& row = table.rows.emplace_back(row_names(analysis, comparison.pair, name));
      row.insert(row.end(), {percent(shape.percent_reduction_geometric),
                             reduction_interval(shape.t_test.log_ratio_ci95),
                             percent(shape.percent_reduction_arithmetic),
                             p_or_missing(shape.t_test.p_holm), std::to_string(shape.n_pairs)});
      if (paper_too) {
        const std::string paper = paper_reduction(comparison.pair, name);
        row.push_back(paper.empty() ? kMissing : paper);
      }
      reasons.add(shape.t_test.undefined, listed_shape(analysis, comparison.pair, name));
    }
  }
  const RendererPair& first = analysis.comparisons.front().pair;
  const std::string renderer = has_several_comparisons(analysis) ? "renderer" : first.renderer;
  table.notes = {
      "Geometric: 100 (1 − exp m), m the mean over participants of mean log " + renderer +
      " − mean log " + first.reference +
      "; interval (not adjusted) and p from the paired t-test on m, p adjusted over " +
      (has_several_comparisons(analysis) ? "all shapes and comparisons" : "the shapes") +
      " (Holm). Positive: " +
      (has_several_comparisons(analysis) ? "faster than with " + with_article(first.reference)
                                         : with_article(first.renderer) + " is faster") +
      ". Arithmetic: from mean times" + (paper_too ? ", which the paper may have used." : ".")};
  if (paper_too) {
    table.notes.emplace_back(
        "Paper: Ho, Basdogan & Srinivasan 2000, fig. 15; n.s.: no significant difference.");
  }
  reasons.put(table.notes);
  return table;
}

Table times_table(const Analysis& analysis) {
  Table table;
  table.caption = caption(analysis, "Response times in s, correct trials");
  table.n_names = 2;
  table.header = {"shape",  "renderer",       "mean",         "sd",
                  "median", "geometric mean", "participants", "trials"};
  for (std::size_t s = 0; s < analysis.table.shapes.size(); ++s) {
    for (std::size_t r = 0; r < analysis.table.renderers.size(); ++r) {
      const TimesCell& cell = analysis.description.times[r][s];
      table.rows.push_back({analysis.table.shapes[s], analysis.table.renderers[r],
                            number(cell.mean_of_participant_means, 2),
                            number(cell.sd_of_participant_means, 2),
                            number(cell.mean_of_participant_medians, 2),
                            number(cell.geomean_of_participant_geomeans, 2),
                            std::to_string(cell.n_participants), std::to_string(cell.n_trials)});
    }
  }
  table.notes = {
      "Each is taken per participant first, then averaged over participants; sd is "
      "between participants."};
  return table;
}

Table accuracy_table(const Analysis& analysis) {
  Table table;
  table.caption = caption(analysis, "Accuracy, all trials");
  table.n_names = 2;
  table.header = {"shape",   "renderer",  "accuracy", "of answered", "mean of participants",
                  "correct", "no answer", "trials"};
  for (std::size_t s = 0; s < analysis.table.shapes.size(); ++s) {
    for (std::size_t r = 0; r < analysis.table.renderers.size(); ++r) {
      const AccuracyCell& cell = analysis.description.accuracy[r][s];
      table.rows.push_back(
          {analysis.table.shapes[s], analysis.table.renderers[r],
           percent(to_percent(cell.accuracy)), percent(to_percent(cell.accuracy_answered)),
           percent(to_percent(cell.mean_of_participant_accuracies)), std::to_string(cell.n_correct),
           std::to_string(cell.n_timeouts), std::to_string(cell.n_trials)});
    }
  }
  table.notes = {"A time-out counts as wrong; “of answered” leaves time-outs out."};
  return table;
}

std::vector<Table> confusion_tables(const Analysis& analysis) {
  std::vector<Table> tables;
  for (std::size_t r = 0; r < analysis.table.renderers.size(); ++r) {
    Table table;
    table.caption = caption(analysis, "Confusion with " + analysis.table.renderers[r] +
                                          ": shown (rows), answered (columns)");
    table.header = {"shown"};
    table.header.insert(table.header.end(), analysis.table.answers.begin(),
                        analysis.table.answers.end());
    table.header.emplace_back("no response");
    for (std::size_t s = 0; s < analysis.table.shapes.size(); ++s) {
      std::vector<std::string> row{analysis.table.shapes[s]};
      for (const std::size_t n : analysis.description.confusion[r][s]) {
        row.push_back(std::to_string(n));
      }
      table.rows.push_back(std::move(row));
    }
    tables.push_back(std::move(table));
  }
  return tables;
}

Table tests_table(const Analysis& analysis) {
  const RendererPair& first = analysis.comparisons.front().pair;
  Table table = comparison_table(
      analysis,
      "Tests of " +
          (has_several_comparisons(analysis) ? "each renderer − " + first.reference
                                             : difference_name(first)) +
          " on log times, over participants",
      {"t", "df", "p", "p (Holm)", "dz", "Hedges' gz", "V", "p (Wilcoxon)", "BCa 95 %"});
  Reasons reasons;
  for (const Comparison& comparison : analysis.comparisons) {
    for (std::size_t s = 0; s < comparison.shapes.size(); ++s) {
      const PairedShape& shape = comparison.shapes[s];
      const std::string& name = analysis.table.shapes[s];
      auto& row = table.rows.emplace_back(row_names(analysis, comparison.pair, name));
      row.insert(
          row.end(),
          {number(shape.t_test.t, 2), number(shape.t_test.df, 0), p_or_missing(shape.t_test.p),
           p_or_missing(shape.t_test.p_holm), number(shape.effect_size.dz, 2),
           number(shape.effect_size.hedges_gz, 2), number(shape.wilcoxon.positive_rank_sum, 1),
           p_or_missing(shape.wilcoxon.p), reduction_interval(shape.bootstrap.log_ratio_ci95)});
      for (const std::string& reason : {shape.t_test.undefined, shape.effect_size.undefined,
                                        shape.wilcoxon.undefined, shape.bootstrap.undefined}) {
        reasons.add(reason, listed_shape(analysis, comparison.pair, name));
      }
    }
  }
  table.notes = {
      "t, dz and gz are negative when " +
      (has_several_comparisons(analysis) ? "it is faster than with " + with_article(first.reference)
                                         : with_article(first.renderer) + " is faster") +
      ". Primary: the paired t-test, Holm-adjusted" +
      (has_several_comparisons(analysis) ? " over all shapes and comparisons" : "") +
      ". Wilcoxon: exact, two-sided, V the positive rank sum. BCa: bootstrap interval of the "
      "percent reduction, " +
      std::to_string(kResamples) + " resamples, seed " + std::to_string(analysis.settings.seed) +
      "."};
  const std::string narrow = narrow_bootstrap_note(analysis);
  if (!narrow.empty()) table.notes.push_back(narrow);
  reasons.put(table.notes);
  return table;
}

Table exclusions_table(const Analysis& analysis) {
  Table table;
  table.caption = caption(analysis, "Trials excluded from the times");
  table.header = {"renderer", "trials", "wrong", "no response", "too fast", "used", "left out"};
  for (std::size_t r = 0; r < analysis.table.renderers.size(); ++r) {
    const Exclusions& lost = analysis.exclusions[r];
    table.rows.push_back({analysis.table.renderers[r], std::to_string(lost.n_trials),
                          std::to_string(lost.n_wrong), std::to_string(lost.n_timeouts),
                          std::to_string(lost.n_too_fast), std::to_string(lost.n_used),
                          percent(100 * lost.proportion_excluded())});
  }
  table.notes = {"Too fast: correct answers before " + fixed(analysis.settings.too_fast, 3) +
                 " s. " + counted(analysis.table.n_practice, "practice trial", "practice trials") +
                 " excluded beforehand."};
  return table;
}

Table provenance_table(const Analysis& analysis) {
  const Provenance& from = analysis.table.provenance;
  Table table;
  table.caption = "Provenance";
  table.n_names = 2;
  table.header = {"what", "value"};
  const auto add = [&](const char* what, const std::string& value) {
    if (!value.empty()) table.rows.push_back({what, value});
  };
  add("source", from.source);
  add("participants", counted(analysis.table.participants.size(), "participant", "participants") +
                          (analysis.table.simulated == Simulated::yes     ? ", simulated"
                           : analysis.table.simulated == Simulated::mixed ? ", partly simulated"
                                                                          : ""));
  add("protocol", from.protocol_name);
  for (const std::string& sha : from.protocol_sha256) add("protocol SHA-256", sha);
  add("observer SHA-256", from.observer_sha256);
  for (const std::string& version : from.program_versions) add("recorded with palpate", version);
  add("analysed with palpate", analysis.program_version);
  return table;
}

std::vector<Table> all_tables(const Analysis& analysis) {
  std::vector<Table> tables{reduction_table(analysis)};
  Table censored = censored_table(analysis);
  if (!censored.rows.empty()) tables.push_back(std::move(censored));
  tables.push_back(times_table(analysis));
  tables.push_back(accuracy_table(analysis));
  if (analysis.table.renderers.size() > 1) tables.push_back(speed_accuracy_table(analysis));
  std::ranges::move(confusion_tables(analysis), std::back_inserter(tables));
  tables.push_back(tests_table(analysis));
  tables.push_back(anova_table(analysis));
  tables.push_back(mixed_model_table(analysis));
  tables.push_back(learning_table(analysis));
  if (analysis.table.renderers.size() > 1) tables.push_back(renderer_order_table(analysis));
  tables.push_back(exclusions_table(analysis));
  if (analysis.time_outs.any) tables.push_back(time_outs_table(analysis));
  tables.push_back(provenance_table(analysis));
  return tables;
}

}  // namespace palpate::analysis
