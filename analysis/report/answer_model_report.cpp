#include "analysis/report/answer_model_report.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

#include "analysis/report/design_names.h"
#include "analysis/statistics/task_analysis.h"
#include "analysis/text.h"

namespace palpate::analysis {
namespace {

/// "probit(answer) ~ level * group * renderer + (1 + level | participant)"
std::string answer_formula(const AnswerModel& model) {
  std::string out = model.log_levels ? "probit(answer) ~ log10(level)" : "probit(answer) ~ level";
  if (!model.pse.of.groups.empty()) out += " * group";
  for (const StudyFactor& factor : model.pse.of.within) {
    if (factor.levels.size() > 1) out += " * " + factor.name;
  }
  return out + (model.log_levels ? " + (1 + log10(level) | participant)"
                                 : " + (1 + level | participant)");
}

OrderedJson answer_figure_json(const AnswerFigure& figure) {
  return {{"estimate", design_number_json(figure.estimate)},
          {"se", design_number_json(figure.se)},
          {"ci95", design_interval_json(figure.ci95)},
          {"bootstrap_ci95", design_interval_json(figure.bootstrap_ci95)}};
}

OrderedJson answer_cell_json(const AnswerModel& model, const AnswerCell& cell) {
  OrderedJson out{{"group", design_group_json(model.pse.of, cell.group)}};
  for (std::size_t f = 0; f < cell.levels.size(); ++f)
    out[model.pse.of.within[f].name] = model.pse.of.within[f].levels[cell.levels[f]];
  out["n_answers"] = cell.n_trials;
  out["n_participants"] = cell.n_participants;
  out["intercept"] = cell.intercept;
  out["intercept_se"] = cell.intercept_se;
  out["slope"] = cell.slope;
  out["slope_se"] = cell.slope_se;
  out[model.pse.of.measure] = answer_figure_json(cell.pse);
  out[model.jnd.of.measure] = answer_figure_json(cell.jnd);
  if (!cell.undefined.empty()) out["reason"] = cell.undefined;
  return out;
}

OrderedJson answer_measure_json(const AnswerMeasure& measure) {
  OrderedJson out{{"logarithms", measure.of.logarithms},
                  {"effects", OrderedJson::object()},
                  {"contrasts", OrderedJson::array()}};
  for (const AnswerEffect& one : measure.effects)
    out["effects"][one.name] = {{"chi_squared", design_number_json(one.chi_squared)},
                                {"df", design_number_json(one.df)},
                                {"p", design_number_json(one.p)},
                                {"p_holm", design_number_json(one.p_holm)}};
  for (const AnswerContrast& one : measure.contrasts) {
    OrderedJson contrast = contrast_json(measure.of, one.contrast);
    for (const char* name : {"n_reference", "n", "df", "t"}) contrast.erase(name);
    contrast["z"] = design_number_json(one.contrast.t);
    contrast["bootstrap_ci95"] = design_interval_json(one.bootstrap_ci95);
    out["contrasts"].push_back(std::move(contrast));
  }
  return out;
}

OrderedJson answer_model_json(const AnswerModel& model) {
  OrderedJson out{{"task", model.task}, {"block", model.block_name}, {"stimulus", model.shape}};
  if (!model.undefined.empty()) {
    out["reason"] = model.undefined;
    return out;
  }
  out["formula"] = answer_formula(model);
  out["n_answers"] = model.n_answers;
  out["n_participants"] = model.n_participants;
  out["left_out"] = model.left_out;
  out["without_group"] = model.without_group;
  out["centre"] = model.centre;
  out["log_likelihood"] = model.log_likelihood;
  out["participants"] = {{"intercept_sd", model.intercept_sd},
                         {"slope_sd", model.slope_sd},
                         {"correlation", design_number_json(model.correlation)},
                         {"singular", model.singular}};
  out["bootstrap"] = {{"studies", model.bootstrapped}, {"without_value", model.failed}};
  out["cells"] = OrderedJson::array();
  for (const AnswerCell& cell : model.cells) out["cells"].push_back(answer_cell_json(model, cell));
  for (const AnswerMeasure* const measure : {&model.pse, &model.jnd})
    out[measure->of.measure] = answer_measure_json(*measure);
  return out;
}

std::string answer_cell_name(const AnswerModel& model, const AnswerCell& cell) {
  const GroupedMeasure& of = model.pse.of;
  std::string out = of.groups.empty() ? "" : printable(of.groups[cell.group]);
  for (std::size_t f = 0; f < cell.levels.size(); ++f) {
    const std::string level = printable(of.within[f].levels[cell.levels[f]]);
    out +=
        (out.empty() ? "" : ", ") + (f == 0 ? level : printable(of.within[f].name) + " " + level);
  }
  return out;
}

std::string plain_interval(const std::optional<Interval>& interval) {
  return interval ? "[" + short_number(interval->low) + ", " + short_number(interval->high) + "]"
                  : kMissing;
}

std::string plain_number(const std::optional<double>& value) {
  return value ? short_number(*value) : kMissing;
}

std::string answer_title(const AnswerModel& model) {
  std::string out = "Mixed model of all answers";
  for (const std::string& part : {model.block_name, model.shape}) {
    if (!part.empty()) out += ", " + printable(part);
  }
  return out;
}

/// "PSE (N/m)"
std::string answer_heading(const AnswerMeasure& measure) {
  const std::string& name = measure.of.measure;
  const std::string words = name == "pse"         ? "PSE"
                            : name == "threshold" ? "Threshold"
                            : name == "jnd"       ? "JND"
                                                  : "Weber fraction";
  const bool bare = measure.of.unit.empty() || name == "weber_fraction";
  return bare ? words : words + " (" + measure.of.unit + ")";
}

std::vector<std::string> answer_notes(const AnswerModel& model) {
  std::vector<std::string> out{
      printable(answer_formula(model), 400) +
      ", Laplace's approximation. Lapses and guesses are not modelled: compare the hierarchical "
      "model, which has them. Intervals by the delta method; tests by Wald."};
  if (model.bootstrapped > 0) {
    const bool made = model.cells.front().pse.bootstrap_ci95.has_value();
    const std::string studies = std::to_string(model.bootstrapped) + " simulated studies";
    const std::string failed = std::to_string(model.failed);
    out.push_back(!made ? "No bootstrap: " + failed + " of " + studies +
                              " had no value, so intervals of the others would be too short."
                  : model.failed > 0 ? "Bootstrap: 95 % of " + studies + ", without " + failed +
                                           " that had no value."
                                     : "Bootstrap: 95 % of " + studies + " of the model.");
  }
  out.push_back(
      "Participants differ with a standard deviation of " + short_number(model.intercept_sd) +
      " (intercept, at the mean level) and " + short_number(model.slope_sd) + " (slope)" +
      (model.singular ? "; the fit is singular: a direction of it does not vary" : "") + ".");
  if (!model.left_out.empty())
    out.push_back("Left out, with reversed answers: " + printable(joined(model.left_out), 400) +
                  ".");
  if (!model.without_group.empty())
    out.push_back("Left out, without a group: " + printable(joined(model.without_group), 400) +
                  ".");
  return out;
}

Table answer_cells_table(const AnswerModel& model, const std::string& label) {
  Table out;
  out.caption = labelled_caption(answer_title(model), label);
  out.header = {"Cell",          "Answers",   answer_heading(model.pse),
                "95 % interval", "Bootstrap", answer_heading(model.jnd),
                "95 % interval", "Bootstrap"};
  for (const AnswerCell& cell : model.cells) {
    out.rows.push_back({answer_cell_name(model, cell), std::to_string(cell.n_trials),
                        plain_number(cell.pse.estimate), plain_interval(cell.pse.ci95),
                        plain_interval(cell.pse.bootstrap_ci95), plain_number(cell.jnd.estimate),
                        plain_interval(cell.jnd.ci95), plain_interval(cell.jnd.bootstrap_ci95)});
    if (!cell.undefined.empty())
      out.notes.push_back(answer_cell_name(model, cell) + ": " + cell.undefined + ".");
  }
  for (std::string& note : answer_notes(model)) out.notes.push_back(std::move(note));
  return out;
}

Table answer_effects_table(const AnswerModel& model, const std::string& label) {
  Table out;
  out.caption = labelled_caption(answer_title(model) + ": effects", label);
  out.header = {"Effect", "Of", "df", "Chi squared", "p", "p (Holm)"};
  out.n_names = 2;
  for (const AnswerMeasure* const measure : {&model.pse, &model.jnd}) {
    for (const AnswerEffect& one : measure->effects)
      out.rows.push_back({one.name, measure_plural(measure->of.measure), plain_number(one.df),
                          number(one.chi_squared, 2), p_or_missing(one.p),
                          p_or_missing(one.p_holm)});
  }
  out.notes = {"Wald's test; JNDs and Weber fractions by the logarithm of their width."};
  return out;
}

Table answer_contrasts_table(const AnswerModel& model, const AnswerMeasure& measure,
                             const std::string& label) {
  Table out;
  out.caption = labelled_caption(
      answer_title(model) + ": " + measure_plural(measure.of.measure) + " compared", label);
  out.header = {"Contrast",
                "Condition",
                measure.of.logarithms ? "Ratio" : "Difference",
                "95 % interval",
                "Bootstrap",
                "z",
                "p",
                "p (Holm)"};
  out.n_names = 2;
  for (const AnswerContrast& one : measure.contrasts) {
    out.rows.push_back(
        {group_contrast_name(measure.of, one.contrast),
         one.contrast.of_difference ? "" : condition_of(measure.of, one.contrast.condition),
         figure_text(measure.of, one.contrast.estimate), figure_text(measure.of, one.contrast.ci95),
         figure_text(measure.of, one.bootstrap_ci95), number(one.contrast.t, 2),
         p_or_missing(one.contrast.p), p_or_missing(one.contrast.p_holm)});
  }
  if (measure.of.measure == "weber_fraction")
    out.notes.emplace_back("Ratios of half the distance of the levels of 25 and 75 %, in logs.");
  return out;
}

}  // namespace

OrderedJson answer_models_json(const std::vector<AnswerModel>& models) {
  OrderedJson out = OrderedJson::array();
  for (const AnswerModel& model : models) out.push_back(answer_model_json(model));
  return out;
}

std::string answer_models_text(const std::vector<AnswerModel>& models) {
  std::string text;
  for (const AnswerModel& model : models) {
    text += answer_title(model) + "\n";
    if (!model.undefined.empty()) {
      text += "  none: " + model.undefined + "\n\n";
      continue;
    }
    for (const AnswerCell& cell : model.cells) {
      text += "  " + answer_cell_name(model, cell) + ": ";
      if (!cell.undefined.empty()) {
        text += cell.undefined + "\n";
        continue;
      }
      text += answer_heading(model.pse) + " " + plain_number(cell.pse.estimate) + " " +
              plain_interval(cell.pse.ci95) + ", " + answer_heading(model.jnd) + " " +
              plain_number(cell.jnd.estimate) + " " + plain_interval(cell.jnd.ci95) + "\n";
    }
    for (const AnswerMeasure* const measure : {&model.pse, &model.jnd}) {
      for (const AnswerEffect& one : measure->effects) {
        if (one.p)
          text += "  " + measure_plural(measure->of.measure) + ", " + one.name + ": chi squared(" +
                  short_number(*one.df) + ") = " + fixed(*one.chi_squared, 2) + ", " +
                  p_phrase(*one.p) + "\n";
      }
    }
    for (const std::string& note : answer_notes(model)) text += "  " + note + "\n";
    text += "\n";
  }
  return text;
}

std::vector<Table> answer_model_tables(const std::vector<AnswerModel>& models,
                                       const std::string& label) {
  std::vector<Table> out;
  for (const AnswerModel& model : models) {
    if (!model.undefined.empty()) {
      Table& none = out.emplace_back();
      none.caption = labelled_caption(answer_title(model), label);
      none.header = {"Cell"};
      none.notes = {"None: " + model.undefined + "."};
      continue;
    }
    out.push_back(answer_cells_table(model, label));
    for (Table one :
         {answer_effects_table(model, label), answer_contrasts_table(model, model.pse, label),
          answer_contrasts_table(model, model.jnd, label)}) {
      if (!one.rows.empty()) out.push_back(std::move(one));
    }
  }
  return out;
}

}  // namespace palpate::analysis
