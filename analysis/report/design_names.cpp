#include "analysis/report/design_names.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "analysis/report/tables.h"
#include "analysis/statistics/task_analysis.h"
#include "analysis/text.h"

namespace palpate::analysis {
namespace {

/// "ray", "surface rough"
std::string condition_name(const GroupedMeasure& of, const DesignCondition& condition) {
  const StudyFactor& factor = of.within[condition.factor];
  const std::string level = printable(factor.levels[condition.level]);
  return condition.factor == 0 ? level : printable(factor.name) + " " + level;
}

}  // namespace

OrderedJson design_number_json(const std::optional<double>& value) {
  return value && std::isfinite(*value) ? OrderedJson(*value) : OrderedJson(nullptr);
}

OrderedJson design_interval_json(const std::optional<Interval>& interval) {
  return interval ? OrderedJson{interval->low, interval->high} : OrderedJson(nullptr);
}

const std::vector<std::string>& renderers_of_measure(const GroupedMeasure& of) {
  return of.within.front().levels;
}

OrderedJson design_group_json(const GroupedMeasure& of, std::size_t group) {
  return of.groups.empty() ? OrderedJson(nullptr) : OrderedJson(of.groups[group]);
}

void put_condition(const GroupedMeasure& of, const std::optional<DesignCondition>& condition,
                   OrderedJson& out) {
  const bool of_renderer = condition && condition->factor == 0;
  out["renderer"] =
      of_renderer ? OrderedJson(renderers_of_measure(of)[condition->level]) : OrderedJson(nullptr);
  if (!of.crossed) return;
  const bool of_factor = condition && condition->factor > 0;
  const StudyFactor* const factor = of_factor ? &of.within[condition->factor] : nullptr;
  out["factor"] = of_factor ? OrderedJson(factor->name) : OrderedJson(nullptr);
  out["level"] = of_factor ? OrderedJson(factor->levels[condition->level]) : OrderedJson(nullptr);
}

OrderedJson contrast_json(const GroupedMeasure& of, const GroupContrast& one) {
  OrderedJson out = one.within ? OrderedJson{{"within", design_group_json(of, one.group)}}
                               : OrderedJson{{"reference", of.groups.front()},
                                             {"compared", of.groups[one.group]}};
  put_condition(of, one.condition, out);
  const StudyFactor* const factor = one.of_difference ? &of.within[one.condition->factor] : nullptr;
  const bool of_renderer = factor != nullptr && one.condition->factor == 0;
  out["minus_renderer"] = of_renderer ? OrderedJson(factor->levels.front()) : OrderedJson(nullptr);
  if (of.crossed)
    out["minus_level"] = factor != nullptr && !of_renderer ? OrderedJson(factor->levels.front())
                                                           : OrderedJson(nullptr);
  out["n_reference"] = one.n_reference;
  out["n"] = one.n;
  out["estimate"] = design_number_json(one.estimate);
  out["se"] = design_number_json(one.se);
  out["ci95"] = design_interval_json(one.ci95);
  out["t"] = design_number_json(one.t);
  out["df"] = design_number_json(one.df);
  out["p"] = design_number_json(one.p);
  out["p_holm"] = design_number_json(one.p_holm);
  if (!one.undefined.empty()) out["reason"] = one.undefined;
  return out;
}

std::string measure_title(const GroupedMeasure& of) {
  std::string out = of.measure == "time"       ? "Identification times"
                    : of.measure == "accuracy" ? "Accuracy of identification"
                                               : measure_plural(of.measure);
  for (const std::string& part : {of.block_name, of.shape}) {
    if (!part.empty()) out += ", " + printable(part);
  }
  return out;
}

std::string figure_text(const GroupedMeasure& of, const std::optional<double>& value) {
  return value ? short_number(of.logarithms ? std::exp(*value) : *value) : kMissing;
}

std::string figure_text(const GroupedMeasure& of, const std::optional<Interval>& interval) {
  if (!interval) return kMissing;
  return "[" + figure_text(of, std::optional(interval->low)) + ", " +
         figure_text(of, std::optional(interval->high)) + "]";
}

std::string condition_of(const GroupedMeasure& of,
                         const std::optional<DesignCondition>& condition) {
  if (condition) return condition_name(of, *condition);
  if (of.crossed) return "all cells";
  const std::vector<std::string>& renderers = renderers_of_measure(of);
  return renderers.size() > 1 ? "both or all" : printable(renderers.front());
}

std::string group_contrast_name(const GroupedMeasure& of, const GroupContrast& one) {
  const std::string minus = of.logarithms ? " / " : " - ";
  const std::string levels = one.of_difference
                                 ? condition_name(of, *one.condition) + minus +
                                       printable(of.within[one.condition->factor].levels.front())
                                 : "";
  if (one.within)
    return levels + (of.groups.empty() ? "" : " in " + printable(of.groups[one.group]));
  const std::string pair = printable(of.groups[one.group]) + minus + printable(of.groups.front());
  return one.of_difference ? pair + " of " + levels : pair;
}

std::string labelled_caption(const std::string& caption, const std::string& label) {
  return label.empty() ? caption : caption + " (" + label + ")";
}

}  // namespace palpate::analysis
