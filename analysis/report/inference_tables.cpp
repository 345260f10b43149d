// Tables of inferential statistics: speed and accuracy, ANOVA, mixed model, practice.

#include <cmath>

#include "analysis/report/table_cells.h"
#include "analysis/report/tables.h"
#include "analysis/statistics/conclusions.h"
#include "analysis/text.h"

namespace palpate::analysis {

namespace {

std::string sentence(const std::string& what, const std::string& reason) {
  return what + ": " + reason + ".";
}

/// 100 (exp m - 1): percent change of time for a log ratio m.
std::string percent_change(const std::optional<double>& log_ratio) {
  if (!log_ratio) return kMissing;
  return signed_fixed(100 * std::expm1(*log_ratio), 1) + " %";
}

std::string learning_note(const std::string& who, const TTest& test,
                          const std::optional<double>& mean) {
  if (!mean) return sentence(who, test.undefined);
  std::string text = who + ": " + percent_change(mean) + " of time per 100 trials";
  if (test.log_ratio_ci95) {
    text += " (95 % interval " + percent_change(test.log_ratio_ci95->low) + " to " +
            percent_change(test.log_ratio_ci95->high) + ")";
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

}  // namespace

Table speed_accuracy_table(const Analysis& analysis) {
  const RendererPair& first = analysis.comparisons.front().pair;
  const std::string who = has_several_comparisons(analysis) ? "each renderer" : first.renderer;
  Table table = comparison_table(
      analysis, "Speed and accuracy together, " + who + " against " + first.reference,
      {"time", "accuracy " + first.reference,
       has_several_comparisons(analysis) ? "own accuracy" : "accuracy " + first.renderer,
       "accuracy", "95 % interval", "p", "reading"});
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
                  p_or_missing(shape.test.p), shape.reading.empty() ? kMissing : shape.reading});
    }
  }
  table.notes = {
      "Trade-off possible: faster and less accurate, or slower and more accurate, by more than 1 % "
      "of the time and 1 percentage point. Interval and p: of the change of accuracy in percentage "
      "points, paired over participants, not adjusted."};
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
      "On participants with a time in every cell. Generalised η²: SS / (SS + SS of "
      "participants + all error SS). W: Mauchly; GG: Greenhouse and Geisser; HF: Huynh and Feldt."};
  if (!anova.undefined.empty()) {
    table.notes.push_back(sentence("Undefined", anova.undefined));
    return table;
  }
  for (const AnovaEffect& effect : anova.effects) {
    if (!effect.undefined.empty()) {
      table.notes.push_back(sentence("Undefined for " + effect.name, effect.undefined));
    } else if (!effect.sphericity.undefined.empty() && effect.num_df.value_or(0) > 1) {
      table.notes.push_back(
          sentence("Sphericity of " + effect.name + ", undefined", effect.sphericity.undefined));
    }
  }
  if (!anova.dropped.empty()) {
    std::vector<std::string> names;
    for (const std::size_t p : anova.dropped) names.push_back(analysis.table.participants[p]);
    table.notes.push_back("Left out, without a time in some cell: " + joined(names) + ".");
  }
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
                  p_or_missing(value.p), p_or_missing(value.p_holm)});
      reasons.add(value.undefined, listed_shape(analysis, all[c].pair, name));
    }
  }
  if (!model.undefined.empty()) {
    table.notes.push_back(sentence("Undefined", model.undefined));
    return table;
  }
  table.notes.push_back(
      "Complements the paired t-tests: the model has no participant × shape variance, so its "
      "intervals are too narrow and p too small where there is some. df: Satterthwaite.");
  if (!model.singular.empty()) {
    table.notes.push_back(
        sentence("Singular fit, on the boundary of the parameter space", model.singular) +
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
  Table table = comparison_table(analysis, "Practice: reduction by the order of the renderers",
                                 {first.reference + " first", "n", renderer + " first", "n",
                                  "difference", "p (Holm)", "balanced", "95 % interval"});
  Reasons reasons;
  std::vector<std::string> interleaved;
  const auto add = [&](const RendererPair& pair, const std::string& name,
                       const OrderEffect& effect) {
    const auto reduction = [](const std::optional<double>& log_ratio) {
      return log_ratio ? percent(percent_reduction(*log_ratio)) : kMissing;
    };
    auto& row = table.rows.emplace_back(row_names(analysis, pair, name));
    row.insert(row.end(),
               {reduction(effect.reference_first.mean_log_ratio),
                std::to_string(effect.reference_first.n_participants),
                reduction(effect.renderer_first.mean_log_ratio),
                std::to_string(effect.renderer_first.n_participants),
                percent_change(effect.difference), p_or_missing(effect.test.p_holm),
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
        " mixed: no order, not counted here.");
  }
  table.notes = {
      "Percent reductions by which renderer came first. Practice makes the second one look faster: "
      "a gain is too large with " +
      first.reference + " first and too small with " +
      (has_several_comparisons(analysis) ? "the other" : first.renderer) +
      " first. Difference: ratio of " + renderer + " to " + first.reference + " times, " +
      first.reference + " first against " + renderer +
      " first; below 0 where practice helps; p adjusted over all tests of practice (slopes over "
      "the trials and orders, " +
      std::to_string(analysis.practice.n_tests) +
      " in all). Balanced: both orders with equal weight."};
  table.notes.insert(table.notes.end(), interleaved.begin(), interleaved.end());
  reasons.put(table.notes);
  return table;
}

}  // namespace palpate::analysis
