#pragma once
// The numbers of an analysis as tables of text, which the text and HTML reports print. Cells are
// not escaped or shortened.

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "analysis/statistics/analysis.h"

namespace palpate::analysis {

/// A table of text cells.
struct Table {
  std::string caption;  ///< with "SIMULATED PARTICIPANTS" where it applies
  std::vector<std::string> header;
  std::size_t n_names = 1;    ///< number of leading columns with names; the others hold numbers
  std::size_t n_remarks = 0;  ///< number of columns at the end with words
  std::vector<std::vector<std::string>> rows;  ///< each as long as the header
  std::vector<std::string> notes;              ///< definitions and reasons for missing values
};

/// Percent reduction of response time per comparison and shape with its 95 % t interval, beside the
/// paper's.
Table reduction_table(const Analysis& analysis);
/// Percent reduction with time-outs as censored times; no rows without time-outs.
Table censored_table(const Analysis& analysis);
/// Number and percentage of time-outs, limits and the participant with the largest percentage, by
/// cell.
Table time_outs_table(const Analysis& analysis);
/// Response times (s) of correct trials by cell: mean, sd, median and geometric mean over
/// participants.
Table times_table(const Analysis& analysis);
/// Accuracy by cell, with and without time-outs.
Table accuracy_table(const Analysis& analysis);
/// Difference of accuracy, per comparison, of all and of answered trials: shares and model.
Table accuracy_difference_table(const Analysis& analysis);
/// Change of time and of accuracy, per comparison and shape: speed-accuracy trade-off.
Table speed_accuracy_table(const Analysis& analysis);
/// Confusion matrix of each renderer.
std::vector<Table> confusion_tables(const Analysis& analysis);
/// Paired t-test, effect sizes, Wilcoxon test and bootstrap interval, per comparison and shape.
Table tests_table(const Analysis& analysis);
/// Trials excluded from the times, by renderer and reason.
Table exclusions_table(const Analysis& analysis);
/// Repeated-measures ANOVA, renderer x shape, with sphericity corrections.
Table anova_table(const Analysis& analysis);
/// Contrasts of the mixed model with Satterthwaite tests; standard deviations of the random effects
/// in a note.
Table mixed_model_table(const Analysis& analysis);
/// The same with effects of participant and shape, of two renderers.
Table shape_slope_table(const Analysis& analysis);
/// Geometric mean times (s) over eighths of the trials with each renderer; slopes in notes.
Table learning_table(const Analysis& analysis);
/// Percent reduction by which renderer came first, per comparison.
Table renderer_order_table(const Analysis& analysis);
/// Source, protocol, checksums and versions.
Table provenance_table(const Analysis& analysis);

/// All of them in the order of display.
std::vector<Table> all_tables(const Analysis& analysis);

/// The cell of a missing or non-finite number.
inline constexpr const char* kMissing = "–";

std::string number(const std::optional<double>& value, int decimals);
/// "12.3 %"; `value` in percent.
std::string percent(const std::optional<double>& value, int decimals = 1);
/// 100 times a proportion.
std::optional<double> to_percent(const std::optional<double>& proportion);
std::string p_or_missing(const std::optional<double>& p);

/// "Response times" or "Response times (SIMULATED PARTICIPANTS)".
std::string caption(const Analysis& analysis, const std::string& what);

/// "t(6) = 2.10, p = 0.080". \pre the test is defined
std::string test_text(const TTest& test);
/// "t(6) = 2.10, p = 0.080, dz = 0.79, n = 7", with p adjusted over several tests. \pre as above
std::string test_sentence(const TTest& test, const EffectSize& effect, std::size_t pairs,
                          std::size_t tests);
/// For a paper: a sentence for each primary test (paired t-tests of times) that is defined.
std::vector<std::string> sentences_to_quote(const Analysis& analysis);

/// Number of defined p values of paired tests: the family of Holm's adjustment.
std::size_t number_of_tests(const std::vector<Comparison>& comparisons);
/// Heading of the column of p values adjusted over so many tests: of one test it is p itself.
const char* holm_heading(std::size_t tests);

/// Collects why values are undefined; one note for each reason, with its shapes.
class Reasons {
 public:
  void add(const std::string& reason, const std::string& shape);
  void put(std::vector<std::string>& notes) const;

 private:
  std::vector<std::pair<std::string, std::vector<std::string>>> reasons_;
};

}  // namespace palpate::analysis
