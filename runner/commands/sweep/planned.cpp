#include "runner/commands/sweep/planned.h"

#include <algorithm>
#include <exception>
#include <iostream>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "analysis/statistics/describe.h"
#include "analysis/statistics/paired.h"
#include "analysis/statistics/task_analysis.h"
#include "data/base/cell_name.h"
#include "data/base/checksum.h"
#include "data/base/json_text.h"
#include "data/base/text.h"
#include "protocols/schedule.h"
#include "protocols/session_plan.h"
#include "runner/commands/shared/study_options.h"
#include "runner/session/run_record.h"
#include "runner/session/simulated_study.h"
#include "runner/study/simulation_limits.h"

namespace palpate::runner::commands {
namespace {

namespace po = boost::program_options;
using nlohmann::json;

/// The protocol with --repetitions, and at most as many blocks.
json base_protocol(const protocols::Protocol& protocol, const SweepSettings& settings) {
  json out = read_json(protocol.source_text);
  if (settings.repetitions == 0) return out;
  if (!out.contains("repetitions"))
    throw UsageError("--repetitions: the blocks of a protocol of version 2 have their own");
  out["repetitions"] = settings.repetitions;
  if (protocol.blocks_per_renderer > settings.repetitions) {
    out["blocks_per_renderer"] = settings.repetitions;
    std::cerr << "blocks_per_renderer: " << settings.repetitions << " instead of "
              << protocol.blocks_per_renderer << ": no more blocks than repetitions\n";
  }
  return out;
}

std::string sha256_of_files(const protocols::Protocol& protocol) {
  std::string all;
  for (const data::ProtocolFile& file : session::info_of(protocol).files)
    all += file.name + '\n' + checksum_hex(file.bytes) + '\n';
  return all.empty() ? "" : checksum_hex(all);
}

/// \throws UsageError
void check_names_of_columns(const data::SweepPlan& plan, const std::string& space) {
  if (const auto alike = data::columns_alike(plan)) {
    throw UsageError(space + ": the parameter '" + alike->first +
                     "' has the name of another column or of a shape, '" + alike->second +
                     "'; give it another one");
  }
}

data::SweepPlan plan_of_sweep(const SweepSettings& settings, const sweep::SweptStudy& study,
                              const sweep::Design& design, const protocols::Protocol& protocol) {
  data::SweepPlan plan;
  plan.protocol = study.protocol().dump();
  plan.files_sha256 = sha256_of_files(protocol);
  plan.settings = study.settings().dump();
  plan.space = read_json(study.space().source_text).dump();
  plan.design = settings.design;
  plan.points = design.size();
  plan.seed = settings.seed;
  plan.participants = settings.participants;
  plan.program_version = PALPATE_VERSION;
  for (const protocols::SweepParameter& one : study.space().parameters)
    plan.parameters.push_back(one.name);
  if (protocol.version == 2) {  // columns belong to its blocks
    check_names_of_columns(plan, settings.space);
    return plan;
  }
  for (const protocols::StimulusSpec& stimulus : protocol.stimuli)
    plan.shapes.push_back(stimulus.name);
  // The order of the analysis: gains compare the ray with the point, whichever is listed first.
  for (const protocols::RendererKind kind :
       {protocols::RendererKind::point, protocols::RendererKind::ray}) {
    if (std::count(protocol.renderers.begin(), protocol.renderers.end(), kind) > 0)
      plan.renderers.emplace_back(to_string(kind));
  }
  check_names_of_columns(plan, settings.space);
  return plan;
}

sweep::Design design_of(const SweepSettings& settings, const sweep::SweptStudy& study) {
  try {
    return {sweep::design_kind(settings.design), settings.points, settings.seed,
            study.space().parameters};
  } catch (const std::invalid_argument& error) {
    throw UsageError(std::string("--design, --points: ") + error.what());
  }
}

constexpr double kTooFast = 0.2;         // s; default of `analyze` for excluding trials
constexpr std::size_t kMaxReason = 300;  // bytes, in the row of a point

std::size_t index_of(const std::vector<std::string>& names, const std::string& name) {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end())
    throw std::runtime_error("a trial of '" + name + "', which is not in the protocol");
  return static_cast<std::size_t>(found - names.begin());
}

/// The figures of a point, from its trials.
class PointFigures {
 public:
  virtual ~PointFigures() = default;
  virtual void add(int participant, const data::TrialRecord& record,
                   std::uint64_t contact_ticks) = 0;
  /// In the order of figure_columns().
  virtual std::vector<std::optional<double>> figures() const = 0;
};

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

/// \param plan  must outlive it
std::unique_ptr<PointFigures> figures_for(const protocols::Protocol& protocol,
                                          const data::SweepPlan& plan) {
  if (protocols::is_study_of_shapes(protocol)) return std::make_unique<ShapeFigures>(plan);
  return std::make_unique<TaskFigures>(plan, protocol.groups.unmasked());
}

std::vector<json> values_of_point(const Sweep& sweep, std::int64_t point) {
  std::vector<json> values;
  const std::vector<double> shares = sweep.design.at(point);
  const auto& parameters = sweep.study.space().parameters;
  for (std::size_t i = 0; i < parameters.size(); ++i)
    values.push_back(parameters[i].value_at(shares[i]));
  return values;
}

data::SweepValue stored(const json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_boolean()) return value.get<bool>() ? 1.0 : 0.0;
  return value.get<double>();
}

/// The reason without file names, the same on every machine.
std::string reason_of(const std::exception& error) {
  std::string text;
  if (const auto* const input = dynamic_cast<const protocols::InputError*>(&error)) {
    for (const protocols::Fault& fault : input->faults())
      text += (text.empty() ? "" : "; ") + fault.location + ": " + fault.expected;
  } else {
    text = error.what();
  }
  std::replace(text.begin(), text.end(), '\n', ' ');
  text = printable(text, kMaxReason);
  return text.empty() ? "unknown" : text;
}

}  // namespace

void add_sweep_options(CommandLine& line, SweepSettings& settings) {
  line.options.add_options()  //
      ("space", po::value(&settings.space)->required()->value_name("FILE"),
       "what varies, and how (JSON)")  //
      ("points", po::value(&settings.points)->required()->value_name("N"),
       "number of studies; grid and saltelli round down to a possible number")  //
      ("design",
       po::value(&settings.design)->default_value("lhs")->value_name("lhs|sobol|grid|saltelli"),
       "how the points lie: Latin hypercube, Sobol's sequence, all combinations, or Saltelli's "
       "samples for Sobol indices")  //
      ("seed", po::value(&settings.seed)->default_value(settings.seed)->value_name("S"),
       "of the design and, with its number, of every point")  //
      ("participants",
       po::value(&settings.participants)->default_value(settings.participants)->value_name("N"),
       "simulated participants at each point")  //
      ("repetitions", po::value(&settings.repetitions)->value_name("R"),
       "of each shape with each renderer, instead of the protocol's");
  add_participant_version(line, settings.version);
  line.options.add_options()  //
      ("settings", po::value(&settings.patch)->value_name("FILE"),
       "JSON merge patch on those settings, before anything varies");
}

void check_sweep_options(const po::variables_map& values, SweepSettings& settings) {
  constexpr std::int64_t kMostPoints = 100'000'000;
  if (settings.points < 1 || settings.points > kMostPoints)
    throw UsageError("--points: must be 1 to " + std::to_string(kMostPoints));
  study::check_simulated_participants(settings.participants);
  if (values.count("repetitions") && (settings.repetitions < 1 || settings.repetitions > 1000000))
    throw UsageError("--repetitions: must be 1 to 1000000");
  check_participant_version(values, settings.version);
  settings.protocol = values["PROTOCOL.json"].as<std::string>();
}

PlannedSweep::PlannedSweep(const SweepSettings& settings)
    : protocol(protocols::parse_protocol(settings.protocol)),
      study(base_protocol(protocol, settings), settings.protocol,
            read_json(participants::simulated_settings_text(settings.patch, settings.version)),
            protocols::parse_sweep_space(settings.space), settings.space),
      design(design_of(settings, study)),
      plan(plan_of_sweep(settings, study, design, protocol)) {
  if (design.size() < settings.points) {
    std::cerr << settings.design << ": " << design.size() << " points of the " << settings.points
              << " requested\n";
  }
}

sweep::PointStudy study_of_point(const Sweep& sweep, std::int64_t point) {
  return sweep.study.at(sweep.plan.seed, point, values_of_point(sweep, point));
}

std::optional<data::SweepRow> run_point(const Sweep& sweep, std::int64_t point,
                                        const std::atomic<bool>& stop) {
  data::SweepRow row;
  row.point = point;
  for (const json& value : values_of_point(sweep, point)) row.values.push_back(stored(value));
  const sweep::PointStudy study = study_of_point(sweep, point);
  row.seed = study.seed;
  row.order_seed = study.order_seed;
  try {
    protocols::Protocol protocol = sweep.study.parse(study.protocol);
    const participants::SimulatedSettings settings =
        participants::read_simulated_settings(study.settings.dump());
    session::limit_for_simulation(protocol, settings);
    const std::unique_ptr<PointFigures> figures = figures_for(protocol, sweep.plan);
    const bool done = session::simulate_in_memory(
        protocol, settings, session::first_numbers(sweep.plan.participants), study.seed, stop,
        [&](int participant, const data::TrialRecord& record, std::uint64_t contact_ticks) {
          figures->add(participant, record, contact_ticks);
        });
    if (!done) return std::nullopt;
    row.figures = figures->figures();
  } catch (const std::exception& error) {
    row.reason = reason_of(error);
    row.figures.assign(data::figure_columns(sweep.plan).size(), std::nullopt);
  }
  return row;
}

}  // namespace palpate::runner::commands
