#include "analysis/report/tables.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "analysis/statistics/conclusions.h"
#include "analysis/statistics/paired_evidence.h"
#include "analysis/text.h"

namespace palpate::analysis {
namespace {

constexpr std::ptrdiff_t kMostListed = 200;  // shapes in a note

/// "Accuracy, ray − point: 12.1 percentage points, 95 % CI [...], t(5) = 1.30, p = 0.250, n = 6
/// ..."
std::string accuracy_sentence(const Comparison& comparison, const std::string& label) {
  const AccuracyDifference& all = comparison.accuracy.all;
  const auto& ends = all.test.log_ratio_ci95;
  if (!all.test.p || !ends) return "";
  return "Accuracy, " + printable(comparison.pair.renderer) + " − " +
         printable(comparison.pair.reference) + ": " + fixed(100 * *all.difference, 1) +
         " percentage points, 95 % CI [" + fixed(100 * ends->low, 1) + ", " +
         fixed(100 * ends->high, 1) + "], " + test_text(all.test) +
         ", n = " + std::to_string(all.n) +
         " (paired t-test of shares correct, mean over shapes; a time-out is wrong" +
         (comparison.accuracy.depends_on_time_outs ? "; the difference depends on the time-outs"
                                                   : "") +
         (label.empty() ? "" : "; " + label) + ").";
}

std::string percentage_points(const std::optional<double>& share) {
  return share ? fixed(100 * *share, 1) : kMissing;
}

/// "3.2": how many times more likely the differences are with an effect than with none.
std::string bayes_cell(const std::optional<double>& factor) {
  return factor ? short_number(*factor) : kMissing;
}

const char* const kBayesNote =
    "90 % interval: equivalent within registered bounds if it lies inside (two one-sided tests at "
    "5 %). BF10: Bayes factor for a difference (Rouder et al. 2009, scale 0.707); below 1/3 it "
    "supports none.";

/// Below nine pairs a Bayes factor cannot support "no difference".
void add_bayes_notes(std::size_t fewest, Table& table) {
  table.notes.emplace_back(kBayesNote);
  if (fewest < kLeastForBayes)
    table.notes.emplace_back(
        "With fewer than nine participants BF10 cannot fall below 1/3: it can never support \"no "
        "difference\".");
}

std::string odds_ratio(const AccuracyModel& model) {
  const auto ratio = [](double log_odds) { return number(std::exp(log_odds), 2); };
  if (!model.undefined.empty()) return kMissing;
  const std::string value = model.log_odds_ratio ? ratio(*model.log_odds_ratio) : kMissing;
  if (model.ci95_low && model.ci95_high)
    return value + " (" + ratio(*model.ci95_low) + " to " + ratio(*model.ci95_high) + ")";
  if (model.ci95_low) return value + " (at least " + ratio(*model.ci95_low) + ")";
  if (model.ci95_high) return value + " (at most " + ratio(*model.ci95_high) + ")";
  return value + " (not determined)";
}

void add_accuracy_row(const Comparison& comparison, const char* trials,
                      const AccuracyDifference& one, Table& table) {
  const auto range = [](const std::optional<Interval>& ends) {
    return ends ? fixed(100 * ends->low, 1) + " to " + fixed(100 * ends->high, 1)
                : std::string(kMissing);
  };
  const PairedEvidence evidence =
      one.difference ? evidence_of(*one.difference, one.test) : PairedEvidence{};
  table.rows.push_back({difference_name(comparison.pair), trials, percentage_points(one.difference),
                        range(one.test.log_ratio_ci95), range(evidence.ci90),
                        bayes_cell(evidence.bayes_factor), number(one.test.t, 2),
                        number(one.test.df, 0), p_or_missing(one.test.p), odds_ratio(one.model),
                        p_or_missing(one.model.p), std::to_string(one.n)});
  const std::string name = difference_name(comparison.pair) + ", " + trials + ": ";
  if (!one.test.undefined.empty()) table.notes.push_back(name + one.test.undefined + ".");
  if (!one.model.undefined.empty())
    table.notes.push_back(name + "no model, " + one.model.undefined + ".");
  std::string left_out;
  for (const std::string& shape : one.model.left_out)
    left_out += (left_out.empty() ? "" : "; ") + shape;
  if (!left_out.empty()) table.notes.push_back(name + "left out of the model: " + left_out + ".");
}

std::string sentence_with_reason(const std::string& what, const std::string& reason) {
  return what + ": " + reason + ".";
}

/// Fixed notation with the sign, also +.
std::string signed_fixed(double value, int decimals) {
  if (!std::isfinite(value)) return kMissing;
  const std::string text = fixed(value, decimals);
  return (value > 0 && text.find_first_not_of("0.") != std::string::npos ? "+" : "") + text;
}

/// 100 (exp m - 1): percent change of time for a log ratio m.
std::string percent_change(const std::optional<double>& log_ratio) {
  if (!log_ratio) return kMissing;
  return signed_fixed(100 * std::expm1(*log_ratio), 1) + " %";
}

std::string learning_note(const std::string& who, const TTest& test,
                          const std::optional<double>& mean) {
  if (!mean) return sentence_with_reason(who, test.undefined);
  std::string text = who + ": " + percent_change(mean) + " of time per 100 trials";
  if (test.log_ratio_ci95) {
    text += " (95 % interval " + percent_change(test.log_ratio_ci95->low) + " to " +
            percent_change(test.log_ratio_ci95->high) + ")";
    if (test.t && test.df && test.p) text += ", " + test_text(test);
  } else {
    text += "; " + test.undefined;
  }
  return text + ".";
}

/// Standard deviations of the random effects and the residual; the correlation if there is only one
/// (the JSON has all).
std::string random_effects_note(const MixedModel& model,
                                const std::vector<std::string>& renderers) {
  std::vector<std::string> slopes;
  for (std::size_t r = 1; r < renderers.size(); ++r) {
    slopes.push_back(with_article(renderers[r]) + " " + number(model.random_sds[r], 3));
  }
  return "Standard deviations of log time: participants' intercepts " +
         number(model.random_sds[0], 3) + ", their slopes for " + joined(slopes) +
         (slopes.size() == 1 ? " (correlation " + number(model.random_correlations[0], 2) + ")"
                             : "") +
         ", residual " + number(model.residual_sd, 3) + "; log likelihood (REML) " +
         number(model.log_likelihood_reml, 3) + ", " +
         counted(model.n_observations, "trial", "trials") + ".";
}

std::string proportion_of(const TimeOutCell& cell) {
  return cell.n_trials == 0 ? kMissing : percent(100 * cell.proportion());
}

std::string limit_of(const TimeOutCell& cell) {
  if (!cell.lowest_limit) return kMissing;
  const auto seconds = [](double s) { return fixed(s, s == std::floor(s) ? 0 : 2); };
  if (*cell.lowest_limit == *cell.highest_limit) return seconds(*cell.lowest_limit) + " s";
  return seconds(*cell.lowest_limit) + " to " + seconds(*cell.highest_limit) + " s";
}

/// An interval of log ratios as percent reductions: "3.1 to 12.0".
std::string reduction_interval(const std::optional<Interval>& log_ratio) {
  if (!log_ratio) return kMissing;
  const Interval ends = percent_reduction(*log_ratio);
  return number(ends.low, 1) + " to " + number(ends.high, 1);
}

/// Whether there is more than one comparison: then rows of tables are named by renderer and shape,
/// not by shape.
bool has_several_comparisons(const Analysis& analysis) { return analysis.comparisons.size() > 1; }

/// An empty table for a row for each comparison and shape. \param header of the columns after the
/// names
Table comparison_table(const Analysis& analysis, const std::string& what,
                       const std::vector<std::string>& header) {
  Table table;
  table.caption = caption(analysis, what);
  if (has_several_comparisons(analysis)) table.header.emplace_back("renderer");
  table.header.emplace_back("shape");
  table.n_names = table.header.size();
  table.header.insert(table.header.end(), header.begin(), header.end());
  return table;
}

/// The name cells of a row of such a table.
std::vector<std::string> row_names(const Analysis& analysis, const RendererPair& pair,
                                   const std::string& shape) {
  if (has_several_comparisons(analysis)) return {pair.renderer, shape};
  return {shape};
}

/// A shape in a list: "cone", or "cone (tube)" with several comparisons.
std::string listed_shape(const Analysis& analysis, const RendererPair& pair,
                         const std::string& shape) {
  return has_several_comparisons(analysis) ? shape + " (" + pair.renderer + ")" : shape;
}

/// Coverage of the BCa intervals for the numbers of pairs in the data; empty if all are 20 or more.
std::string narrow_bootstrap_note(const Analysis& analysis) {
  std::map<std::size_t, double> by_pairs;
  for (const Comparison& comparison : analysis.comparisons) {
    for (const PairedShape& shape : comparison.shapes) {
      const auto coverage = bca_coverage(shape.n_pairs);
      if (shape.bootstrap.log_ratio_ci95 && coverage) by_pairs[shape.n_pairs] = *coverage;
    }
  }
  if (by_pairs.empty()) return {};
  std::string text;
  for (const auto& [pairs, coverage] : by_pairs) {
    text += (text.empty() ? "" : ", ") + fixed(100 * coverage, 0) + " % with " +
            std::to_string(pairs) + " pairs";
  }
  return "BCa intervals are too short for few participants: their coverage is not 95 % but " +
         text +
         " (simulated, normal differences; the t interval: 95 %). With skewed differences the "
         "coverage of both is lower.";
}

/// 90 % intervals and Bayes factors of the paired tests of times.
Table no_difference_table(const Analysis& analysis) {
  Table table;
  table.caption = caption(analysis, "Times: what speaks for no difference");
  table.n_names = 2;
  table.header = {"compared", "shape", "percent less time", "90 % interval", "BF10", "pairs"};
  std::size_t fewest = kLeastForBayes;
  for (const Comparison& comparison : analysis.comparisons) {
    for (std::size_t s = 0; s < comparison.shapes.size(); ++s) {
      const PairedShape& shape = comparison.shapes[s];
      if (!shape.mean_log_ratio) continue;
      const PairedEvidence evidence = evidence_of(*shape.mean_log_ratio, shape.t_test);
      if (!evidence.ci90) continue;
      const Interval ends = percent_reduction(*evidence.ci90);
      table.rows.push_back({difference_name(comparison.pair), analysis.table.shapes[s],
                            fixed(*shape.percent_reduction_geometric, 1),
                            fixed(ends.low, 1) + " to " + fixed(ends.high, 1),
                            bayes_cell(evidence.bayes_factor), std::to_string(shape.n_pairs)});
      fewest = std::min(fewest, shape.n_pairs);
    }
  }
  add_bayes_notes(fewest, table);
  return table;
}

}  // namespace

std::string number(const std::optional<double>& value, int decimals) {
  return value && std::isfinite(*value) ? fixed(*value, decimals) : kMissing;
}

std::string percent(const std::optional<double>& value, int decimals) {
  return value && std::isfinite(*value) ? fixed(*value, decimals) + " %" : kMissing;
}

std::optional<double> to_percent(const std::optional<double>& proportion) {
  if (!proportion) return std::nullopt;
  return 100 * *proportion;
}

std::string p_or_missing(const std::optional<double>& p) { return p ? p_text(*p) : kMissing; }

std::string caption(const Analysis& analysis, const std::string& what) {
  const std::string label = simulated_label(analysis.table.simulated);
  return label.empty() ? what : what + " (" + label + ")";
}

std::string test_text(const TTest& test) {
  return "t(" + number(test.df, 0) + ") = " + number(test.t, 2) + ", " + p_phrase(*test.p);
}

std::string test_sentence(const TTest& test, const EffectSize& effect, std::size_t pairs,
                          std::size_t tests) {
  std::string text = test_text(test);
  if (tests > 1 && test.p_holm)
    text +=
        " (" + p_phrase(*test.p_holm) + " adjusted over " + std::to_string(tests) + " tests, Holm)";
  if (effect.dz) text += ", dz = " + number(effect.dz, 2);
  return text + ", n = " + std::to_string(pairs);
}

std::vector<std::string> sentences_to_quote(const Analysis& analysis) {
  const std::size_t tests = number_of_tests(analysis.comparisons);
  const std::string label = simulated_label(analysis.table.simulated);
  std::vector<std::string> sentences;
  for (const Comparison& comparison : analysis.comparisons) {
    for (std::size_t s = 0; s < comparison.shapes.size(); ++s) {
      const PairedShape& shape = comparison.shapes[s];
      if (!shape.t_test.p || !shape.t_test.log_ratio_ci95) continue;
      const double reduction = *shape.percent_reduction_geometric;
      const Interval ends = percent_reduction(*shape.t_test.log_ratio_ci95);
      const bool more = reduction < 0;
      sentences.push_back(
          printable(analysis.table.shapes[s]) + ": " + fixed(std::fabs(reduction), 1) + " % " +
          (more ? "more" : "less") + " time with " +
          with_article(printable(comparison.pair.renderer)) + " than with " +
          with_article(printable(comparison.pair.reference)) + ", 95 % CI [" +
          fixed(more ? -ends.high : ends.low, 1) + ", " + fixed(more ? -ends.low : ends.high, 1) +
          "], " + test_sentence(shape.t_test, shape.effect_size, shape.n_pairs, tests) +
          " (paired t-test of log times" + (label.empty() ? "" : "; " + label) + ").");
    }
  }
  for (const Comparison& comparison : analysis.comparisons) {
    if (std::string one = accuracy_sentence(comparison, label); !one.empty())
      sentences.push_back(std::move(one));
  }
  return sentences;
}

std::size_t number_of_tests(const std::vector<Comparison>& comparisons) {
  std::size_t tests = 0;
  for (const Comparison& comparison : comparisons) {
    tests += static_cast<std::size_t>(std::ranges::count_if(
        comparison.shapes, [](const PairedShape& shape) { return shape.t_test.p.has_value(); }));
  }
  return tests;
}

const char* holm_heading(std::size_t tests) { return tests == 1 ? "p" : "p (Holm)"; }

void Reasons::add(const std::string& reason, const std::string& shape) {
  if (reason.empty()) return;
  for (auto& [known, shapes] : reasons_) {
    if (known != reason) continue;
    if (std::find(shapes.begin(), shapes.end(), shape) == shapes.end()) shapes.push_back(shape);
    return;
  }
  reasons_.push_back({reason, {shape}});
}

void Reasons::put(std::vector<std::string>& notes) const {
  for (const auto& [reason, shapes] : reasons_) {
    std::vector<std::string> named(shapes.begin(),
                                   shapes.begin() + std::min(std::ssize(shapes), kMostListed));
    if (named.size() < shapes.size()) {
      named.push_back(std::to_string(shapes.size() - named.size()) + " more");
    }
    notes.push_back("Undefined for " + joined(named) + ": " + reason + ".");
  }
}

// Tables of reductions, times, accuracy, confusion, tests, exclusions and provenance.

Table reduction_table(const Analysis& analysis) {
  const bool paper_too = compares_as_paper(analysis);
  const std::size_t tests = number_of_tests(analysis.comparisons);
  std::vector<std::string> header{"geometric", "95 % interval",     "arithmetic", "t",
                                  "df",        holm_heading(tests), "pairs"};
  if (paper_too) header.emplace_back("paper");
  Table table = comparison_table(
      analysis, "Reduction of response time " + with_renderer(analysis, "against"), header);
  Reasons reasons;
  for (const Comparison& comparison : analysis.comparisons) {
    for (std::size_t s = 0; s < comparison.shapes.size(); ++s) {
      const PairedShape& shape = comparison.shapes[s];
      const std::string& name = analysis.table.shapes[s];
      auto& row = table.rows.emplace_back(row_names(analysis, comparison.pair, name));
      row.insert(row.end(), {percent(shape.percent_reduction_geometric),
                             reduction_interval(shape.t_test.log_ratio_ci95),
                             percent(shape.percent_reduction_arithmetic), number(shape.t_test.t, 2),
                             number(shape.t_test.df, 0), p_or_missing(shape.t_test.p_holm),
                             std::to_string(shape.n_pairs)});
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
      "; interval (not adjusted), t and p from the paired t-test on m" +
      (tests == 1                          ? ""
       : has_several_comparisons(analysis) ? ", p adjusted over all shapes and comparisons (Holm)"
                                           : ", p adjusted over the shapes (Holm)") +
      ". Positive: " +
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

Table accuracy_difference_table(const Analysis& analysis) {
  Table table;
  table.caption = caption(analysis, "Difference of accuracy between renderers");
  table.n_names = 2;
  table.header = {
      "compared", "trials", "percentage points", "95 % interval",  "90 % interval", "BF10", "t",
      "df",       "p",      "odds ratio",        "p of the model", "participants"};
  table.notes = {
      "Primary: t-test over participants of the difference of shares correct, mean over shapes. "
      "Beside it: a logistic model with a random slope; interval and p by the likelihood ratio. A "
      "time-out is wrong in all trials, and left out of answered trials."};
  for (const Comparison& comparison : analysis.comparisons) {
    add_accuracy_row(comparison, "all trials", comparison.accuracy.all, table);
    add_accuracy_row(comparison, "answered trials", comparison.accuracy.answered, table);
    if (comparison.accuracy.depends_on_time_outs)
      table.notes.push_back(difference_name(comparison.pair) +
                            ": the difference depends on the time-outs.");
  }
  std::size_t fewest = kLeastForBayes;
  for (const Comparison& comparison : analysis.comparisons)
    fewest = std::min(fewest, comparison.accuracy.all.n);
  add_bayes_notes(fewest, table);
  return table;
}

Table accuracy_table(const Analysis& analysis) {
  Table table;
  table.caption = caption(analysis, "Accuracy in all trials");
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
  const bool one_test = number_of_tests(analysis.comparisons) == 1;
  if (one_test) std::erase(table.header, "p (Holm)");
  Reasons reasons;
  for (const Comparison& comparison : analysis.comparisons) {
    for (std::size_t s = 0; s < comparison.shapes.size(); ++s) {
      const PairedShape& shape = comparison.shapes[s];
      const std::string& name = analysis.table.shapes[s];
      auto& row = table.rows.emplace_back(row_names(analysis, comparison.pair, name));
      row.insert(row.end(), {number(shape.t_test.t, 2), number(shape.t_test.df, 0),
                             p_or_missing(shape.t_test.p)});
      if (!one_test) row.push_back(p_or_missing(shape.t_test.p_holm));
      row.insert(row.end(),
                 {number(shape.effect_size.dz, 2), number(shape.effect_size.hedges_gz, 2),
                  number(shape.wilcoxon.positive_rank_sum, 1), p_or_missing(shape.wilcoxon.p),
                  reduction_interval(shape.bootstrap.log_ratio_ci95)});
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
      ". Primary: the paired t-test" + (one_test ? "" : ", Holm-adjusted") +
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
  if (analysis.table.renderers.size() > 1) tables.push_back(accuracy_difference_table(analysis));
  if (analysis.table.renderers.size() > 1) tables.push_back(speed_accuracy_table(analysis));
  std::ranges::move(confusion_tables(analysis), std::back_inserter(tables));
  tables.push_back(tests_table(analysis));
  if (Table evidence = no_difference_table(analysis); !evidence.rows.empty())
    tables.push_back(std::move(evidence));
  tables.push_back(anova_table(analysis));
  tables.push_back(mixed_model_table(analysis));
  if (analysis.shape_slope_model.undefined.empty()) tables.push_back(shape_slope_table(analysis));
  tables.push_back(learning_table(analysis));
  if (analysis.table.renderers.size() > 1) tables.push_back(renderer_order_table(analysis));
  tables.push_back(exclusions_table(analysis));
  if (analysis.time_outs.any) tables.push_back(time_outs_table(analysis));
  tables.push_back(provenance_table(analysis));
  return tables;
}

// Tables of inferential statistics: speed and accuracy, ANOVA, mixed model, practice.

Table speed_accuracy_table(const Analysis& analysis) {
  const RendererPair& first = analysis.comparisons.front().pair;
  const std::string who = has_several_comparisons(analysis) ? "each renderer" : first.renderer;
  Table table = comparison_table(
      analysis, "Speed and accuracy together, " + who + " against " + first.reference,
      {"time", "accuracy " + first.reference,
       has_several_comparisons(analysis) ? "own accuracy" : "accuracy " + first.renderer,
       "accuracy", "95 % interval", "t", "df", "p", "trade-off"});
  for (const Comparison& comparison : analysis.comparisons) {
    for (std::size_t s = 0; s < comparison.speed_accuracy.size(); ++s) {
      const SpeedAccuracy& shape = comparison.speed_accuracy[s];
      const auto& interval = shape.test.log_ratio_ci95;
      auto& row =
          table.rows.emplace_back(row_names(analysis, comparison.pair, analysis.table.shapes[s]));
      row.insert(row.end(),
                 {shape.percent_change_time ? signed_fixed(*shape.percent_change_time, 1) + " %"
                                            : kMissing,
                  percent(to_percent(shape.accuracy_reference)),
                  percent(to_percent(shape.accuracy_renderer)),
                  shape.accuracy_change ? signed_fixed(100 * *shape.accuracy_change, 1) + " points"
                                        : kMissing,
                  interval ? signed_fixed(100 * interval->low, 1) + " to " +
                                 signed_fixed(100 * interval->high, 1)
                           : kMissing,
                  number(shape.test.t, 2), number(shape.test.df, 0), p_or_missing(shape.test.p),
                  shape.reading.empty() ? kMissing : shape.reading});
    }
  }
  table.notes = {
      "Trade-off possible: the interval of the change of accuracy excludes 0, and the faster "
      "renderer is the less accurate one. None shown: accuracy may still differ by as much as the "
      "interval says. Interval, t and p: of the change of accuracy in percentage points, paired "
      "over participants, not adjusted."};
  return table;
}

Table anova_table(const Analysis& analysis) {
  const RmAnova& anova = analysis.rm_anova;
  Table table;
  table.caption =
      caption(analysis, "Repeated-measures ANOVA on mean log times, " +
                            counted(anova.n_participants_used, "participant", "participants"));
  table.header = {"effect", "df",    "den. df", "F",      "p",    "η² gen.",
                  "W",      "p (W)", "ε GG",    "p (GG)", "ε HF", "p (HF)"};
  for (const AnovaEffect& effect : anova.effects) {
    const Sphericity& sphericity = effect.sphericity;
    table.rows.push_back({effect.name, number(effect.num_df, 0), number(effect.den_df, 0),
                          number(effect.f, 2), p_or_missing(effect.p),
                          number(effect.generalized_eta_squared, 3),
                          number(sphericity.mauchly_w, 3), p_or_missing(sphericity.mauchly_p),
                          number(sphericity.gg_epsilon, 3), p_or_missing(sphericity.gg_p),
                          number(sphericity.hf_epsilon_used, 3), p_or_missing(sphericity.hf_p)});
  }
  table.notes = {
      "Participants with a time in every cell. Generalised η²: SS / (SS + SS of "
      "participants + all error SS). W: Mauchly; GG: Greenhouse and Geisser; HF: Huynh and Feldt."};
  if (!anova.undefined.empty()) {
    table.notes.push_back(sentence_with_reason("Undefined", anova.undefined));
    return table;
  }
  for (const AnovaEffect& effect : anova.effects) {
    if (!effect.undefined.empty()) {
      table.notes.push_back(sentence_with_reason("Undefined for " + effect.name, effect.undefined));
    } else if (!effect.sphericity.undefined.empty() && effect.num_df.value_or(0) > 1) {
      table.notes.push_back(sentence_with_reason("Sphericity of " + effect.name + ", undefined",
                                                 effect.sphericity.undefined));
    }
  }
  if (!anova.dropped.empty()) {
    std::vector<std::string> names;
    for (const std::size_t p : anova.dropped) names.push_back(analysis.table.participants[p]);
    table.notes.push_back("Left out because a cell has no time: " + joined(names) + ".");
  }
  return table;
}

Table shape_slope_table(const Analysis& analysis) {
  const ShapeSlopeModel& model = analysis.shape_slope_model;
  const Comparison& first = analysis.comparisons.front();
  Table table = comparison_table(
      analysis,
      "Mixed model with participant × shape: log time ~ renderer * shape + (1 + renderer | "
      "participant) + (1 + renderer || participant:shape), REML",
      {"reduction", "95 % interval", difference_name(first.pair), "se", "df", "t", "p",
       "p (Holm)"});
  if (!model.undefined.empty()) {
    table.notes = {sentence_with_reason("Not fitted", model.undefined)};
    return table;
  }
  Reasons reasons;
  for (std::size_t s = 0; s < analysis.table.shapes.size(); ++s) {
    const ModelEstimate& value = model.contrasts[s];
    const std::string& name = analysis.table.shapes[s];
    std::optional<double> reduction;
    if (value.estimate) reduction = percent_reduction(*value.estimate);
    auto& row = table.rows.emplace_back(row_names(analysis, first.pair, name));
    row.insert(row.end(),
               {percent(reduction), reduction_interval(value.ci95), number(value.estimate, 4),
                number(value.se, 4), number(value.df_satterthwaite, 1), number(value.t, 2),
                p_or_missing(value.p), p_or_missing(value.p_holm)});
    reasons.add(value.undefined, listed_shape(analysis, first.pair, name));
  }
  table.notes.push_back("SD of participants' levels " + fixed(model.participant_level_sd, 3) +
                        ", gains " + fixed(model.participant_gain_sd, 3) + "; by shape, levels " +
                        fixed(model.shape_level_sd, 3) + ", gains " +
                        fixed(model.shape_gain_sd, 3) + "; residual " +
                        fixed(model.residual_sd, 3) + " (log s). df: Satterthwaite.");
  for (const std::string& one : model.taken_out)
    table.notes.push_back(sentence_with_reason("Taken out", one));
  reasons.put(table.notes);
  return table;
}

Table mixed_model_table(const Analysis& analysis) {
  const MixedModel& model = analysis.mixed_model;
  const std::vector<Comparison>& all = analysis.comparisons;
  Table table = comparison_table(
      analysis, "Mixed model: log time ~ renderer * shape + (1 + renderer | participant), REML",
      {"reduction", "95 % interval",
       has_several_comparisons(analysis) ? "− " + all.front().pair.reference
                                         : difference_name(all.front().pair),
       "se", "df", "t", "p", "p (Holm)"});
  const bool one_test = all.size() * analysis.table.shapes.size() == 1;
  if (one_test) table.header.pop_back();
  Reasons reasons;
  for (std::size_t c = 0; c < all.size(); ++c) {
    for (std::size_t s = 0; s < analysis.table.shapes.size(); ++s) {
      const ModelEstimate& value = model.contrasts[c][s];
      const std::string& name = analysis.table.shapes[s];
      std::optional<double> reduction;
      if (value.estimate) reduction = percent_reduction(*value.estimate);
      auto& row = table.rows.emplace_back(row_names(analysis, all[c].pair, name));
      row.insert(row.end(),
                 {percent(reduction), reduction_interval(value.ci95), number(value.estimate, 4),
                  number(value.se, 4), number(value.df_satterthwaite, 1), number(value.t, 2),
                  p_or_missing(value.p)});
      if (!one_test) row.push_back(p_or_missing(value.p_holm));
      reasons.add(value.undefined, listed_shape(analysis, all[c].pair, name));
    }
  }
  if (!model.undefined.empty()) {
    table.notes.push_back(sentence_with_reason("Undefined", model.undefined));
    return table;
  }
  // Where the next model stands, it tells what this one leaves out.
  table.notes.emplace_back(
      analysis.shape_slope_model.undefined.empty()
          ? "Complements the paired t-tests. One gain for each participant; gains that differ "
            "between "
            "shapes are in the model below. df: Satterthwaite."
          : "Complements the paired t-tests: the model has no participant × shape variance, so its "
            "intervals are too narrow and p too small if there is such a variance. df: "
            "Satterthwaite.");
  if (!model.singular.empty()) {
    table.notes.push_back(
        sentence_with_reason("Singular fit, on the boundary of the parameter space",
                             model.singular) +
        " Interpret its intervals and p with caution.");
  }
  table.notes.push_back(random_effects_note(model, analysis.table.renderers));
  reasons.put(table.notes);
  return table;
}

Table learning_table(const Analysis& analysis) {
  const Practice& practice = analysis.practice;
  Table table;
  table.caption = caption(analysis,
                          "Learning: geometric mean time in s over the trials with a "
                          "renderer, in order");
  table.header = {"renderer"};
  for (std::size_t b = 0; b < kLearningBins; ++b) {
    std::string name = std::to_string(b + 1);
    name += "/" + std::to_string(kLearningBins);
    table.header.push_back(name);
  }
  for (std::size_t r = 0; r < practice.learning.size(); ++r) {
    const Learning& learning = practice.learning[r];
    std::vector<std::string> row{analysis.table.renderers[r]};
    for (const LearningBin& bin : learning.bins) {
      row.push_back(bin.mean_log ? number(std::exp(*bin.mean_log), 2) : kMissing);
    }
    table.rows.push_back(std::move(row));
    table.notes.push_back(
        learning_note(analysis.table.renderers[r], learning.slope, learning.mean_slope));
  }
  for (std::size_t c = 0; c < analysis.comparisons.size(); ++c) {
    const RendererPair& pair = analysis.comparisons[c].pair;
    if (!pair.in_data()) continue;
    table.notes.push_back(
        learning_note(pair.is_ray_minus_point() ? "Ray − point" : difference_name(pair),
                      practice.pairs[c].slope_difference, practice.pairs[c].mean_slope_difference));
  }
  return table;
}

Table renderer_order_table(const Analysis& analysis) {
  const RendererPair& first = analysis.comparisons.front().pair;
  const std::string renderer = has_several_comparisons(analysis) ? "renderer" : first.renderer;
  Table table = comparison_table(
      analysis, "Practice: reduction by the order of the renderers",
      {first.reference + " first", "n", renderer + " first", "n", "difference", "t", "df",
       holm_heading(analysis.practice.n_tests), "balanced", "95 % interval"});
  Reasons reasons;
  std::vector<std::string> interleaved;
  const auto add = [&](const RendererPair& pair, const std::string& name,
                       const OrderEffect& effect) {
    const auto reduction = [](const std::optional<double>& log_ratio) {
      return log_ratio ? percent(percent_reduction(*log_ratio)) : kMissing;
    };
    auto& row = table.rows.emplace_back(row_names(analysis, pair, name));
    row.insert(
        row.end(),
        {reduction(effect.reference_first.mean_log_ratio),
         std::to_string(effect.reference_first.n_participants),
         reduction(effect.renderer_first.mean_log_ratio),
         std::to_string(effect.renderer_first.n_participants), percent_change(effect.difference),
         number(effect.test.t, 2), number(effect.test.df, 0), p_or_missing(effect.test.p_holm),
         reduction(effect.balanced_log_ratio), reduction_interval(effect.balanced_ci95)});
    reasons.add(effect.test.undefined, listed_shape(analysis, pair, name));
  };
  for (std::size_t c = 0; c < analysis.comparisons.size(); ++c) {
    const RendererPair& pair = analysis.comparisons[c].pair;
    const PairPractice& practice = analysis.practice.pairs[c];
    for (std::size_t s = 0; s < practice.shapes.size(); ++s) {
      add(pair, analysis.table.shapes[s], practice.shapes[s]);
    }
    add(pair, "all shapes", practice.all_shapes);
    if (practice.n_interleaved == 0) continue;
    interleaved.push_back(
        counted(practice.n_interleaved, "participant", "participants") + " did trials of " +
        (has_several_comparisons(analysis)
             ? with_article(first.reference) + " and " + with_article(pair.renderer)
             : "both renderers") +
        " interleaved: without an order, not counted here.");
  }
  table.notes = {
      "Percent reductions by the renderer that came first. Practice makes the second renderer "
      "appear faster: "
      "the gain is too large with " +
      first.reference + " first and too small with " +
      (has_several_comparisons(analysis) ? "the other" : first.renderer) +
      " first. Difference: ratio of " + renderer + " to " + first.reference + " times, " +
      first.reference + " first against " + renderer +
      " first; below 0 if practice shortens times; p adjusted over all tests of practice (slopes "
      "over "
      "the trials and orders, " +
      std::to_string(analysis.practice.n_tests) +
      " in all). Balanced: both orders with equal weight."};
  table.notes.insert(table.notes.end(), interleaved.begin(), interleaved.end());
  reasons.put(table.notes);
  return table;
}

// Tables of time-outs and of the estimates with time-outs as censored times.

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
      "A trial that ends at the limit would have taken longer; excluding it biases the times of "
      "a slow condition downwards. The model is log time ~ participant + renderer with normal "
      "residuals, "
      "time-outs censored at their limit, fitted by maximum likelihood; interval by t from scores "
      "summed "
      "by "
      "participant. It assumes log-normal times beyond the limit and complements the paired "
      "t-test; the two are equal without time-outs and with equal numbers of trials in all cells."};
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
