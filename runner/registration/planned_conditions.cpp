#include "runner/registration/planned_conditions.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <variant>

#include "analysis/report/plan_report.h"
#include "analysis/text.h"
#include "data/base/cell_name.h"
#include "data/base/text.h"
#include "protocols/factors.h"
#include "protocols/procedures/procedure.h"
#include "protocols/procedures/recovery.h"
#include "protocols/tasks/block_order.h"
#include "protocols/tasks/levels.h"
#include "runner/usage_error.h"

namespace palpate::runner::registration {
namespace {

using analysis::PlannedContrast;
using analysis::PlannedMeasure;
using protocols::Protocol;
using protocols::TaskBlock;
using protocols::TaskKind;

constexpr const char* kTime = "time";

/// Movements with a stimulus and a renderer that give the measure.
std::size_t movements_of(const TaskBlock& block, PlannedMeasure measure) {
  using protocols::ReachTrial;
  const ReachTrial kind = measure == PlannedMeasure::adaptation    ? ReachTrial::clamp
                          : measure == PlannedMeasure::aftereffect ? ReachTrial::none
                                                                   : ReachTrial::field;
  return static_cast<std::size_t>(protocols::reaches_of_track(block, kind));
}

bool exerts_force(const stimuli::FieldSpec& field) {
  return field.force != Vec3(0) || field.stiffness > 0 || field.damping != Mat3(0) ||
         field.amplitude > 0;
}

/// Whether a channel shows what the hand has learnt: there is something to learn.
bool has_field(const Protocol& protocol, const TaskBlock& block) {
  return std::ranges::any_of(block.stimuli, [&](int stimulus) {
    const auto& fields = protocol.stimuli[static_cast<std::size_t>(stimulus)].object.fields;
    return std::ranges::any_of(fields, exerts_force);
  });
}

std::vector<std::string> measures_of_reaching(const Protocol& protocol, const TaskBlock& block) {
  std::vector<std::string> out = {to_string(PlannedMeasure::deviation)};
  if (movements_of(block, PlannedMeasure::aftereffect) > 0)
    out.emplace_back(to_string(PlannedMeasure::aftereffect));
  if (movements_of(block, PlannedMeasure::adaptation) > 0 && has_field(protocol, block))
    out.emplace_back(to_string(PlannedMeasure::adaptation));
  return out;
}

/// Whether the analysis finds a JND over several dimensions: by the form of QUEST+, or between a
/// standard and a comparison of one number.
bool has_jnd_of_points(const TaskBlock& block) {
  using Of = protocols::LevelDimension::Of;
  for (const protocols::ProcedureSpec& spec : block.procedures) {
    if (const auto* quest = std::get_if<protocols::FieldQuestPlus>(&spec))
      return quest->function.form == protocols::FieldForm::weber ||
             quest->function.form == protocols::FieldForm::power;
  }
  const auto of = [&](Of what) {
    return std::ranges::find(block.dimensions, what, &protocols::LevelDimension::of);
  };
  const auto standard = of(Of::standard), comparison = of(Of::comparison);
  return block.dimensions.size() == 2 && standard != block.dimensions.end() &&
         comparison != block.dimensions.end() &&
         standard->target.pointer == comparison->target.pointer;
}

/// The measures that the analysis finds in a block, as plans name them.
std::vector<std::string> measures_of(const Protocol& protocol, const TaskBlock& block) {
  if (!block.dimensions.empty() && block.task != TaskKind::rate) {
    const bool jnd = block.task == TaskKind::compare && has_jnd_of_points(block);
    return jnd ? std::vector<std::string>{to_string(PlannedMeasure::jnd)}
               : std::vector<std::string>();
  }
  switch (block.task) {
    case TaskKind::identify:
      return {kTime, to_string(PlannedMeasure::accuracy)};
    case TaskKind::compare: {
      const int side = protocols::side_of_levels(protocol, block);
      if (!block.level || block.same_different) return {to_string(PlannedMeasure::threshold)};
      if (side != 0) return {to_string(PlannedMeasure::jnd), to_string(PlannedMeasure::threshold)};
      return {to_string(PlannedMeasure::jnd), to_string(PlannedMeasure::pse)};
    }
    case TaskKind::detect:
      return {to_string(PlannedMeasure::threshold)};
    case TaskKind::adjust:
      return {to_string(PlannedMeasure::pse)};
    case TaskKind::rate: {
      const bool numbers = block.level && block.answers.empty();
      return {to_string(numbers ? PlannedMeasure::exponent : PlannedMeasure::rating)};
    }
    case TaskKind::reach:
      return measures_of_reaching(protocol, block);
    case TaskKind::external:
      break;
  }
  return {};
}

/// Trials with a stimulus and a renderer.
std::size_t trials_of(const TaskBlock& block) {
  if (block.procedures.empty()) return static_cast<std::size_t>(block.repetitions);
  double trials = 0;
  for (const protocols::ProcedureSpec& spec : block.procedures) {
    const bool constant = std::holds_alternative<protocols::ConstantStimuli>(spec);
    trials += constant ? static_cast<double>(protocols::most_trials(spec))
                       : protocols::expected_trials(spec, protocols::Procedure(spec, 0));
  }
  return static_cast<std::size_t>(std::max(1L, std::lround(trials)));
}

/// Identification: trials with a renderer in a cell of the factors, of one shape or of all.
std::size_t trials_of_identification(const Protocol& protocol, const std::vector<int>& blocks,
                                     bool of_one_shape) {
  std::size_t trials = 0;
  const auto kind = protocol.blocks[static_cast<std::size_t>(blocks.front())].renderers.front();
  for (const int index : blocks) {
    const TaskBlock& block = protocol.blocks[static_cast<std::size_t>(index)];
    if (std::ranges::find(block.renderers, kind) == block.renderers.end()) continue;
    if (block.cell.value_or(0) > 0) continue;
    const std::size_t cells = block.cell ? 1 : protocols::cells_of(block);
    trials += trials_of(block) * (of_one_shape ? 1 : block.stimuli.size() / cells);
  }
  return trials;
}

bool is_of_identification(const analysis::PlanRecord& plan) {
  return plan.measure() == nullptr || plan.measure()->measure == PlannedMeasure::accuracy;
}

bool is_of_reaching(const analysis::PlanRecord& plan) {
  return plan.measure() != nullptr && analysis::is_of_reaching(plan.measure()->measure);
}

std::string option_of(const std::string& measure) {
  return measure == kTime ? "--effect" : "--" + measure + "-effect";
}

/// "time", "jnd", ...: the measure of a plan.
std::string name_of_measure(const analysis::PlanRecord& plan) {
  return plan.measure() == nullptr ? kTime : to_string(plan.measure()->measure);
}

void require_measure(const analysis::PlanRecord& plan, const std::string& path,
                     const Protocol& protocol) {
  const std::string measure = name_of_measure(plan);
  if (!conditions_of(protocol, plan).blocks.empty()) return;
  std::string blocks;
  std::set<std::string> options;
  for (const TaskBlock& block : protocol.blocks) {
    if (block.practice) continue;
    const std::vector<std::string> names = measures_of(protocol, block);
    blocks += (blocks.empty() ? "" : "; ") +
              (block.name.empty() ? "" : "block '" + block.name + "': ") +
              (names.empty() ? "none" : analysis::joined(names));
    for (const std::string& name : names) options.insert(option_of(name));
  }
  std::string words;
  for (const std::string& option : options) words += (words.empty() ? "" : " or ") + option;
  throw UsageError(printable(path) + ": expected a plan of a measure that the protocol gives (" +
                   printable(blocks) + "); this one is of " + measure +
                   (words.empty() ? ", and no plan is of the task: palpate bundle needs none"
                                  : ": plan again with " + words));
}

/// The stimuli that are identified.
std::vector<std::string> identified(const Protocol& protocol, const std::vector<int>& blocks) {
  std::set<std::string> names;
  for (const int index : blocks) {
    for (const int stimulus : protocol.blocks[static_cast<std::size_t>(index)].stimuli)
      names.insert(base_name(protocol.stimuli[static_cast<std::size_t>(stimulus)].name));
  }
  return {names.begin(), names.end()};
}

void require_shapes(const analysis::StudyModel& model, const std::string& path,
                    const std::vector<std::string>& shown) {
  std::vector<std::string> planned = model.shapes;
  std::ranges::sort(planned);
  if (planned != shown)
    throw UsageError(path + ": /model/log_ratio: expected a plan for the protocol's shapes (" +
                     printable(analysis::joined(shown)) + "); this one is for " +
                     printable(analysis::joined(planned)));
}

/// Trials of a participant in a cell, as the plan counts them; of several blocks the fewest.
/// \pre a block gives the measure, or the protocol has no blocks
std::size_t trials_of_cell(const Protocol& protocol, const analysis::PlanRecord& plan) {
  const std::vector<int> blocks = conditions_of(protocol, plan).blocks;
  if (is_of_identification(plan))
    return trials_of_identification(protocol, blocks, plan.times() != nullptr);
  std::size_t fewest = 0;
  for (const int index : blocks) {
    const TaskBlock& block = protocol.blocks[static_cast<std::size_t>(index)];
    const std::size_t trials =
        is_of_reaching(plan) ? movements_of(block, plan.measure()->measure) : trials_of(block);
    fewest = fewest == 0 ? trials : std::min(fewest, trials);
  }
  return fewest;
}

void require_trials(const analysis::PlanRecord& plan, const std::string& path,
                    const Protocol& protocol) {
  const std::size_t trials = trials_of_cell(protocol, plan);
  if (plan.curve_for(trials) != nullptr) return;
  std::string others;
  for (const auto& curve : plan.curves)
    others += (others.empty() ? "" : ", ") + std::to_string(curve.trials);
  throw UsageError(
      path + ": /needed: expected a plan for the protocol's " + std::to_string(trials) +
      " trials of each " +
      (plan.times() != nullptr ? "shape with each renderer" : "participant with each condition") +
      "; this one is for " + others + ": plan again with --trials " + std::to_string(trials));
}

/// The contrast of a plan of another measure than times.
analysis::PlannedContrast contrast_of(const analysis::PlanRecord& plan) {
  return plan.measure() == nullptr ? PlannedContrast::conditions : plan.measure()->contrast;
}

/// Groups of a plan are two. Movements under one condition differ from nothing but 0.
void require_contrast(const analysis::PlanRecord& plan, const std::string& path,
                      const Protocol& protocol) {
  if (!is_of_reaching(plan) || conditions_of(protocol, plan).differ) return;
  const bool groups = contrast_of(plan) == PlannedContrast::groups;
  throw UsageError(printable(path) + ": /model/contrast: expected " +
                   (groups ? "a protocol of two groups of participants, found " +
                                 analysis::counted(protocol.groups.names.size(), "group", "groups")
                           : "a measure of two conditions; the protocol has one that gives it") +
                   ": plan again with --contrast " +
                   (groups ? "conditions or zero" : "groups or zero"));
}

/// A threshold cannot lie beyond its standard.
void require_possible(const analysis::PlanRecord& plan, const std::string& path,
                      const Protocol& protocol) {
  const analysis::ThresholdStudy* const study = plan.measure();
  if (study == nullptr || study->measure != PlannedMeasure::threshold) return;
  for (const int index : conditions_of(protocol, plan).blocks) {
    const TaskBlock& block = protocol.blocks[static_cast<std::size_t>(index)];
    if (block.task != TaskKind::compare || !block.standard) continue;
    const auto standard = protocols::own_level(protocol, block, *block.standard);
    const int side = protocols::side_of_levels(protocol, block);
    if (!standard || *standard == 0 || side == 0) continue;
    const double first = 1 + side * study->weber_fraction;  // in standards
    if (side * (first * std::exp(study->effect / 2) - 1) > 0 &&
        side * (first * std::exp(-study->effect / 2) - 1) > 0)
      continue;
    throw UsageError(printable(path) + ": /model/effect: a threshold that is " +
                     analysis::effect_in_words(*study) +
                     " would lie beyond the standard of block '" + block.name +
                     "'; plan --jnd-effect, of the distance from the standard");
  }
}

/// The stimuli at the first level of a factor that a block shows, and those in no cell of it.
/// \param cells  blocks and stimuli
std::set<int> at_first_level(const Protocol& protocol, const std::string& factor,
                             const std::set<std::pair<int, int>>& cells) {
  std::set<int> out;
  std::string first;
  for (const auto& [block, stimulus] : cells) {
    const std::string level =
        cell_name(protocol.stimuli[static_cast<std::size_t>(stimulus)].name).level(factor);
    if (first.empty()) first = level;
    if (level.empty() || level == first) out.insert(stimulus);
  }
  return out;
}

}  // namespace

bool PlannedConditions::is_second(const protocols::Trial& trial, std::size_t group) const {
  if (!differ) return false;
  if (contrast == PlannedContrast::groups) return group == 1;
  if (contrast == PlannedContrast::zero) return true;
  if (by_renderer) return trial.renderer == protocols::RendererKind::ray;
  if (!factor.empty()) return !first_stimuli.contains(trial.stimulus);
  return trial.task_block != blocks.front() || !first_stimuli.contains(trial.stimulus);
}

PlannedConditions conditions_of(const Protocol& protocol, const analysis::PlanRecord& plan) {
  PlannedConditions out;
  const std::string measure = name_of_measure(plan);
  std::set<protocols::RendererKind> renderers;
  std::set<std::pair<int, int>> cells;
  for (std::size_t i = 0; i < protocol.blocks.size(); ++i) {
    const TaskBlock& block = protocol.blocks[i];
    const std::vector<std::string> names = measures_of(protocol, block);
    if (block.practice || std::ranges::find(names, measure) == names.end()) continue;
    const auto index = static_cast<int>(i);
    if (out.blocks.empty()) out.first_stimuli = {block.stimuli.front()};
    if (out.factor.empty() && !block.factors.empty() && !block.cells_share_tracks)
      out.factor = protocol.factors[block.factors.front().factor].name;
    out.blocks.push_back(index);
    renderers.insert(block.renderers.begin(), block.renderers.end());
    // The figures of tracks that cells share are of all cells.
    const std::size_t apart = block.cells_share_tracks ? protocols::cells_of(block) : 1;
    for (std::size_t s = 0; s < block.stimuli.size() / apart; ++s)
      cells.emplace(index, block.stimuli[s]);
  }
  out.contrast = contrast_of(plan);
  if (out.contrast != PlannedContrast::conditions) {
    out.factor.clear();
    out.differ = out.contrast == PlannedContrast::zero || protocol.groups.names.size() == 2;
    return out;
  }
  out.by_renderer = renderers.size() > 1;
  if (out.by_renderer) out.factor.clear();
  if (!out.factor.empty()) out.first_stimuli = at_first_level(protocol, out.factor, cells);
  out.differ =
      out.by_renderer || !out.factor.empty() || (cells.size() > 1 && !is_of_identification(plan));
  return out;
}

const analysis::PlanRecord::Curve& fitting_curve(const Protocol& protocol,
                                                 const analysis::PlanRecord& plan) {
  return *plan.curve_for(trials_of_cell(protocol, plan));
}

void require_fitting(const analysis::PlanRecord& plan, const std::string& path,
                     const Protocol& protocol) {
  require_measure(plan, path, protocol);
  if (const analysis::StudyModel* const model = plan.times())
    require_shapes(*model, path, identified(protocol, conditions_of(protocol, plan).blocks));
  require_contrast(plan, path, protocol);
  require_trials(plan, path, protocol);
  require_possible(plan, path, protocol);
}

}  // namespace palpate::runner::registration
