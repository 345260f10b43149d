#pragma once
// The figures of an analysis as rows of text, for whatever writes them down. Not escaped, not cut.

#include <cstddef>
#include <string>
#include <vector>

#include "analysis/statistics/analysis.h"

namespace palpate::analysis {

struct Table {
  std::string caption;  ///< says so where the data is simulated
  std::vector<std::string> header;
  std::size_t n_names = 1;  ///< leading columns of names; the others hold figures
  std::vector<std::vector<std::string>> rows;  ///< as long as the header each
  std::vector<std::string> notes;              ///< below it: what a reader must know
};

/// Percent reduction per comparison and shape with its interval, beside the paper's.
Table reduction_table(const Analysis& analysis);
/// The same with time-outs as censored times; without rows where nobody timed out.
Table censored_table(const Analysis& analysis);
/// Time-outs by cell; without rows where nobody timed out.
Table time_outs_table(const Analysis& analysis);
Table times_table(const Analysis& analysis);
Table accuracy_table(const Analysis& analysis);
/// Change of accuracy beside the change of time, per comparison: is speed bought with errors?
Table speed_accuracy_table(const Analysis& analysis);
/// One for each renderer.
std::vector<Table> confusion_tables(const Analysis& analysis);
Table tests_table(const Analysis& analysis);
Table exclusions_table(const Analysis& analysis);
/// Renderer x shape with the corrections for sphericity.
Table anova_table(const Analysis& analysis);
/// Contrasts, variances and how far to trust them.
Table mixed_model_table(const Analysis& analysis);
/// Log times over the trials with each renderer.
Table learning_table(const Analysis& analysis);
/// Gains by which renderer came first, per comparison.
Table renderer_order_table(const Analysis& analysis);
/// What and where from: two columns of text.
Table provenance_table(const Analysis& analysis);

/// All of them in the order of display.
std::vector<Table> all_tables(const Analysis& analysis);

}  // namespace palpate::analysis
