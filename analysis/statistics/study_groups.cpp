#include "analysis/statistics/study_groups.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <map>
#include <optional>

#include "analysis/statistics/task_analysis.h"

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

/// A measure of identification, by renderer and shape.
GroupedMeasure identification_by_group(const Analysis& analysis, const GroupLabels& labels,
                                       CellValue value) {
  GroupedMeasure out;
  out.groups = labels.names;
  out.renderers = analysis.table.renderers;
  const ParticipantCells& cells = analysis.description.participant_cells;
  std::vector<GroupedFigures>& figures = out.figures;
  for (std::size_t p = 0; p < analysis.table.participants.size(); ++p) {
    const std::string& name = analysis.table.participants[p];
    const auto group = labels.of.find(name);
    if (group == labels.of.end()) continue;
    GroupedFigures one{name, group->second, {}};
    for (const auto& renderer : cells) {
      for (const auto& shape : renderer) one.values.push_back(value(shape[p]));
    }
    figures.push_back(std::move(one));
  }
  out.result =
      compare_groups(figures, labels.names.size(),
                     {{"renderer", out.renderers.size()}, {"shape", analysis.table.shapes.size()}});
  return out;
}

GroupedMixedModel model_of_times(const Analysis& analysis, const GroupLabels& labels) {
  std::vector<std::size_t> group_of;
  for (const std::string& name : analysis.table.participants) {
    const auto group = labels.of.find(name);
    group_of.push_back(group == labels.of.end() ? labels.names.size() : group->second);
  }
  return grouped_mixed_model(analysis.description.participant_cells, analysis.table.renderers,
                             group_of, labels.names.size());
}

/// A measure of a task, by renderer.
GroupedMeasure task_by_group(const TaskGroup& group, const GroupLabels& labels) {
  GroupedMeasure out;
  out.measure = group.measure;
  out.task = group.task;
  out.block_name = group.block_name;
  out.shape = group.shape;
  out.unit = group.unit;
  out.logarithms = group.geometric;
  out.groups = labels.names;
  std::vector<GroupedFigures>& figures = out.figures;
  std::map<std::string, std::size_t> row_of;
  for (std::size_t r = 0; r < group.renderers.size(); ++r) {
    out.renderers.push_back(group.renderers[r].renderer);
    for (const NamedFigure& one : group.renderers[r].participants) {
      const auto known = labels.of.find(one.participant);
      if (known == labels.of.end()) continue;
      const auto [row, is_new] = row_of.emplace(one.participant, figures.size());
      if (is_new) {
        figures.push_back({one.participant, known->second,
                           std::vector<std::optional<double>>(group.renderers.size())});
      }
      figures[row->second].values[r] = out.logarithms ? std::log(one.value) : one.value;
    }
  }
  out.result = compare_groups(figures, labels.names.size(), {{"renderer", out.renderers.size()}});
  return out;
}

}  // namespace

std::vector<GroupedMeasure> between_groups(const StudyAnalysis& analysis) {
  std::vector<GroupedMeasure> out;
  const GroupLabels& labels = analysis.table.group_labels;
  if (labels.names.empty()) return out;
  if (analysis.identification) {
    GroupedMeasure& time =
        out.emplace_back(identification_by_group(*analysis.identification, labels, log_time));
    time.measure = "time";
    time.unit = "s";
    time.logarithms = true;
    time.model = model_of_times(*analysis.identification, labels);
    GroupedMeasure& accuracy =
        out.emplace_back(identification_by_group(*analysis.identification, labels, share_correct));
    accuracy.measure = "accuracy";
  }
  for (const TaskGroup& group : analysis.groups) {
    // Weber fractions would repeat the tests of the JNDs that they come from.
    if (group.measure != "weber_fraction") out.push_back(task_by_group(group, labels));
  }
  return out;
}

}  // namespace palpate::analysis
