#include "analysis/report/design_report.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <optional>

#include "analysis/report/design_names.h"
#include "analysis/statistics/task_analysis.h"
#include "analysis/text.h"

namespace palpate::analysis {
namespace {

using GroupJson = nlohmann::ordered_json;

GroupJson group_effect_json(const GroupEffect& effect) {
  GroupJson out{{"num_df", design_number_json(effect.num_df)},
                {"den_df", design_number_json(effect.den_df)},
                {"f", design_number_json(effect.f)},
                {"p", design_number_json(effect.p)},
                {"p_holm", design_number_json(effect.p_holm)},
                {"generalized_eta_squared", design_number_json(effect.generalized_eta_squared)}};
  if (effect.gg_epsilon) {
    out["gg_epsilon"] = *effect.gg_epsilon;
    out["gg_p"] = design_number_json(effect.gg_p);
  }
  if (!effect.undefined.empty()) out["reason"] = effect.undefined;
  return out;
}

GroupJson marginal_json(const GroupedMeasure& of, const GroupMarginal& one) {
  GroupJson out{{"group", design_group_json(of, one.group)}};
  put_condition(of, one.condition, out);
  out["n"] = one.n;
  out["mean"] = design_number_json(one.mean);
  out["se"] = design_number_json(one.se);
  out["ci95"] = design_interval_json(one.ci95);
  return out;
}

/// "log(response_time) ~ group * renderer * shape + (1 + renderer | participant)"
std::string formula_of(const GroupedMeasure& of, const DesignModel& model) {
  std::string fixed = of.groups.empty() ? "" : "group", random = "1";
  for (const StudyFactor& factor : of.within) {
    if (factor.levels.size() > 1) fixed += (fixed.empty() ? "" : " * ") + factor.name;
  }
  for (const std::string& slope : model.slopes) random += " + " + slope;
  if (fixed.empty()) fixed = "1";
  const std::string value = model.weighted ? of.measure : "response_time";
  return (of.logarithms ? "log(" + value + ")" : value) + " ~ " + fixed + " + (" + random +
         " | participant)";
}

GroupJson model_effect_json(const GroupEffect& effect) {
  GroupJson out{{"num_df", design_number_json(effect.num_df)},
                {"den_df", design_number_json(effect.den_df)},
                {"f", design_number_json(effect.f)},
                {"p", design_number_json(effect.p)},
                {"p_holm", design_number_json(effect.p_holm)}};
  if (!effect.undefined.empty()) out["reason"] = effect.undefined;
  return out;
}

GroupJson model_json(const GroupedMeasure& of, const DesignModel& model) {
  GroupJson out{{"formula", formula_of(of, model)},
                {"n_observations", model.n_observations},
                {"n_participants", model.n_participants},
                {"slopes_taken_out", model.taken_out}};
  if (model.weighted) {
    out.erase("slopes_taken_out");
    out["participant_sd"] = design_number_json(model.participant_sd);
    out["common_sd"] = design_number_json(model.common_sd);
    out["n_without_error"] = model.n_without_error;
  }
  if (!model.undefined.empty()) out["reason"] = model.undefined;
  if (!model.singular.empty()) out["singular"] = model.singular;
  out["effects"] = GroupJson::object();
  for (const GroupEffect& effect : model.effects)
    out["effects"][effect.name] = model_effect_json(effect);
  out["means"] = GroupJson::array();
  for (const ModelMean& one : model.means) {
    GroupJson& mean = out["means"].emplace_back();
    mean["group"] = design_group_json(of, one.group);
    put_condition(of, one.condition, mean);
    mean["estimate"] = design_number_json(one.value.estimate);
    mean["se"] = design_number_json(one.value.se);
    mean["df"] = design_number_json(one.value.df_satterthwaite);
    mean["ci95"] = design_interval_json(one.value.ci95);
  }
  out["contrasts"] = GroupJson::array();
  for (const GroupContrast& one : model.contrasts) {
    GroupJson contrast = contrast_json(of, one);
    contrast.erase("n_reference");
    contrast.erase("n");
    out["contrasts"].push_back(std::move(contrast));
  }
  return out;
}

GroupJson measure_json(const GroupedMeasure& of) {
  GroupJson out{{"measure", of.measure},  {"task", of.task},
                {"block", of.block_name}, {"stimulus", of.shape},
                {"unit", of.unit},        {"logarithms", of.logarithms},
                {"groups", of.groups},    {"renderers", renderers_of_measure(of)},
                {"n", of.result.anova.n}};
  if (of.crossed) {
    for (const StudyFactor& factor : of.within) out["within"][factor.name] = factor.levels;
  }
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

/// "by group, surface and size"
std::string design_words(const GroupedMeasure& of) {
  std::vector<std::string> names;
  if (!of.groups.empty()) names.emplace_back("group");
  for (std::size_t f = 1; of.crossed && f < of.within.size(); ++f)
    names.push_back(printable(of.within[f].name));
  std::string out = "by ";
  for (std::size_t i = 0; i < names.size(); ++i)
    out += (i == 0 ? "" : i + 1 < names.size() ? ", " : " and ") + names[i];
  return out;
}

/// "n of participants", of each group where there are groups
std::string sizes_text(const GroupedMeasure& of) {
  std::string out;
  for (std::size_t i = 0; i < of.result.anova.n.size(); ++i) {
    const std::string n = std::to_string(of.result.anova.n[i]);
    out += (out.empty() ? "" : ", ") +
           (of.groups.empty() ? n + " participants" : printable(of.groups[i]) + " " + n);
  }
  return out;
}

std::string contrast_kind(const GroupContrast& one) {
  return one.within ? "within participants" : "between groups";
}

std::string f_test_text(const GroupEffect& effect) {
  if (!effect.f) return effect.undefined;
  std::string text = "F(" + short_number(*effect.num_df) + ", " + short_number(*effect.den_df) +
                     ") = " + fixed(*effect.f, 2) + ", " + p_phrase(*effect.p);
  if (effect.gg_p)
    text += " (Greenhouse-Geisser " + p_phrase(*effect.gg_p) + ", epsilon " +
            fixed(*effect.gg_epsilon, 2) + ")";
  if (effect.p_holm) text += ", adjusted " + p_phrase(*effect.p_holm);
  if (effect.generalized_eta_squared)
    text += ", generalised eta squared " + fixed(*effect.generalized_eta_squared, 3);
  return text;
}

std::string group_contrast_text(const GroupedMeasure& of, const GroupContrast& one) {
  std::string text = group_contrast_name(of, one);
  const bool several = of.crossed || renderers_of_measure(of).size() > 1;
  if (!one.of_difference && several) text += ", " + condition_of(of, one.condition);
  text += ": " + figure_text(of, one.estimate) + " " + figure_text(of, one.ci95);
  if (!one.t) return text + " (" + one.undefined + ")";
  text += ", t(" + short_number(*one.df) + ") = " + fixed(*one.t, 2) + ", " + p_phrase(*one.p);
  const auto alike = std::ranges::count(of.result.contrasts, one.within, &GroupContrast::within);
  if (one.p_holm && alike > 1)
    text += " (" + p_phrase(*one.p_holm) + " adjusted over " + std::to_string(alike) +
            " contrasts " + contrast_kind(one) + ", Holm)";
  return text;
}

Table group_means_table(const GroupedMeasure& of, const std::string& label) {
  Table out;
  out.caption = labelled_caption(measure_title(of) + " " + design_words(of), label);
  out.header = {"Group", of.crossed ? "Condition" : "Renderer", "n",
                of.unit.empty() ? "Mean" : "Mean (" + of.unit + ")", "95 % interval"};
  out.n_names = 2;
  for (const GroupMarginal& one : of.result.marginals) {
    out.rows.push_back({of.groups.empty() ? "all" : printable(of.groups[one.group]),
                        condition_of(of, one.condition), std::to_string(one.n),
                        figure_text(of, one.mean), figure_text(of, one.ci95)});
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
  out.caption = labelled_caption(
      measure_title(of) + (of.groups.empty() ? ": analysis of variance of repeated measures"
                                             : ": mixed analysis of variance"),
      label);
  out.header = {
      "Effect", "df", "F", "p", "p (Greenhouse-Geisser)", "p (Holm)", "Generalised eta squared"};
  for (const GroupEffect& one : of.result.anova.effects) {
    out.rows.push_back(
        {one.name,
         one.num_df ? short_number(*one.num_df) + ", " + short_number(*one.den_df) : kMissing,
         number(one.f, 2), p_or_missing(one.p), p_or_missing(one.gg_p), p_or_missing(one.p_holm),
         number(one.generalized_eta_squared, 3)});
    if (!one.undefined.empty()) out.notes.push_back(one.name + ": " + one.undefined + ".");
  }
  if (!of.result.anova.undefined.empty()) out.notes.push_back(of.result.anova.undefined + ".");
  out.notes.emplace_back(
      "Holm: over these effects, or over those that the protocol names as tests.");
  if (!of.groups.empty())
    out.notes.emplace_back("Type III: every group counts equally, whatever its size.");
  return out;
}

std::vector<std::string> weighted_notes(const GroupedMeasure& of, const DesignModel& model) {
  std::vector<std::string> out{
      printable(formula_of(of, model)) +
      ", weighted by 1 / (se^2 + a common variance), REML, type III; degrees of freedom: "
      "participants less groups."};
  if (model.n_without_error > 0)
    out.push_back(counted(model.n_without_error, "figure", "figures") +
                  " undetermined or with an open interval, left out.");
  return out;
}

/// The terms of the mixed model, and those that were removed.
std::vector<std::string> model_notes(const GroupedMeasure& of) {
  const DesignModel& model = *of.model;
  if (model.weighted) return weighted_notes(of, model);
  std::vector<std::string> out{printable(formula_of(of, model)) +
                               ", REML, type III, degrees of freedom by Satterthwaite."};
  std::string names;
  for (const std::string& one : model.taken_out)
    names += (names.empty() ? "" : ", ") + printable(one);
  if (!names.empty())
    out.push_back("Participants' slopes that the data cannot tell were taken out, in this order: " +
                  names + ".");
  if (!model.singular.empty()) out.push_back("Singular: " + model.singular + ".");
  return out;
}

/// The mixed model's effects; without rows if there is none.
Table group_model_table(const GroupedMeasure& of, const std::string& label) {
  Table out;
  out.caption =
      labelled_caption(measure_title(of) + (of.model && of.model->weighted
                                                ? ": mixed model weighted by standard errors"
                                                : ": linear mixed model of single trials"),
                       label);
  out.header = {"Effect", "df", "F", "p", "p (Holm)"};
  if (!of.model) return out;
  for (const GroupEffect& one : of.model->effects) {
    out.rows.push_back(
        {one.name, one.num_df ? short_number(*one.num_df) + ", " + fixed(*one.den_df, 1) : kMissing,
         number(one.f, 2), p_or_missing(one.p), p_or_missing(one.p_holm)});
  }
  out.notes = model_notes(of);
  return out;
}

Table group_contrasts_table(const GroupedMeasure& of, const std::string& label) {
  Table out;
  out.caption =
      labelled_caption(measure_title(of) + (!of.crossed         ? ": groups compared (Welch's t)"
                                            : of.groups.empty() ? ": levels compared (paired t)"
                                                                : ": groups and levels compared "
                                                                  "(Welch's t, paired t)"),
                       label);
  out.header = {"Contrast",
                of.crossed ? "Condition" : "Renderer",
                of.logarithms ? "Ratio" : "Difference",
                "95 % interval",
                "t",
                "df",
                "p",
                "p (Holm)"};
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

/// "differ between groups", "depend on surface", "the effect of surface depends on size"
std::string finding_of(const std::string& what, const std::string& effect) {
  std::vector<std::string> names;
  for (std::size_t at = 0; at <= effect.size();) {
    const std::size_t end = std::min(effect.find(':', at), effect.size());
    names.push_back(effect.substr(at, end - at));
    at = end + 1;
  }
  const bool groups = names.front() == "group";
  if (groups) names.erase(names.begin());
  if (names.empty()) return what + " differ between groups";
  if (names.size() == 1 && !groups) return what + " depend on " + names.front();
  std::string effects = "the effect of " + names.front();
  for (std::size_t i = 1; i < names.size(); ++i) {
    const bool last = i + 1 == names.size();
    effects += (last && !groups    ? " depends on "
                : i == 1 && groups ? " with "
                                   : " and ") +
               names[i];
  }
  return what + ": " + effects + (groups ? " differs between groups" : "");
}

}  // namespace

void put_design(const StudyTable& table, const std::vector<GroupedMeasure>& measures,
                GroupJson& out) {
  if (measures.empty()) return;
  std::vector<std::string> within{"renderer"};
  std::size_t cells = 1;
  for (const StudyFactor& factor : table.factors) {
    within.push_back(factor.name);
    cells *= factor.levels.size();
  }
  const bool shapes = std::ranges::any_of(measures, [](const GroupedMeasure& one) {
    return one.measure == "time" && one.within.size() > 1;
  });
  if (shapes) within.emplace_back("shape");
  out["design"] = {
      {"between", GroupJson::array()}, {"within", within}, {"groups", measures.front().groups}};
  if (!measures.front().groups.empty()) out["design"]["between"].push_back("group");
  for (const StudyFactor& factor : table.factors)
    out["design"]["factors"][factor.name] = factor.levels;
  if (!table.factors.empty()) out["design"]["cells"] = cells;
  out["by_design"] = GroupJson::array();
  for (const GroupedMeasure& one : measures) {
    out["by_design"].push_back(measure_json(one));
    GroupJson* place = &out["effects"][one.measure];
    GroupJson* of_model = one.model ? &out["model_effects"][one.measure] : nullptr;
    const bool several = std::ranges::any_of(measures, [&](const GroupedMeasure& other) {
      return other.measure == one.measure && other.block_name == one.block_name &&
             other.shape != one.shape;
    });
    for (GroupJson** at : {&place, &of_model}) {
      if (*at == nullptr) continue;
      if (!one.block_name.empty()) *at = &(**at)[one.block_name];
      if (several) *at = &(**at)[one.shape];
    }
    for (const GroupEffect& effect : one.result.anova.effects)
      (*place)[effect.name] = group_effect_json(effect);
    for (std::size_t i = 0; one.model && i < one.model->effects.size(); ++i)
      (*of_model)[one.model->effects[i].name] = model_effect_json(one.model->effects[i]);
  }
}

std::string design_text(const std::vector<GroupedMeasure>& measures) {
  std::string text;
  for (const GroupedMeasure& one : measures) {
    text += measure_title(one) + " " + design_words(one) + " (" + sizes_text(one) + ")\n";
    if (!one.result.anova.undefined.empty()) text += "  " + one.result.anova.undefined + "\n";
    for (const GroupMarginal& mean : one.result.marginals) {
      text += "  " + (one.groups.empty() ? "" : printable(one.groups[mean.group]) + ", ") +
              condition_of(one, mean.condition) + ": " + figure_text(one, mean.mean) +
              (one.unit.empty() ? "" : " " + one.unit) + " " + figure_text(one, mean.ci95) + "\n";
    }
    for (const GroupEffect& effect : one.result.anova.effects)
      text += "  " + effect.name + ": " + f_test_text(effect) + "\n";
    if (one.model && !one.model->effects.empty()) {
      text += one.model->weighted ? "  mixed model weighted by standard errors\n"
                                  : "  mixed model of single trials\n";
      for (const std::string& note : model_notes(one)) text += "    " + note + "\n";
    }
    for (std::size_t i = 0; one.model && i < one.model->effects.size(); ++i)
      text +=
          "    " + one.model->effects[i].name + ": " + f_test_text(one.model->effects[i]) + "\n";
    for (const GroupContrast& contrast : one.result.contrasts)
      text += "  " + group_contrast_text(one, contrast) + "\n";
    text += "\n";
  }
  return text;
}

std::vector<Table> design_tables(const std::vector<GroupedMeasure>& measures,
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

std::string design_conclusion(const std::vector<GroupedMeasure>& measures,
                              const std::vector<std::string>& tests) {
  struct Candidate {
    const GroupedMeasure* measure;
    const GroupEffect* effect;
  };
  std::vector<Candidate> candidates;
  std::vector<std::optional<double>> p;
  for (const GroupedMeasure& one : measures) {
    for (const GroupEffect& effect : one.result.anova.effects) {
      // Without factors, those within participants are told of by themselves.
      if (!one.crossed && !effect.name.starts_with("group")) continue;
      if (!is_tested(tests, effect.name)) continue;
      candidates.push_back({&one, &effect});
      p.push_back(effect.p_value());
    }
  }
  if (candidates.empty()) return "";
  const auto adjusted = holm(p);
  std::size_t best = 0;
  for (std::size_t i = 1; i < adjusted.size(); ++i) {
    if (adjusted[i] && (!adjusted[best] || *adjusted[i] < *adjusted[best])) best = i;
  }
  const bool crossed = std::ranges::any_of(measures, &GroupedMeasure::crossed);
  if (!adjusted[best])
    return crossed ? "The cells of the design cannot be compared."
                   : "The groups cannot be compared.";
  const std::string count = std::to_string(candidates.size());
  if (*adjusted[best] >= kAlpha)
    return std::string(crossed ? "No effect of the design is clear ("
                               : "No effect of the group is clear (") +
           count + " effects; the least " + p_phrase(*adjusted[best]) + ", Holm).";
  return finding_of(measure_title(*candidates[best].measure), candidates[best].effect->name) +
         " (" + p_phrase(*adjusted[best]) + " adjusted over " + count + " effects, Holm).";
}

}  // namespace palpate::analysis
