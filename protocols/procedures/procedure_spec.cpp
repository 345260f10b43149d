#include "protocols/procedures/procedure_spec.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "protocols/procedures/procedure.h"

namespace palpate::protocols {
namespace {

double raised(double base, int exponent) {
  double product = 1;
  for (int i = 0; i < exponent; ++i) product *= base;
  return product;
}

/// Probability of `down` successes in a row before `up` failures in a row (Feller 1968, XIII.7).
double probability_of_harder(int up, int down, double p) {
  const double successes = raised(p, down - 1), failures = raised(1 - p, up - 1);
  return successes * (1 - raised(1 - p, up)) / (successes + failures - successes * failures);
}

}  // namespace

double convergence_point(const Staircase& spec) {
  double low = 0, high = 1;
  for (int i = 0; i < 60; ++i) {
    const double p = 0.5 * (low + high);
    const double harder = probability_of_harder(spec.up, spec.down, p);
    (harder < (1 - harder) * spec.step_ratio ? low : high) = p;
  }
  return 0.5 * (low + high);
}

double step_ratio_for(double target, int down) {
  const double harder = raised(target, down);
  return harder / (1 - harder);
}

std::vector<std::string> grid_names(FieldForm form) {
  std::vector<std::string> names = parameter_names(form);
  if (!has_two_lapses(form)) names.emplace_back("guess");
  names.emplace_back("lapse");
  return names;
}

std::vector<LevelPoint> product_of(const std::vector<std::vector<double>>& levels) {
  std::vector<LevelPoint> points{{}};
  for (const std::vector<double>& values : levels) {
    std::vector<LevelPoint> more;
    more.reserve(points.size() * values.size());
    for (const LevelPoint& point : points) {
      for (const double value : values) more.emplace_back(point).push_back(value);
    }
    points = std::move(more);
  }
  return points;
}

const char* kind_of(const ProcedureSpec& spec) {
  static constexpr std::array kKinds = {"constant", "staircase", "quest_plus", "limits",
                                        "ask",      "sobol",     "ask",        "quest_plus"};
  static_assert(kKinds.size() == std::variant_size_v<ProcedureSpec>);
  return kKinds[spec.index()];
}

std::optional<LevelScale> scale_of(const ProcedureSpec& spec) {
  if (const auto* staircase = std::get_if<Staircase>(&spec)) return staircase->scale;
  if (const auto* quest = std::get_if<QuestPlus>(&spec)) return quest->function.scale;
  if (const auto* limits = std::get_if<Limits>(&spec)) return limits->scale;
  if (const auto* asked = std::get_if<Asked>(&spec)) return asked->scale;
  return std::nullopt;
}

std::optional<Easier> easier_of(const ProcedureSpec& spec) {
  if (const auto* staircase = std::get_if<Staircase>(&spec)) return staircase->easier;
  if (const auto* quest = std::get_if<QuestPlus>(&spec)) return quest->function.easier;
  if (const auto* limits = std::get_if<Limits>(&spec)) return limits->easier;
  if (const auto* asked = std::get_if<Asked>(&spec)) return asked->easier;
  if (const auto* field = std::get_if<FieldQuestPlus>(&spec)) return field->function.easier;
  return std::nullopt;
}

bool is_asked(const ProcedureSpec& spec) {
  return std::holds_alternative<Asked>(spec) || std::holds_alternative<AskedPoints>(spec);
}

std::vector<double> levels_to_check(const ProcedureSpec& spec) {
  if (const auto* constant = std::get_if<ConstantStimuli>(&spec)) return constant->levels;
  if (const auto* quest = std::get_if<QuestPlus>(&spec)) return quest->levels;
  if (const auto* limits = std::get_if<Limits>(&spec)) {
    std::vector<double> levels = series_levels(*limits, true, 0);
    const std::vector<double> descending = series_levels(*limits, false, 0);
    levels.insert(levels.end(), descending.begin(), descending.end());
    return levels;
  }
  if (const auto* asked = std::get_if<Asked>(&spec)) return {asked->min, asked->max};
  if (const auto* staircase = std::get_if<Staircase>(&spec))
    return {staircase->min, staircase->start, staircase->max};
  return {};
}

std::vector<LevelPoint> points_to_check(const ProcedureSpec& spec) {
  if (const auto* constant = std::get_if<ConstantStimuli>(&spec)) return constant->points;
  if (const auto* field = std::get_if<FieldQuestPlus>(&spec)) {
    std::size_t size = 1;
    for (const auto& levels : field->levels) size *= levels.size();
    if (size <= kMostCheckedPoints) return product_of(field->levels);
  }
  const std::vector<DimensionRange> ranges = ranges_of(spec);
  if (ranges.empty()) return {};
  std::vector<std::vector<double>> ends;
  for (const DimensionRange& range : ranges) {
    ends.push_back({range.min});
    if (range.max > range.min) ends.back().push_back(range.max);
  }
  return product_of(ends);
}

std::vector<DimensionRange> ranges_of(const ProcedureSpec& spec) {
  if (const auto* sobol = std::get_if<SobolPoints>(&spec)) return sobol->ranges;
  if (const auto* asked = std::get_if<AskedPoints>(&spec)) return asked->own.ranges;
  std::vector<DimensionRange> out;
  const auto add = [&](const std::vector<double>& values) {
    const auto [least, most] = std::ranges::minmax(values);
    out.push_back({least, most, LevelScale::linear});
  };
  if (const auto* field = std::get_if<FieldQuestPlus>(&spec)) {
    for (const auto& levels : field->levels) add(levels);
  }
  const auto* constant = std::get_if<ConstantStimuli>(&spec);
  if (constant == nullptr || constant->points.empty()) return out;
  for (std::size_t d = 0; d < constant->points.front().size(); ++d) {
    std::vector<double> values;
    for (const LevelPoint& point : constant->points) values.push_back(point[d]);
    add(values);
  }
  return out;
}

std::size_t most_trials(const ProcedureSpec& spec) {
  if (const auto* constant = std::get_if<ConstantStimuli>(&spec))
    return (constant->levels.size() + constant->points.size()) *
           static_cast<std::size_t>(constant->repetitions);
  if (const auto* quest = std::get_if<QuestPlus>(&spec))
    return static_cast<std::size_t>(quest->stop_trials);
  if (const auto* limits = std::get_if<Limits>(&spec))
    return static_cast<std::size_t>(limits->series) * series_levels(*limits, true, 0).size();
  if (const auto* asked = std::get_if<Asked>(&spec))
    return static_cast<std::size_t>(asked->stop_trials);
  if (const auto* sobol = std::get_if<SobolPoints>(&spec))
    return static_cast<std::size_t>(sobol->trials);
  if (const auto* asked = std::get_if<AskedPoints>(&spec))
    return static_cast<std::size_t>(asked->own.trials);
  if (const auto* field = std::get_if<FieldQuestPlus>(&spec))
    return static_cast<std::size_t>(field->stop_trials);
  return static_cast<std::size_t>(std::get<Staircase>(spec).stop_trials);
}

}  // namespace palpate::protocols
