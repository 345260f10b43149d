#include "analysis/statistics/study_design.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <optional>
#include <string>

#include "analysis/statistics/crossed_stimuli.h"
#include "analysis/statistics/normal_tail.h"
#include "analysis/statistics/task_analysis.h"
#include "analysis/statistics/weighted_model.h"
#include "data/base/cell_name.h"

namespace palpate::analysis {
namespace {

using CellValue = std::optional<double> (*)(const ParticipantCell& cell);

std::optional<double> log_time(const ParticipantCell& cell) {
  return cell.n_used > 0 ? std::optional(cell.mean_log) : std::nullopt;
}

std::optional<double> share_correct(const ParticipantCell& cell) {
  if (cell.n_trials == 0) return std::nullopt;
  return static_cast<double>(cell.n_correct) / static_cast<double>(cell.n_trials);
}

/// Adjusts the p of the effects that the study is about. \param tests  empty: all
void adjust_effects(const std::vector<std::string>& tests, std::vector<GroupEffect>& effects) {
  std::vector<std::optional<double>> p;
  p.reserve(effects.size());
  for (const GroupEffect& effect : effects)
    p.push_back(is_tested(tests, effect.name) ? effect.p_value() : std::nullopt);
  const auto adjusted = holm(p);
  for (std::size_t i = 0; i < effects.size(); ++i) effects[i].p_holm = adjusted[i];
}

void compare_measure(const std::vector<std::string>& tests, GroupedMeasure& measure) {
  measure.result =
      compare_groups(measure.figures, std::max<std::size_t>(1, measure.groups.size()),
                     factor_sizes(measure.within),
                     measure.crossed ? WithinContrasts::added : WithinContrasts::left_out);
  adjust_effects(tests, measure.result.anova.effects);
}

/// The cells of a study of shapes: renderers, then what the shapes cross.
struct ShapeCells {
  std::vector<StudyFactor> within;  ///< renderer, factors, shape
  bool crossed = false;             ///< there are factors
  /// Index of each cell's shape, the plain shapes innermost; the same with every renderer.
  std::vector<std::size_t> shapes;
};

ShapeCells cells_of_shapes(const Analysis& analysis, const StudyTable& table) {
  ShapeCells out{{{"renderer", analysis.table.renderers}}, false, {}};
  if (const auto crossed = crossed_stimuli(analysis.table.shapes, table.factors)) {
    out.crossed = true;
    out.within.insert(out.within.end(), crossed->factors.begin(), crossed->factors.end());
    out.within.push_back({"shape", crossed->plain});
    out.shapes = crossed->cells;
  } else {
    out.within.push_back({"shape", analysis.table.shapes});
    for (std::size_t i = 0; i < analysis.table.shapes.size(); ++i) out.shapes.push_back(i);
  }
  return out;
}

/// A measure of identification, by renderer, factors and shape.
GroupedMeasure identification_by_design(const Analysis& analysis, const StudyTable& table,
                                        CellValue value) {
  GroupedMeasure out;
  out.groups = table.group_labels.names;
  ShapeCells cells = cells_of_shapes(analysis, table);
  out.crossed = cells.crossed;
  for (std::size_t p = 0; p < analysis.table.participants.size(); ++p) {
    const std::string& name = analysis.table.participants[p];
    const auto group = known_group(table.group_labels, name);
    if (!group) continue;
    GroupedFigures one{name, *group, {}};
    for (const auto& renderer : analysis.description.participant_cells) {
      for (const std::size_t shape : cells.shapes) one.values.push_back(value(renderer[shape][p]));
    }
    out.figures.push_back(std::move(one));
  }
  out.within = std::move(cells.within);
  compare_measure(table.tests, out);
  return out;
}

DesignModel model_of_times(const Analysis& analysis, const StudyTable& table) {
  ShapeCells cells = cells_of_shapes(analysis, table);
  DesignedTimes times;
  times.shapes = cells.within.back().levels.size();
  cells.within.pop_back();
  times.conditions = factor_sizes(cells.within);
  times.groups = std::max<std::size_t>(1, table.group_labels.names.size());
  for (const auto& renderer : analysis.description.participant_cells) {
    for (std::size_t i = 0; i < cells.shapes.size(); ++i) {
      if (i % times.shapes == 0) times.cells.emplace_back();
      times.cells.back().push_back(renderer[cells.shapes[i]]);
    }
  }
  for (const std::string& name : analysis.table.participants)
    times.group_of.push_back(known_group(table.group_labels, name).value_or(times.groups));
  DesignModel out =
      design_model(times, cells.crossed ? WithinContrasts::added : WithinContrasts::left_out);
  adjust_effects(table.tests, out.effects);
  return out;
}

/// The results of a task's measure in every cell of a block, for a plain stimulus: one result where
/// there are no factors.
struct MeasureOfTask {
  std::vector<const TaskGroup*> cells;
};

/// From the interval of a figure; none: it is open.
std::optional<double> error_of(const NamedFigure& figure, bool logarithms) {
  if (!figure.ci95) return std::nullopt;
  const double low = logarithms ? std::log(figure.ci95->low) : figure.ci95->low;
  const double high = logarithms ? std::log(figure.ci95->high) : figure.ci95->high;
  const double error = (high - low) / (2 * kNormal975);
  return std::isfinite(error) && error > 0 ? std::optional(error) : std::nullopt;
}

/// The weighted model of figures, if they have intervals. \param figures  all of the measure
void put_weighted_model(const std::vector<WeightedFigure>& figures, std::size_t without_error,
                        const std::vector<std::string>& tests, GroupedMeasure& out) {
  if (figures.empty()) return;
  out.model =
      weighted_model(figures, std::max<std::size_t>(1, out.groups.size()), factor_sizes(out.within),
                     out.crossed ? WithinContrasts::added : WithinContrasts::left_out);
  out.model->n_without_error = without_error;
  adjust_effects(tests, out.model->effects);
}

/// A measure of a task, by renderer and factors.
GroupedMeasure task_by_design(const MeasureOfTask& task, const StudyTable& table) {
  const TaskGroup& first = *task.cells.front();
  GroupedMeasure out;
  out.measure = first.measure;
  out.task = first.task;
  out.block_name = first.block_name;
  out.shape = base_name(first.shape);
  out.unit = first.unit;
  out.logarithms = std::ranges::all_of(task.cells, &TaskGroup::geometric);
  out.groups = table.group_labels.names;
  std::vector<std::string> names, renderers;
  for (const TaskGroup* const cell : task.cells) {
    names.push_back(cell->shape);
    for (const GroupMean& one : cell->renderers) {
      if (std::ranges::find(renderers, one.renderer) == renderers.end())
        renderers.push_back(one.renderer);
    }
  }
  out.within = {{"renderer", renderers}};
  std::vector<std::size_t> order{0};
  if (names.size() > 1) {
    const auto crossed = crossed_stimuli(names, table.factors);
    out.crossed = true;
    if (!crossed) {
      out.result.anova.undefined = "its " + std::to_string(names.size()) +
                                   " cells do not cross the levels of its factors completely";
      return out;
    }
    out.within.insert(out.within.end(), crossed->factors.begin(), crossed->factors.end());
    order = crossed->cells;
  }
  std::map<std::string, std::size_t> row_of;
  std::vector<WeightedFigure> weighted;
  std::size_t without_error = 0;
  for (std::size_t r = 0; r < renderers.size(); ++r) {
    for (std::size_t c = 0; c < order.size(); ++c) {
      const TaskGroup& cell = *task.cells[order[c]];
      const auto found = std::ranges::find(cell.renderers, renderers[r], &GroupMean::renderer);
      if (found == cell.renderers.end()) continue;
      without_error += found->n_undetermined;
      for (const NamedFigure& one : found->participants) {
        const auto group = known_group(table.group_labels, one.participant);
        if (!group) continue;
        const auto [row, is_new] = row_of.emplace(one.participant, out.figures.size());
        if (is_new)
          out.figures.push_back(
              {one.participant, *group,
               std::vector<std::optional<double>>(renderers.size() * order.size())});
        out.figures[row->second].values[r * order.size() + c] =
            out.logarithms ? std::log(one.value) : one.value;
        if (const auto error = error_of(one, out.logarithms))
          weighted.push_back({row->second, *group, r * order.size() + c,
                              out.logarithms ? std::log(one.value) : one.value, *error});
        else
          ++without_error;
      }
    }
  }
  compare_measure(table.tests, out);
  put_weighted_model(weighted, without_error, table.tests, out);
  return out;
}

/// The measures of tasks, the cells of a stimulus in a block together.
std::vector<MeasureOfTask> measures_of_tasks(const std::vector<TaskGroup>& groups) {
  std::vector<MeasureOfTask> out;
  for (const TaskGroup& group : groups) {
    // Weber fractions would repeat the tests of the JNDs that they come from.
    if (group.measure == "weber_fraction") continue;
    const auto is_of = [&](const MeasureOfTask& one) {
      const TaskGroup& known = *one.cells.front();
      return known.measure == group.measure && known.task == group.task &&
             known.block_name == group.block_name && !cell_name(group.shape).levels.empty() &&
             base_name(known.shape) == base_name(group.shape);
    };
    const auto known = std::ranges::find_if(out, is_of);
    if (known != out.end())
      known->cells.push_back(&group);
    else
      out.push_back({{&group}});
  }
  return out;
}

}  // namespace

std::vector<WithinFactor> factor_sizes(const std::vector<StudyFactor>& within) {
  std::vector<WithinFactor> out;
  out.reserve(within.size());
  for (const StudyFactor& factor : within) out.push_back({factor.name, factor.levels.size()});
  return out;
}

std::optional<std::size_t> known_group(const GroupLabels& labels, const std::string& participant) {
  if (labels.names.empty()) return 0;
  const auto known = labels.of.find(participant);
  return known == labels.of.end() ? std::nullopt : std::optional(known->second);
}

bool is_tested(const std::vector<std::string>& tests, const std::string& effect) {
  return tests.empty() || std::ranges::find(tests, effect) != tests.end();
}

std::vector<GroupedMeasure> measures_by_design(const StudyAnalysis& analysis) {
  std::vector<GroupedMeasure> out;
  const StudyTable& table = analysis.table;
  if (table.group_labels.names.empty() && table.factors.empty()) return out;
  if (analysis.identification) {
    GroupedMeasure time = identification_by_design(*analysis.identification, table, log_time);
    time.measure = "time";
    time.unit = "s";
    time.logarithms = true;
    time.model = model_of_times(*analysis.identification, table);
    GroupedMeasure accuracy =
        identification_by_design(*analysis.identification, table, share_correct);
    accuracy.measure = "accuracy";
    out.push_back(std::move(time));
    out.push_back(std::move(accuracy));
  }
  for (const MeasureOfTask& task : measures_of_tasks(analysis.groups)) {
    out.push_back(task_by_design(task, table));
  }
  if (table.group_labels.names.empty())
    std::erase_if(out, [](const GroupedMeasure& one) { return !one.crossed; });
  return out;
}

}  // namespace palpate::analysis
