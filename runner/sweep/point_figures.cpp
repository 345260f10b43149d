#include "runner/sweep/point_figures.h"

#include <algorithm>
#include <map>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>

#include "analysis/statistics/describe.h"
#include "analysis/statistics/paired.h"
#include "analysis/statistics/task_analysis.h"
#include "data/base/cell_name.h"
#include "protocols/session_plan.h"
#include "runner/session/simulated_study.h"

namespace palpate::runner::sweep {
namespace {

constexpr double kTooFast = 0.2;  // s; default of `analyze` for excluding trials

std::size_t index_of(const std::vector<std::string>& names, const std::string& name) {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end())
    throw std::runtime_error("a trial of '" + name + "', which is not in the protocol");
  return static_cast<std::size_t>(found - names.begin());
}

/// Those of the study of shapes.
class ShapeFigures final : public PointFigures {
 public:
  explicit ShapeFigures(const data::SweepPlan& plan)
      : cells_(plan.renderers.size() * plan.shapes.size()) {
    table_.renderers = plan.renderers;
    table_.shapes = table_.answers = plan.shapes;
    for (int i = 1; i <= plan.participants; ++i)
      table_.participants.push_back(session::simulated_code(i));
  }

  void add(int participant, const data::TrialRecord& record, std::uint64_t contact_ticks) override {
    if (record.practice) return;
    analysis::TrialRow row;
    row.participant = static_cast<std::uint32_t>(participant - 1);
    row.renderer = static_cast<std::uint16_t>(index_of(table_.renderers, record.renderer));
    row.shape = static_cast<std::uint16_t>(index_of(table_.shapes, record.shape));
    if (!record.response.empty())
      row.answer = static_cast<std::int32_t>(index_of(table_.answers, record.response));
    row.correct = record.correct;
    row.timed_out = record.timed_out;
    row.response_time = record.response_time;
    table_.rows.push_back(row);
    Cell& cell = cells_[row.renderer * table_.shapes.size() + row.shape];
    cell.ticks += record.ticks;
    cell.contact_ticks += contact_ticks;
  }

  std::vector<std::optional<double>> figures() const override {
    const analysis::Description description = analysis::describe(table_, kTooFast);
    std::vector<std::optional<double>> out = gains(description);
    const auto each_cell = [&](const auto& figure) {
      for (std::size_t r = 0; r < table_.renderers.size(); ++r) {
        for (std::size_t s = 0; s < table_.shapes.size(); ++s) out.push_back(figure(r, s));
      }
    };
    using Figure = std::optional<double>;
    each_cell([&](auto r, auto s) { return description.times[r][s].mean_of_participant_means; });
    each_cell([&](auto r, auto s) { return description.accuracy[r][s].accuracy; });
    each_cell([&](auto r, auto s) -> Figure {
      const analysis::AccuracyCell& cell = description.accuracy[r][s];
      if (cell.n_trials == 0) return std::nullopt;
      return static_cast<double>(cell.n_timeouts) / static_cast<double>(cell.n_trials);
    });
    each_cell([&](auto r, auto s) -> Figure {
      const Cell& cell = cells_[r * table_.shapes.size() + s];
      if (cell.ticks == 0) return std::nullopt;
      return static_cast<double>(cell.contact_ticks) / static_cast<double>(cell.ticks);
    });
    return out;
  }

 private:
  struct Cell {
    std::uint64_t ticks = 0, contact_ticks = 0;
  };

  std::vector<std::optional<double>> gains(const analysis::Description& description) const {
    std::vector<std::optional<double>> gains(table_.shapes.size()), errors(table_.shapes.size());
    if (table_.renderers.size() == 2) {
      const analysis::RendererPair pair = analysis::renderer_pairs(table_.renderers).front();
      const auto shapes = analysis::compare_by_shape(table_, description, pair);
      for (std::size_t s = 0; s < shapes.size(); ++s) {
        gains[s] = shapes[s].percent_reduction_geometric;
        // To first order: the slope of 100 (1 - exp m) is 100 exp m.
        if (gains[s] && shapes[s].t_test.se) errors[s] = (100 - *gains[s]) * *shapes[s].t_test.se;
      }
    }
    gains.insert(gains.end(), errors.begin(), errors.end());
    return gains;
  }

  analysis::TrialTable table_;
  std::vector<Cell> cells_;
};

std::optional<double> mean_of(const std::vector<double>& values) {
  if (values.empty()) return std::nullopt;
  return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
}

/// A figure for each participant in a cell of a task.
std::vector<double> figures_of_participants(const analysis::TaskCell& cell,
                                            const std::string& measure) {
  std::vector<double> values;
  const auto add = [&](const std::optional<double>& value) {
    if (value) values.push_back(*value);
  };
  for (const analysis::ParticipantFunction& one : cell.functions) {
    if (measure == "d_prime") add(one.detectability.d_prime);
    if (!one.fit.undefined.empty() || !one.determined) continue;
    if (measure == "threshold") add(one.fit.parameters.threshold);
    if (measure == "jnd") add(one.figures.jnd);
  }
  if (cell.magnitude && measure == "exponent") {
    for (const analysis::StevensLine& line : cell.magnitude->lines) add(line.exponent);
  }
  for (const analysis::Adjustment& one : cell.adjustments) {
    if (measure == "pse") add(one.pse);
    if (measure == "jnd") add(one.jnd);
  }
  for (const analysis::Reaches& one : cell.reaches) {
    if (measure == "deviation") add(one.deviation);
    if (measure == "adaptation") add(one.adaptation);
  }
  for (const analysis::InformationTransfer& one : cell.informations) {
    if (measure == "bits") add(one.corrected);
  }
  return values;
}

/// Shares correct, or means of the times of correct answers, of each participant with a stimulus.
std::vector<double> identified(const analysis::StudyTable& table, const data::TaskCellColumns& cell,
                               bool times) {
  struct Sum {
    double sum = 0;
    int n = 0;
  };
  std::map<std::string, Sum> sums;
  for (const analysis::StudyTrial& trial : table.trials) {
    if (trial.block_name != cell.block || trial.shape != cell.stimulus ||
        trial.renderer != cell.renderer)
      continue;
    if (times && !(trial.correct && *trial.response_time >= kTooFast)) continue;
    Sum& own = sums[trial.participant];
    own.sum += times ? *trial.response_time : trial.correct ? 1 : 0;
    ++own.n;
  }
  std::vector<double> values;
  values.reserve(sums.size());
  for (const auto& [participant, own] : sums) values.push_back(own.sum / own.n);
  return values;
}

/// The trials of a group, or of all: "". Those of a track that cells share are of its plain
/// stimulus.
analysis::StudyTable trials_of_group(const analysis::StudyTable& all, const std::string& group,
                                     const std::vector<data::TaskCellColumns>& columns) {
  analysis::StudyTable out;
  for (const analysis::StudyTrial& trial : all.trials) {
    if (!group.empty() && trial.group != group) continue;
    out.trials.push_back(trial);
    const bool of_cell = std::ranges::any_of(columns, [&](const data::TaskCellColumns& one) {
      return one.block == trial.block_name && one.stimulus == trial.shape;
    });
    if (!of_cell) out.trials.back().shape = base_name(trial.shape);
  }
  return out;
}

std::vector<std::optional<double>> task_figures_of(const data::SweepPlan& plan,
                                                   const analysis::StudyTable& table) {
  analysis::FunctionSettings without_p;
  without_p.simulations = 0;
  const std::vector<data::TaskCellColumns> columns = data::task_columns(plan);
  std::vector<std::optional<double>> out;
  std::optional<analysis::StudyAnalysis> found;
  const std::string* group = nullptr;  // that was analysed last: groups follow each other
  for (const data::TaskCellColumns& wanted : columns) {
    if (group == nullptr || *group != wanted.group)
      found = analysis::analyze_study(trials_of_group(table, wanted.group, columns), without_p);
    group = &wanted.group;
    const auto cell = std::ranges::find_if(found->cells, [&](const analysis::TaskCell& one) {
      return one.block_name == wanted.block && one.renderer == wanted.renderer &&
             one.shape == (wanted.task == "identify" ? "" : wanted.stimulus);
    });
    for (const std::string& measure : wanted.measures) {
      std::vector<double> values;
      if (measure == "accuracy" || measure == "time") {
        values = identified(found->table, wanted, measure == "time");
      } else if (cell != found->cells.end()) {
        values = figures_of_participants(*cell, measure);
      }
      out.push_back(mean_of(values));
      out.push_back(analysis::t_test(values).se);
    }
  }
  return out;
}

/// Those of blocks of tasks.
class TaskFigures final : public PointFigures {
 public:
  TaskFigures(const data::SweepPlan& plan, GroupAssignment groups)
      : plan_(plan), groups_(std::move(groups)) {}

  void add(int participant, const data::TrialRecord& record,
           std::uint64_t /*contact_ticks*/) override {
    if (record.practice) return;
    trials_.trials.push_back(
        analysis::study_trial_of(session::simulated_code(participant), record));
    trials_.trials.back().group = groups_.name(participant);
  }
  std::vector<std::optional<double>> figures() const override {
    return task_figures_of(plan_, trials_);
  }

 private:
  const data::SweepPlan& plan_;
  GroupAssignment groups_;
  analysis::StudyTable trials_;
};

class SweptShapes final : public SweptKind {
 public:
  void name_columns(const protocols::Protocol& protocol, data::SweepPlan& plan) const override {
    for (const protocols::StimulusSpec& stimulus : protocol.stimuli)
      plan.shapes.push_back(stimulus.name);
    // The order of the analysis: gains compare the ray with the point, whichever is listed first.
    for (const protocols::RendererKind kind :
         {protocols::RendererKind::point, protocols::RendererKind::ray}) {
      if (std::count(protocol.renderers.begin(), protocol.renderers.end(), kind) > 0)
        plan.renderers.emplace_back(to_string(kind));
    }
  }
  std::unique_ptr<PointFigures> figures(const protocols::Protocol&,
                                        const data::SweepPlan& plan) const override {
    return std::make_unique<ShapeFigures>(plan);
  }
};

class SweptTasks final : public SweptKind {
 public:
  void name_columns(const protocols::Protocol&, data::SweepPlan&) const override {}  // of blocks
  std::unique_ptr<PointFigures> figures(const protocols::Protocol& protocol,
                                        const data::SweepPlan& plan) const override {
    return std::make_unique<TaskFigures>(plan, protocol.groups.unmasked());
  }
};

}  // namespace

const SweptKind& swept_kind(const protocols::Protocol& protocol) {
  static const SweptShapes shapes;
  static const SweptTasks tasks;
  if (protocols::is_study_of_shapes(protocol)) return shapes;
  return tasks;
}

}  // namespace palpate::runner::sweep
