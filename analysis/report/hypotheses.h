#pragma once
// Hypotheses as conditions on the numbers of an analysis (Lakens & DeBruine 2021,
// 10.1177/2515245920970949): each has a condition that corroborates it and one that refutes it.

#include <cstddef>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "analysis/statistics/pattern.h"

namespace palpate::analysis {

/// NaN: undefined in this analysis.
using NamedResults = std::map<std::string, double, std::less<>>;

/// The numbers of analysis.json by name: the keys that lead to a number, joined by dots
/// ("paired_by_shape.cone.t_test.p_holm"; true and false are 1 and 0, elements of lists have no
/// name), the short names of kShortNames, and "alpha".
/// Names of the identification of a study with tasks need not begin with "identification.".
/// \param analysis  text of report_json() or task_report_json() \param alpha  of the tests, as
/// registered
NamedResults named_results(const std::string& analysis, double alpha);

/// A short name and its long name; * is the name of a shape, renderer or effect.
struct ShortName {
  const char* name;
  const char* key;
};
/// Their only definition; analysis/README.md explains them.
inline constexpr ShortName kShortNames[] = {
    {"paired.*.n_pairs", "paired_by_shape.*.n_pairs"},
    {"paired.*.reduction", "paired_by_shape.*.percent_reduction_geometric"},
    {"paired.*.ci95_low", "paired_by_shape.*.t_test.percent_reduction_ci95_low"},
    {"paired.*.ci95_high", "paired_by_shape.*.t_test.percent_reduction_ci95_high"},
    {"paired.*.log_ratio", "paired_by_shape.*.mean_log_ratio"},
    {"paired.*.t", "paired_by_shape.*.t_test.t"},
    {"paired.*.df", "paired_by_shape.*.t_test.df"},
    {"paired.*.p", "paired_by_shape.*.t_test.p"},
    {"paired.*.p_holm", "paired_by_shape.*.t_test.p_holm"},
    {"paired.*.dz", "paired_by_shape.*.effect_size.dz"},
    {"paired.*.hedges_gz", "paired_by_shape.*.effect_size.hedges_gz"},
    {"paired.*.wilcoxon_p", "paired_by_shape.*.wilcoxon.p"},
    {"model.*.reduction", "mixed_model.contrasts_ray_minus_point.*.percent_reduction"},
    {"model.*.ci95_low", "mixed_model.contrasts_ray_minus_point.*.percent_reduction_ci95_low"},
    {"model.*.ci95_high", "mixed_model.contrasts_ray_minus_point.*.percent_reduction_ci95_high"},
    {"model.*.p", "mixed_model.contrasts_ray_minus_point.*.p"},
    {"model.*.p_holm", "mixed_model.contrasts_ray_minus_point.*.p_holm"},
    {"anova.*.F", "rm_anova.effects.*.F"},
    {"anova.*.p", "rm_anova.effects.*.p"},
    {"accuracy_change.*", "speed_accuracy.*.accuracy_change"},
    {"accuracy.difference", "accuracy_comparison.primary.difference"},
    {"accuracy.ci95_low", "accuracy_comparison.primary.ci95_low"},
    {"accuracy.ci95_high", "accuracy_comparison.primary.ci95_high"},
    {"accuracy.p", "accuracy_comparison.primary.p"},
    {"accuracy.ci90_low", "accuracy_comparison.primary.ci90_low"},
    {"accuracy.ci90_high", "accuracy_comparison.primary.ci90_high"},
    {"accuracy.answered_difference", "accuracy_comparison.answered.difference"},
    {"accuracy.answered_p", "accuracy_comparison.answered.p"},
    {"accuracy.log_odds_ratio", "accuracy_comparison.primary.model.log_odds_ratio"},
    {"accuracy.model_p", "accuracy_comparison.primary.model.p"},
    {"accuracy.bf10", "accuracy_comparison.primary.bf10"},
    {"equivalence.accuracy.least_bound", "accuracy_comparison.primary.least_bound"},
    {"equivalence.answered.least_bound", "accuracy_comparison.answered.least_bound"},
    {"equivalence.*.least_bound", "paired_by_shape.*.t_test.least_bound"},
    {"paired.*.bf10", "paired_by_shape.*.t_test.bf10"},
};

enum class Verdict {
  corroborated,
  refuted,
  undecided  ///< neither holds, both do, or the outcome depends on an undefined number
};
const char* to_string(Verdict verdict);

struct Hypothesis {
  std::string id;            ///< letters, digits and '-'
  std::string text;          ///< in words
  std::string corroborated;  ///< expressions as of Pattern
  std::string refuted;
};

/// Reads hypotheses.json: [{"id": "H1", "text": "...", "corroborated": "...", "refuted": "..."}].
/// \param known  names of an analysis; empty: any are accepted
/// \throws protocols::InputError with every fault
std::vector<Hypothesis> read_hypotheses(const std::string& text, const std::string& file,
                                        const NamedResults& known);

struct Judgement {
  Verdict verdict = Verdict::undecided;
  std::optional<bool> corroborated, refuted;  ///< none: depends on an undefined number
  /// Names in the expressions, each once, in order of appearance.
  std::vector<std::pair<std::string, double>> numbers;
};

/// Unknown names count as undefined. \throws PatternError
Judgement judge(const Hypothesis& hypothesis, const NamedResults& results);

}  // namespace palpate::analysis
