#include "analysis/report/between_report.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <optional>

#include "analysis/statistics/task_analysis.h"
#include "analysis/text.h"

namespace palpate::analysis {
namespace {

using GroupJson = nlohmann::ordered_json;

GroupJson number_json(const std::optional<double>& value) {
  return value && std::isfinite(*value) ? GroupJson(*value) : GroupJson(nullptr);
}

GroupJson interval_json(const std::optional<Interval>& interval) {
  return interval ? GroupJson{interval->low, interval->high} : GroupJson(nullptr);
}

GroupJson group_effect_json(const GroupEffect& effect) {
  GroupJson out{{"num_df", number_json(effect.num_df)},
                {"den_df", number_json(effect.den_df)},
                {"f", number_json(effect.f)},
                {"p", number_json(effect.p)},
                {"generalized_eta_squared", number_json(effect.generalized_eta_squared)}};
  if (effect.gg_epsilon) {
    out["gg_epsilon"] = *effect.gg_epsilon;
    out["gg_p"] = number_json(effect.gg_p);
  }
  if (!effect.undefined.empty()) out["reason"] = effect.undefined;
  return out;
}

/// The name of a condition; none: the mean over all.
GroupJson renderer_json(const GroupedMeasure& of, const std::optional<std::size_t>& condition) {
  return condition ? GroupJson(of.renderers[*condition]) : GroupJson(nullptr);
}

GroupJson marginal_json(const GroupedMeasure& of, const GroupMarginal& one) {
  return {{"group", of.groups[one.group]},
          {"renderer", renderer_json(of, one.condition)},
          {"n", one.n},
          {"mean", number_json(one.mean)},
          {"se", number_json(one.se)},
          {"ci95", interval_json(one.ci95)}};
}

GroupJson contrast_json(const GroupedMeasure& of, const GroupContrast& one) {
  GroupJson out{
      {"reference", of.groups.front()},
      {"compared", of.groups[one.group]},
      {"renderer", renderer_json(of, one.condition)},
      {"minus_renderer", one.of_difference ? GroupJson(of.renderers.front()) : GroupJson(nullptr)},
      {"n_reference", one.n_reference},
      {"n", one.n},
      {"estimate", number_json(one.estimate)},
      {"se", number_json(one.se)},
      {"ci95", interval_json(one.ci95)},
      {"t", number_json(one.t)},
      {"df", number_json(one.df)},
      {"p", number_json(one.p)},
      {"p_holm", number_json(one.p_holm)}};
  if (!one.undefined.empty()) out["reason"] = one.undefined;
  return out;
}

GroupJson model_json(const GroupedMeasure& of, const GroupedMixedModel& model) {
  GroupJson out{{"formula",
                 "log(response_time) ~ group * renderer * shape + (1 + renderer | "
                 "participant)"},
                {"n_observations", model.n_observations},
                {"n_participants", model.n_participants}};
  if (!model.undefined.empty()) out["reason"] = model.undefined;
  if (!model.singular.empty()) out["singular"] = model.singular;
  out["effects"] = GroupJson::object();
  for (const GroupEffect& effect : model.effects)
    out["effects"][effect.name] = {{"num_df", number_json(effect.num_df)},
                                   {"den_df", number_json(effect.den_df)},
                                   {"f", number_json(effect.f)},
                                   {"p", number_json(effect.p)}};
  out["means"] = GroupJson::array();
  for (const ModelMean& one : model.means)
    out["means"].push_back({{"group", of.groups[one.group]},
                            {"renderer", of.renderers[one.renderer]},
                            {"estimate", number_json(one.value.estimate)},
                            {"se", number_json(one.value.se)},
                            {"df", number_json(one.value.df_satterthwaite)},
                            {"ci95", interval_json(one.value.ci95)}});
  return out;
}

GroupJson measure_json(const GroupedMeasure& of) {
  GroupJson out{{"measure", of.measure}, {"task", of.task},           {"block", of.block_name},
                {"stimulus", of.shape},  {"unit", of.unit},           {"logarithms", of.logarithms},
                {"groups", of.groups},   {"renderers", of.renderers}, {"n", of.result.anova.n}};
  if (!of.result.anova.undefined.empty()) out["reason"] = of.result.anova.undefined;
  out["left_out"] = GroupJson::array();
  for (const std::size_t row : of.result.dropped)
    out["left_out"].push_back(of.figures[row].participant);
  out["effects"] = GroupJson::object();
  for (const GroupEffect& effect : of.result.anova.effects)
    out["effects"][effect.name] = group_effect_json(effect);
  if (of.model) out["mixed_model"] = model_json(of, *of.model);
  out["means"] = GroupJson::array();
  for (const GroupMarginal& one : of.result.marginals)
    out["means"].push_back(marginal_json(of, one));
  out["contrasts"] = GroupJson::array();
  for (const GroupContrast& one : of.result.contrasts)
    out["contrasts"].push_back(contrast_json(of, one));
  return out;
}

/// "Thresholds of 'stiffness', ball"
std::string title_of(const GroupedMeasure& of) {
  std::string out = of.measure == "time"       ? "Identification times"
                    : of.measure == "accuracy" ? "Accuracy of identification"
                                               : measure_plural(of.measure);
  for (const std::string& part : {of.block_name, of.shape}) {
    if (!part.empty()) out += ", " + printable(part);
  }
  return out;
}

/// On the scale of the figures: of logarithms their exponential.
std::string figure_text(const GroupedMeasure& of, const std::optional<double>& value) {
  return value ? short_number(of.logarithms ? std::exp(*value) : *value) : kMissing;
}

std::string figure_text(const GroupedMeasure& of, const std::optional<Interval>& interval) {
  if (!interval) return kMissing;
  return "[" + figure_text(of, std::optional(interval->low)) + ", " +
         figure_text(of, std::optional(interval->high)) + "]";
}

std::string condition_of(const GroupedMeasure& of, const std::optional<std::size_t>& condition) {
  if (condition) return printable(of.renderers[*condition]);
  return of.renderers.size() > 1 ? "both or all" : printable(of.renderers.front());
}

/// "old - young", "old / young", with what is compared.
std::string group_contrast_name(const GroupedMeasure& of, const GroupContrast& one) {
  const std::string pair = printable(of.groups[one.group]) + (of.logarithms ? " / " : " - ") +
                           printable(of.groups.front());
  if (!one.of_difference) return pair;
  return pair + " of " + printable(of.renderers[*one.condition]) + (of.logarithms ? " / " : " - ") +
         printable(of.renderers.front());
}

std::string f_test_text(const GroupEffect& effect) {
  if (!effect.f) return effect.undefined;
  std::string text = "F(" + short_number(*effect.num_df) + ", " + short_number(*effect.den_df) +
                     ") = " + fixed(*effect.f, 2) + ", " + p_phrase(*effect.p);
  if (effect.gg_p)
    text += " (Greenhouse-Geisser " + p_phrase(*effect.gg_p) + ", epsilon " +
            fixed(*effect.gg_epsilon, 2) + ")";
  if (effect.generalized_eta_squared)
    text += ", generalised eta squared " + fixed(*effect.generalized_eta_squared, 3);
  return text;
}

std::string group_contrast_text(const GroupedMeasure& of, const GroupContrast& one) {
  std::string text = group_contrast_name(of, one);
  if (!one.of_difference && of.renderers.size() > 1) text += ", " + condition_of(of, one.condition);
  text += ": " + figure_text(of, one.estimate) + " " + figure_text(of, one.ci95);
  if (!one.t) return text + " (" + one.undefined + ")";
  text += ", t(" + short_number(*one.df) + ") = " + fixed(*one.t, 2) + ", " + p_phrase(*one.p);
  if (one.p_holm && of.result.contrasts.size() > 1)
    text += " (" + p_phrase(*one.p_holm) + " adjusted over " +
            std::to_string(of.result.contrasts.size()) + " contrasts, Holm)";
  return text;
}

std::string group_caption(const std::string& caption, const std::string& label) {
  return label.empty() ? caption : caption + " (" + label + ")";
}

Table group_means_table(const GroupedMeasure& of, const std::string& label) {
  Table out;
  out.caption = group_caption(title_of(of) + " by group", label);
  out.header = {"Group", "Renderer", "n", of.unit.empty() ? "Mean" : "Mean (" + of.unit + ")",
                "95 % interval"};
  out.n_names = 2;
  for (const GroupMarginal& one : of.result.marginals) {
    out.rows.push_back({printable(of.groups[one.group]), condition_of(of, one.condition),
                        std::to_string(one.n), figure_text(of, one.mean),
                        figure_text(of, one.ci95)});
  }
  if (of.logarithms) out.notes.emplace_back("Geometric means over participants.");
  if (!of.result.dropped.empty()) {
    std::string names;
    for (const std::size_t row : of.result.dropped)
      names += (names.empty() ? "" : ", ") + printable(of.figures[row].participant);
    out.notes.push_back("Without a value in every condition, left out: " + names + ".");
  }
  return out;
}

Table group_effects_table(const GroupedMeasure& of, const std::string& label) {
  Table out;
  out.caption = group_caption(title_of(of) + ": mixed analysis of variance", label);
  out.header = {"Effect", "df", "F", "p", "p (Greenhouse-Geisser)", "Generalised eta squared"};
  for (const GroupEffect& one : of.result.anova.effects) {
    out.rows.push_back(
        {one.name,
         one.num_df ? short_number(*one.num_df) + ", " + short_number(*one.den_df) : kMissing,
         number(one.f, 2), p_or_missing(one.p), p_or_missing(one.gg_p),
         number(one.generalized_eta_squared, 3)});
    if (!one.undefined.empty()) out.notes.push_back(one.name + ": " + one.undefined + ".");
  }
  if (!of.result.anova.undefined.empty()) out.notes.push_back(of.result.anova.undefined + ".");
  out.notes.emplace_back("Type III: every group counts equally, whatever its size.");
  return out;
}

/// The mixed model's effects; without rows if there is none.
Table group_model_table(const GroupedMeasure& of, const std::string& label) {
  Table out;
  out.caption = group_caption(title_of(of) + ": linear mixed model of single trials", label);
  out.header = {"Effect", "df", "F", "p"};
  if (!of.model) return out;
  for (const GroupEffect& one : of.model->effects) {
    out.rows.push_back(
        {one.name, one.num_df ? short_number(*one.num_df) + ", " + fixed(*one.den_df, 1) : kMissing,
         number(one.f, 2), p_or_missing(one.p)});
  }
  if (!of.model->singular.empty()) out.notes.push_back("Singular: " + of.model->singular + ".");
  out.notes.emplace_back(
      "log(response_time) ~ group * renderer * shape + (1 + renderer | participant), REML, type "
      "III, degrees of freedom by Satterthwaite.");
  return out;
}

Table group_contrasts_table(const GroupedMeasure& of, const std::string& label) {
  Table out;
  out.caption = group_caption(title_of(of) + ": groups compared (Welch's t)", label);
  out.header = {
      "Contrast", "Renderer", of.logarithms ? "Ratio" : "Difference", "95 % interval", "t", "df",
      "p",        "p (Holm)"};
  out.n_names = 2;
  for (const GroupContrast& one : of.result.contrasts) {
    out.rows.push_back(
        {group_contrast_name(of, one), one.of_difference ? "" : condition_of(of, one.condition),
         figure_text(of, one.estimate), figure_text(of, one.ci95), number(one.t, 2),
         one.df ? short_number(*one.df) : kMissing, p_or_missing(one.p), p_or_missing(one.p_holm)});
    if (!one.undefined.empty())
      out.notes.push_back(group_contrast_name(of, one) + ": " + one.undefined + ".");
  }
  return out;
}

}  // namespace

void put_groups(const std::vector<GroupedMeasure>& measures, GroupJson& out) {
  if (measures.empty()) return;
  std::vector<std::string> within{"renderer"};
  for (const GroupedMeasure& one : measures) {
    if (one.measure == "time") within = {"renderer", "shape"};
  }
  out["design"] = {{"between", {"group"}}, {"within", within}, {"groups", measures.front().groups}};
  out["between_groups"] = GroupJson::array();
  for (const GroupedMeasure& one : measures) {
    out["between_groups"].push_back(measure_json(one));
    GroupJson* place = &out["effects"][one.measure];
    const bool several = std::ranges::any_of(measures, [&](const GroupedMeasure& other) {
      return other.measure == one.measure && other.block_name == one.block_name &&
             other.shape != one.shape;
    });
    if (!one.block_name.empty()) place = &(*place)[one.block_name];
    if (several) place = &(*place)[one.shape];
    for (const GroupEffect& effect : one.result.anova.effects)
      (*place)[effect.name] = group_effect_json(effect);
  }
}

std::string groups_text(const std::vector<GroupedMeasure>& measures) {
  std::string text;
  for (const GroupedMeasure& one : measures) {
    text += title_of(one) + " by group";
    for (std::size_t i = 0; i < one.groups.size(); ++i) {
      text += (i == 0 ? " (" : ", ") + printable(one.groups[i]) + " " +
              std::to_string(i < one.result.anova.n.size() ? one.result.anova.n[i] : 0);
    }
    text += ")\n";
    if (!one.result.anova.undefined.empty()) text += "  " + one.result.anova.undefined + "\n";
    for (const GroupMarginal& mean : one.result.marginals) {
      text += "  " + printable(one.groups[mean.group]) + ", " + condition_of(one, mean.condition) +
              ": " + figure_text(one, mean.mean) + (one.unit.empty() ? "" : " " + one.unit) + " " +
              figure_text(one, mean.ci95) + "\n";
    }
    for (const GroupEffect& effect : one.result.anova.effects)
      text += "  " + effect.name + ": " + f_test_text(effect) + "\n";
    if (one.model && !one.model->effects.empty()) text += "  mixed model of single trials\n";
    for (std::size_t i = 0; one.model && i < one.model->effects.size(); ++i)
      text +=
          "    " + one.model->effects[i].name + ": " + f_test_text(one.model->effects[i]) + "\n";
    for (const GroupContrast& contrast : one.result.contrasts)
      text += "  " + group_contrast_text(one, contrast) + "\n";
    text += "\n";
  }
  return text;
}

std::vector<Table> groups_tables(const std::vector<GroupedMeasure>& measures,
                                 const std::string& label) {
  std::vector<Table> out;
  for (const GroupedMeasure& one : measures) {
    out.push_back(group_means_table(one, label));
    out.push_back(group_effects_table(one, label));
    if (Table model = group_model_table(one, label); !model.rows.empty())
      out.push_back(std::move(model));
    out.push_back(group_contrasts_table(one, label));
  }
  return out;
}

std::string groups_conclusion(const std::vector<GroupedMeasure>& measures) {
  struct Candidate {
    const GroupedMeasure* measure;
    const GroupEffect* effect;
  };
  std::vector<Candidate> candidates;
  std::vector<std::optional<double>> p;
  for (const GroupedMeasure& one : measures) {
    for (const GroupEffect& effect : one.result.anova.effects) {
      if (!effect.name.starts_with("group")) continue;
      candidates.push_back({&one, &effect});
      p.push_back(effect.gg_p ? effect.gg_p : effect.p);
    }
  }
  if (candidates.empty()) return "";
  const auto adjusted = holm(p);
  std::size_t best = 0;
  for (std::size_t i = 1; i < adjusted.size(); ++i) {
    if (adjusted[i] && (!adjusted[best] || *adjusted[i] < *adjusted[best])) best = i;
  }
  if (!adjusted[best]) return "The groups cannot be compared.";
  const std::string what = title_of(*candidates[best].measure);
  const std::string tests = std::to_string(candidates.size());
  if (*adjusted[best] >= kAlpha)
    return "No effect of the group is clear (" + tests + " effects; the least " +
           p_phrase(*adjusted[best]) + ", Holm).";
  const std::string& effect = candidates[best].effect->name;
  if (effect == "group")
    return what + " differ between groups (" + p_phrase(*adjusted[best]) + " adjusted over " +
           tests + " effects, Holm).";
  return what + ": the effect of " + effect.substr(std::string("group:").size()) +
         " differs between groups (" + p_phrase(*adjusted[best]) + " adjusted over " + tests +
         " effects, Holm).";
}

}  // namespace palpate::analysis
