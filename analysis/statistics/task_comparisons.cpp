#include "analysis/statistics/task_comparisons.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <tuple>
#include <utility>

#include "analysis/statistics/describe.h"
#include "analysis/statistics/task_analysis.h"
#include "data/base/cell_name.h"

namespace palpate::analysis {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using ValuesByParticipant = std::map<std::size_t, std::map<std::size_t, double>>;

/// The REML fit for a ratio of the participants' variance to the residual one.
struct InterceptModel {
  double criterion = 0;  // -2 log restricted likelihood, but for a constant
  double residual_variance = 0;
  VectorXd means;
  MatrixXd covariance;
};

InterceptModel fit_at(const ValuesByParticipant& values, std::size_t conditions, double ratio) {
  const auto size = static_cast<Eigen::Index>(conditions);
  MatrixXd information = MatrixXd::Zero(size, size);
  VectorXd score = VectorXd::Zero(size);
  double squares = 0, log_determinant = 0, count = 0;
  for (const auto& [participant, own] : values) {
    // V = I + ratio 1 1': its inverse subtracts a share of the participant's sum.
    const auto n = static_cast<double>(own.size());
    const double share = ratio / (1 + n * ratio);
    double sum = 0;
    for (const auto& [i, value] : own) {
      sum += value;
      squares += value * value;
      information(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(i)) += 1;
      for (const auto& [j, other] : own)
        information(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) -= share;
    }
    for (const auto& [i, value] : own) score[static_cast<Eigen::Index>(i)] += value - share * sum;
    squares -= share * sum * sum;
    log_determinant += std::log1p(n * ratio);
    count += n;
  }
  InterceptModel model;
  const auto solver = information.ldlt();
  model.means = solver.solve(score);
  const double df = count - static_cast<double>(conditions);
  model.residual_variance = (squares - score.dot(model.means)) / df;
  model.criterion = df * std::log(model.residual_variance) + log_determinant +
                    std::log(information.determinant());
  model.covariance = model.residual_variance * information.inverse();
  return model;
}

/// The best ratio: by golden section on the logarithm, or 0.
std::pair<double, InterceptModel> fit_intercept_model(const ValuesByParticipant& values,
                                                      std::size_t conditions) {
  const auto criterion = [&](double log_ratio) {
    return fit_at(values, conditions, std::exp(log_ratio)).criterion;
  };
  const double golden = 0.6180339887498949;
  double low = -20, high = 20;
  double a = high - golden * (high - low), b = low + golden * (high - low);
  double at_a = criterion(a), at_b = criterion(b);
  for (int i = 0; i < 80; ++i) {
    if (at_a < at_b) {
      high = b;
      b = a;
      at_b = at_a;
      a = high - golden * (high - low);
      at_a = criterion(a);
    } else {
      low = a;
      a = b;
      at_a = at_b;
      b = low + golden * (high - low);
      at_b = criterion(b);
    }
  }
  const double ratio = std::exp(0.5 * (low + high));
  InterceptModel best = fit_at(values, conditions, ratio), none = fit_at(values, conditions, 0);
  if (none.criterion <= best.criterion + 1e-9) return {0, none};
  return {ratio, best};
}

void add_mixed_model(ThresholdComparison& result, const ValuesByParticipant& values,
                     std::size_t conditions) {
  std::size_t count = 0;
  std::vector<std::size_t> by_condition(conditions, 0);
  for (const auto& [participant, own] : values) {
    for (const auto& [condition, value] : own) {
      ++count;
      ++by_condition[condition];
    }
  }
  for (const std::size_t n : by_condition) {
    if (n == 0) return;
  }
  if (count < conditions + values.size()) return;  // no degrees of freedom remain for the residuals
  const auto [ratio, model] = fit_intercept_model(values, conditions);
  if (!(model.residual_variance > 0)) return;
  result.residual_sd = std::sqrt(model.residual_variance);
  result.participant_sd = std::sqrt(ratio * model.residual_variance);
  for (ConditionDifference& difference : result.differences) {
    const auto i = static_cast<Eigen::Index>(difference.condition);
    difference.mixed_estimate = model.means[i] - model.means[0];
    difference.mixed_se =
        std::sqrt(model.covariance(i, i) + model.covariance(0, 0) - 2 * model.covariance(i, 0));
  }
}

struct Figures {
  std::vector<NamedFigure> of;
  std::size_t n_undetermined = 0;
  bool ratios = true;  ///< they have a true zero: no level is 0 or below

  void add(const std::string& participant, double value, std::optional<Interval> ci95 = {}) {
    of.push_back({participant, value, ci95});
  }
};

struct Measure {
  const char* name;
  std::function<Figures(const TaskCell&)> of;
  const char* unit = nullptr;  ///< null: that of the levels
};

/// A figure of a function and its 95 % interval.
struct MeasuredFigure {
  double value = 0;
  std::optional<Interval> ci95;
};

using FigureOfFunction = std::function<std::optional<MeasuredFigure>(const ParticipantFunction&)>;

std::optional<MeasuredFigure> measured(const std::optional<double>& value,
                                       const std::optional<Interval>& ci95) {
  return value ? std::optional(MeasuredFigure{*value, ci95}) : std::nullopt;
}

/// Figures of functions that have them.
Figures of_functions(const TaskCell& cell, const FigureOfFunction& value) {
  Figures figures;
  for (const ParticipantFunction& one : cell.functions) {
    if (!one.counts.empty()) figures.ratios &= one.counts.front().level > 0;
    const auto found = value(one);
    if (!found) continue;
    if (one.determined) figures.add(one.participant, found->value, found->ci95);
    if (!one.determined) ++figures.n_undetermined;
  }
  return figures;
}

/// Thresholds that are neither a PSE nor relative to a standard.
Figures thresholds(const TaskCell& cell) {
  return of_functions(cell, [](const ParticipantFunction& one) -> std::optional<MeasuredFigure> {
    if (!one.fit.undefined.empty() || one.figures.pse || one.figures.jnd) return std::nullopt;
    return MeasuredFigure{one.fit.parameters.threshold, one.fit.threshold_ci95};
  });
}

Figures pses(const TaskCell& cell) {
  return of_functions(cell, [](const ParticipantFunction& one) {
    return measured(one.figures.pse, one.figures.pse_ci95);
  });
}

/// A function with the steepest slope has no JND: it is left out and counted.
Figures figures_of_slopes(const TaskCell& cell, const FigureOfFunction& value) {
  std::size_t too_steep = 0;
  Figures figures = of_functions(cell, [&](const ParticipantFunction& one) {
    auto found = value(one);
    const bool none = one.fit.slope_at_bound && !cell.forced_choice && found;
    too_steep += none ? 1 : 0;
    return none ? std::nullopt : found;
  });
  figures.n_undetermined += too_steep;
  figures.ratios = true;
  return figures;
}

Figures jnds(const TaskCell& cell) {
  return figures_of_slopes(cell, [](const ParticipantFunction& one) {
    return measured(one.figures.jnd, one.figures.jnd_ci95);
  });
}

Figures weber_fractions(const TaskCell& cell) {
  return figures_of_slopes(cell, [](const ParticipantFunction& one) {
    return measured(one.figures.weber_fraction, one.figures.weber_fraction_ci95);
  });
}

Figures exponents(const TaskCell& cell) {
  Figures figures;
  if (!cell.magnitude) return figures;
  for (const StevensLine& line : cell.magnitude->lines) {
    if (line.exponent) figures.add(cell.participants[line.participant], *line.exponent);
  }
  return figures;
}

Figures settings(const TaskCell& cell) {
  Figures figures;
  for (const Adjustment& one : cell.adjustments)
    figures.add(cell.participants[one.participant], one.pse);
  return figures;
}

Figures setting_jnds(const TaskCell& cell) {
  Figures figures;
  for (const Adjustment& one : cell.adjustments) {
    if (one.jnd) figures.add(cell.participants[one.participant], *one.jnd);
  }
  return figures;
}

/// Means of a participant's ratings. A scale has no true zero.
Figures ratings(const TaskCell& cell) {
  Figures figures;
  figures.ratios = false;
  if (!cell.ratings) return figures;
  for (const ParticipantRatings& one : cell.ratings->participants)
    figures.add(cell.participants[one.participant], one.spread.mean);
  return figures;
}

/// A figure of each participant's movements. They may lie on both sides of 0.
Figures of_reaches(const TaskCell& cell,
                   const std::function<std::optional<double>(const Reaches&)>& value) {
  Figures figures;
  figures.ratios = false;
  for (const Reaches& one : cell.reaches) {
    if (const auto found = value(one)) figures.add(cell.participants[one.participant], *found);
  }
  return figures;
}

Figures deviations(const TaskCell& cell) {
  return of_reaches(cell, [](const Reaches& one) { return one.deviation; });
}

Figures aftereffects(const TaskCell& cell) {
  return of_reaches(cell, [](const Reaches& one) { return one.catch_deviation; });
}

Figures adaptations(const TaskCell& cell) {
  return of_reaches(cell, [](const Reaches& one) { return one.adaptation; });
}

/// A participant without a course over the trials has none: it is left out and counted.
Figures learning_trials(const TaskCell& cell) {
  Figures figures = of_reaches(cell, [](const Reaches& one) {
    return one.learning.undefined.empty() ? std::optional(one.learning.trials) : std::nullopt;
  });
  figures.ratios = true;
  if (!figures.of.empty()) figures.n_undetermined = cell.reaches.size() - figures.of.size();
  return figures;
}

/// A parameter of the functions of several dimensions.
Figures of_fields(const TaskCell& cell, const std::string& name) {
  Figures figures;
  figures.ratios = name == "w" || name == "s" || name == "slope" || name == "jnd";
  if (!cell.field || !cell.field->undefined.empty()) return figures;
  figures.ratios &= !(name == "w" && cell.field->function.form == protocols::FieldForm::cues);
  for (const ParticipantField& one : cell.field->participants) {
    const FieldParameter* found = name == "jnd" && one.fit.jnd ? &*one.fit.jnd : nullptr;
    for (const FieldParameter& parameter : one.fit.parameters)
      if (parameter.name == name) found = &parameter;
    if (found == nullptr) continue;
    if (found->closed)
      figures.add(one.participant, found->value);
    else
      ++figures.n_undetermined;
  }
  return figures;
}

std::function<Figures(const TaskCell&)> field_parameter(const char* name) {
  return [name](const TaskCell& cell) { return of_fields(cell, name); };
}

constexpr const char* kRating = "rating";

/// The compared measures. Weber fractions are left out: they are JNDs over the same standard.
std::vector<Measure> measures() {
  return {{"threshold", thresholds},
          {"pse", pses},
          {"jnd", jnds},
          {"exponent", exponents},
          {"pse", settings},
          {"jnd", setting_jnds},
          {kRating, ratings},
          {"deviation", deviations, "m"},
          {"aftereffect", aftereffects, "m"},
          {"adaptation", adaptations, ""},
          {"learning_trials", learning_trials, "trials"},
          {"jnd", field_parameter("jnd")},
          {"w", field_parameter("w")},
          {"c", field_parameter("c")},
          {"a", field_parameter("a")},
          {"b", field_parameter("b")},
          {"s", field_parameter("s")},
          {"slope", field_parameter("slope")}};
}

void add_mean(GroupMean& group, bool geometric) {
  std::vector<double> values;
  for (const NamedFigure& one : group.participants)
    values.push_back(geometric ? std::log(one.value) : one.value);
  if (values.empty()) return;
  const auto back = [&](double value) { return geometric ? std::exp(value) : value; };
  group.mean = back(mean(values));
  group.sd = standard_deviation(values);
  if (const auto ends = t_test(values).log_ratio_ci95)
    group.ci95 = Interval{back(ends->low), back(ends->high)};
}

std::optional<TaskGroup> group_of(const std::vector<const TaskCell*>& cells,
                                  const Measure& measure) {
  TaskGroup result;
  result.measure = measure.name;
  const std::string name = measure.name;
  result.geometric = name != "exponent";
  for (const TaskCell* cell : cells) {
    const Figures figures = measure.of(*cell);
    if (figures.of.empty() && figures.n_undetermined == 0) continue;
    GroupMean& group = result.renderers.emplace_back();
    group.renderer = cell->renderer;
    group.n_undetermined = figures.n_undetermined;
    result.geometric &= figures.ratios;
    for (const NamedFigure& one : figures.of) result.geometric &= one.value > 0;
    group.participants = figures.of;
    if (measure.unit != nullptr)
      result.unit = measure.unit;
    else if (cell->field)
      result.unit = unit_of_parameter(*cell->field, name);
    else if (name != "exponent" && name != "weber_fraction")
      result.unit = cell->level_unit;
  }
  if (result.renderers.empty()) return std::nullopt;
  result.task = cells.front()->task;
  result.block_name = cells.front()->block_name;
  result.shape = cells.front()->shape;
  for (GroupMean& group : result.renderers) add_mean(group, result.geometric);
  return result;
}

std::size_t tests_of(const TaskComparison& one) {
  return static_cast<std::size_t>(std::ranges::count_if(
      one.comparison.differences,
      [](const ConditionDifference& difference) { return difference.t_test.p.has_value(); }));
}

/// None: fewer than two cells have figures.
std::optional<TaskComparison> compared(const std::vector<const TaskCell*>& cells,
                                       const Measure& measure,
                                       const std::function<std::string(const TaskCell&)>& name) {
  TaskComparison result;
  result.measure = measure.name;
  result.logarithms = true;
  std::vector<ParticipantFigure> all;
  std::map<std::string, std::size_t> numbers;
  for (const TaskCell* cell : cells) {
    const Figures figures = measure.of(*cell);
    if (figures.of.empty() && figures.n_undetermined == 0) continue;
    result.task = cell->task;
    result.logarithms &= figures.ratios;
    result.n_undetermined += figures.n_undetermined;
    for (const auto& [participant, value, ci95] : figures.of) {
      const auto number = numbers.emplace(participant, numbers.size()).first->second;
      all.push_back({number, result.conditions.size(), value});
      result.logarithms &= value > 0;
    }
    result.conditions.push_back(name(*cell));
  }
  if (result.conditions.size() < 2) return std::nullopt;
  if (result.logarithms) {
    for (ParticipantFigure& figure : all) figure.value = std::log(figure.value);
  }
  result.comparison = compare_thresholds(all, result.conditions.size());
  result.n_tests = tests_of(result);
  return result;
}

/// Groups in order of their first cell.
template <class Key>
std::vector<std::vector<const TaskCell*>> groups_of(
    const std::vector<TaskCell>& cells, const std::function<Key(const TaskCell&)>& key_of) {
  std::vector<std::vector<const TaskCell*>> groups;
  std::map<Key, std::size_t> places;
  for (const TaskCell& cell : cells) {
    const auto [place, is_new] = places.emplace(key_of(cell), groups.size());
    if (is_new) groups.emplace_back();
    groups[place->second].push_back(&cell);
  }
  return groups;
}

/// The cells of a stimulus in a block, by renderer.
std::vector<std::vector<const TaskCell*>> groups_by_renderer(const std::vector<TaskCell>& cells) {
  using Key = std::tuple<std::string, std::string, std::string>;
  auto groups = groups_of<Key>(cells, [](const TaskCell& c) {
    return Key{c.task, c.block_name, c.shape};
  });
  const auto rank = [](const TaskCell* cell) {
    return cell->renderer == "point" ? 0 : cell->renderer == "ray" ? 1 : 2;
  };
  for (auto& group : groups) std::ranges::stable_sort(group, {}, rank);
  return groups;
}

/// Ratings of many stimuli are many tests: adjusts p over all of a block (and of a renderer, if
/// stimuli are compared).
void adjust_ratings(std::vector<TaskComparison>& comparisons) {
  using Family = std::tuple<std::string, std::string, std::string>;
  std::map<Family, std::vector<TaskComparison*>> families;
  for (TaskComparison& one : comparisons) {
    if (one.measure == kRating) families[{one.task, one.block_name, one.renderer}].push_back(&one);
  }
  for (const auto& [name, family] : families) {
    std::vector<TTest*> tests;
    std::vector<std::optional<double>> p;
    for (TaskComparison* one : family) {
      for (ConditionDifference& difference : one->comparison.differences) {
        tests.push_back(&difference.t_test);
        p.push_back(difference.t_test.p);
      }
    }
    const auto adjusted = holm(p);
    const auto n = static_cast<std::size_t>(
        std::ranges::count_if(p, [](const auto& one) { return one.has_value(); }));
    for (std::size_t i = 0; i < tests.size(); ++i) tests[i]->p_holm = adjusted[i];
    for (TaskComparison* one : family) one->n_tests = n;
  }
}

/// The stimuli of a block with a renderer, each with the later ones.
void compare_rated_stimuli(const std::vector<const TaskCell*>& cells,
                           std::vector<TaskComparison>& results) {
  const std::size_t references = cells.size() > kMostPaired ? 1 : cells.size();
  for (std::size_t i = 0; i < references; ++i) {
    const std::vector<const TaskCell*> from(cells.begin() + static_cast<std::ptrdiff_t>(i),
                                            cells.end());
    auto one = compared(from, {kRating, ratings}, [](const TaskCell& cell) { return cell.shape; });
    if (!one) continue;
    one->block_name = cells.front()->block_name;
    one->renderer = cells.front()->renderer;
    results.push_back(std::move(*one));
  }
}

/// Cells of crossed factors are compared by their effects (study_design.h).
bool is_in_cell(const TaskCell& cell) { return !cell_name(cell.shape).levels.empty(); }

}  // namespace

ThresholdComparison compare_thresholds(const std::vector<ParticipantFigure>& figures,
                                       std::size_t conditions) {
  ThresholdComparison result;
  if (conditions < 2) {
    result.undefined = "fewer than two conditions";
    return result;
  }
  ValuesByParticipant values;
  for (const ParticipantFigure& figure : figures)
    values[figure.participant][figure.condition] = figure.value;
  std::vector<std::optional<double>> p;
  for (std::size_t condition = 1; condition < conditions; ++condition) {
    std::vector<double> differences;
    for (const auto& [participant, own] : values) {
      if (own.count(0) > 0 && own.count(condition) > 0)
        differences.push_back(own.at(condition) - own.at(0));
    }
    ConditionDifference difference;
    difference.condition = condition;
    difference.n_pairs = differences.size();
    if (!differences.empty()) difference.mean = mean(differences);
    difference.t_test = t_test(differences);
    difference.effect_size = effect_size(differences);
    difference.wilcoxon = wilcoxon(differences);
    p.push_back(difference.t_test.p);
    result.differences.push_back(std::move(difference));
  }
  const auto adjusted = holm(p);
  for (std::size_t i = 0; i < adjusted.size(); ++i)
    result.differences[i].t_test.p_holm = adjusted[i];
  add_mixed_model(result, values, conditions);
  return result;
}

bool is_field_parameter(const std::string& measure) {
  return measure == "w" || measure == "c" || measure == "a" || measure == "b" || measure == "s" ||
         measure == "slope";
}

std::string measure_plural(const std::string& measure) {
  if (measure == "threshold") return "Thresholds";
  if (measure == "jnd") return "JNDs";
  if (measure == "weber_fraction") return "Weber fractions";
  if (measure == "rating") return "Mean ratings";
  if (measure == "d_prime") return "d'";
  if (measure == "criterion") return "Criteria";
  if (measure == "deviation") return "Deviations";
  if (measure == "aftereffect") return "Aftereffects";
  if (measure == "adaptation") return "Adaptations";
  if (measure == "learning_trials") return "Learning times";
  if (measure == "pse") return "PSEs";
  return measure == "exponent" ? "Exponents" : measure + " values";
}

std::vector<TaskGroup> group_results(const std::vector<TaskCell>& cells) {
  std::vector<Measure> all = measures();
  all.push_back({"weber_fraction", weber_fractions});
  std::vector<TaskGroup> results;
  for (const auto& group : groups_by_renderer(cells)) {
    for (const Measure& measure : all) {
      if (auto one = group_of(group, measure)) results.push_back(std::move(*one));
    }
  }
  return results;
}

std::vector<TaskComparison> compare_renderers(const std::vector<TaskCell>& cells) {
  std::vector<TaskComparison> results;
  for (const auto& group : groups_by_renderer(cells)) {
    for (const Measure& measure : measures()) {
      auto one = compared(group, measure, [](const TaskCell& cell) { return cell.renderer; });
      if (!one) continue;
      one->block_name = group.front()->block_name;
      one->shape = group.front()->shape;
      results.push_back(std::move(*one));
    }
  }
  adjust_ratings(results);
  return results;
}

std::vector<TaskComparison> compare_conditions(const std::vector<TaskCell>& cells) {
  using Key = std::tuple<std::string, std::string, std::optional<double>, bool>;
  std::vector<TaskComparison> results;
  for (const auto& group : groups_of<Key>(cells, [](const TaskCell& c) {
         return Key{c.task, c.renderer, c.standard_level, is_in_cell(c)};
       })) {
    if (is_in_cell(*group.front())) continue;
    for (const Measure& measure : measures()) {
      if (std::string(measure.name) == kRating) continue;  // another block has another question
      auto one = compared(group, measure, [](const TaskCell& cell) {
        return cell.block_name + (cell.shape.empty() ? "" : ", " + cell.shape);
      });
      if (!one) continue;
      one->renderer = group.front()->renderer;
      results.push_back(std::move(*one));
    }
  }
  using Block = std::tuple<std::string, std::string, std::string>;
  for (const auto& group : groups_of<Block>(cells, [](const TaskCell& c) {
         return Block{c.task, c.renderer, c.block_name};
       })) {
    if (!is_in_cell(*group.front())) compare_rated_stimuli(group, results);
  }
  adjust_ratings(results);
  return results;
}

}  // namespace palpate::analysis
