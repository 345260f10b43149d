#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "protocols/parse_scene.h"
#include "protocols/tasks/parse_blocks.h"

namespace palpate::protocols {

namespace {

using nlohmann::json;

constexpr NumberRange kAnyLevel{-1e9, 1e9};
constexpr NumberRange kPositiveLevel{0, 1e9, "", true};
constexpr NumberRange kStep{0, 1e9, "", true};
constexpr NumberRange kTrials{1, 10000};
constexpr NumberRange kRun{1, 10};
constexpr NumberRange kShare{0, 1};
constexpr std::size_t kMostLevels = 1000;
constexpr std::size_t kMaxTracks = 16;
constexpr double kMostSeriesLevels = 1000;
// 32 MB of tables and some ms a trial; Watson's examples need a tenth.
constexpr double kMostCells = 4e6;

const NumberRange& level_range(LevelScale scale) {
  return scale == LevelScale::linear ? kAnyLevel : kPositiveLevel;
}

void read_scale(ObjectReader& reader, LevelScale& scale) {
  reader.choice(
      "scale", scale,
      {{"linear", LevelScale::linear}, {"log", LevelScale::log10}, {"db", LevelScale::decibel}});
}

void read_easier(ObjectReader& reader, Easier& easier) {
  reader.choice("easier", easier, {{"higher", Easier::higher}, {"lower", Easier::lower}});
}

ConstantStimuli read_constant(ObjectReader& reader) {
  ConstantStimuli spec;
  const GridLimits limits{kAnyLevel, kMostLevels, Presence::required};
  spec.levels = read_grid_values(reader, "levels", limits);
  reader.integer("repetitions", spec.repetitions, kTrials, Presence::required);
  return spec;
}

/// `target` is an alternative to step_ratio.
void read_weights(ObjectReader& reader, Staircase& spec) {
  reader.number("step_ratio", spec.step_ratio, {0.01, 100});
  double target = 0;
  reader.number("target", target, {0.05, 0.99});
  if (!reader.has("target") || target == 0) return;
  if (reader.has("step_ratio")) {
    reader.faults().add(reader.pointer("target"),
                        "expected target or step_ratio, not both: each follows from the other");
  } else if (spec.up != 1) {
    reader.faults().add(reader.pointer("target"),
                        "expected up = 1 with a target; use step_ratio otherwise");
  } else {
    spec.step_ratio = step_ratio_for(target, spec.down);
  }
}

void read_stop(ObjectReader& reader, Staircase& spec) {
  reader.section(
      "stop",
      [&](ObjectReader& stop) {
        stop.integer("reversals", spec.stop_reversals, {2, 1000});
        stop.integer("trials", spec.stop_trials, kTrials);
        if (!stop.has("reversals") && !stop.has("trials"))
          stop.faults().add(stop.pointer(), "expected reversals, trials or both");
      },
      Presence::required);
}

Staircase read_staircase(ObjectReader& reader) {
  Staircase spec;
  FaultList& faults = reader.faults();
  read_scale(reader, spec.scale);
  read_easier(reader, spec.easier);
  const NumberRange& range = level_range(spec.scale);
  reader.number("start", spec.start, range, Presence::required);
  reader.number("min", spec.min, range, Presence::required);
  reader.number("max", spec.max, range, Presence::required);
  spec.steps = read_grid_values(reader, "steps", {kStep, 100, Presence::required, true});
  reader.integer("up", spec.up, kRun);
  reader.integer("down", spec.down, kRun);
  read_weights(reader, spec);
  read_stop(reader, spec);
  reader.integer("discard_reversals", spec.discard_reversals, {0, 1000});
  if (!(spec.min < spec.max) && reader.has("min") && reader.has("max")) {
    faults.add(reader.pointer("max"), "expected more than min");
  } else if (!(spec.start >= spec.min && spec.start <= spec.max)) {
    faults.add(reader.pointer("start"), "expected a level from min to max");
  }
  if (spec.stop_reversals.has_value() && spec.discard_reversals + 2 > *spec.stop_reversals) {
    faults.add(reader.pointer("discard_reversals"),
               "expected at least two reversals left: stop.reversals is " +
                   std::to_string(*spec.stop_reversals));
  }
  return spec;
}

void read_quest_stop(ObjectReader& reader, QuestPlus& spec) {
  reader.section(
      "stop",
      [&](ObjectReader& stop) {
        stop.integer("trials", spec.stop_trials, kTrials, Presence::required);
        stop.number("entropy_bits", spec.stop_entropy_bits, {0, 64});
      },
      Presence::required);
}

/// Checks faults that involve several keys.
void check_quest(ObjectReader& reader, const QuestPlus& spec) {
  FaultList& faults = reader.faults();
  if (spec.function.shape == PsychometricShape::weibull &&
      spec.function.scale == LevelScale::linear) {
    faults.add(reader.pointer("function"),
               "expected scale 'log' or 'db' with the Weibull function: its levels are ratios");
  }
  const auto& guess = spec.guess.values;
  const auto& lapse = spec.lapse.values;
  if (guess.empty() || lapse.empty()) return;
  if (!(*std::max_element(guess.begin(), guess.end()) +
            *std::max_element(lapse.begin(), lapse.end()) <
        1)) {
    faults.add(reader.pointer("lapse"), "expected less than 1 together with the largest guess");
  }
  const auto size = [](const ParameterGrid& grid) {
    return static_cast<double>(grid.values.size());
  };
  const double parameters =
      size(spec.threshold) * size(spec.slope) * size(spec.guess) * size(spec.lapse);
  const double cells = parameters * static_cast<double>(spec.levels.size());
  if (cells > kMostCells) {
    faults.add(reader.pointer("threshold"),
               "expected at most 4000000 combinations of level and parameters; these grids have " +
                   std::to_string(static_cast<long long>(cells)));
  }
  if (spec.stop_entropy_bits.has_value() && *spec.stop_entropy_bits >= std::log2(parameters)) {
    faults.add(reader.pointer("stop") + "/entropy_bits",
               "expected less than the entropy before the first trial, " +
                   std::to_string(std::log2(parameters)) + " bit");
  }
}

QuestPlus read_quest(ObjectReader& reader) {
  QuestPlus spec;
  reader.choice("function", spec.function.shape,
                {{"logistic", PsychometricShape::logistic},
                 {"normal", PsychometricShape::normal},
                 {"weibull", PsychometricShape::weibull}},
                Presence::required);
  read_scale(reader, spec.function.scale);
  read_easier(reader, spec.function.easier);
  const NumberRange& range = level_range(spec.function.scale);
  spec.levels = read_grid_values(reader, "levels", {range, kMostLevels, Presence::required});
  spec.threshold = read_grid(reader, "threshold", {range, kMostLevels, Presence::required});
  spec.slope = read_grid(reader, "slope", {kStep, kMostLevels, Presence::required});
  spec.guess = read_grid(reader, "guess", {kShare, kMostLevels, Presence::required});
  spec.lapse = read_grid(reader, "lapse", {kShare, kMostLevels});
  if (!reader.has("lapse")) spec.lapse.values = {0.02};
  read_quest_stop(reader, spec);
  check_quest(reader, spec);
  return spec;
}

Limits read_limits(ObjectReader& reader) {
  Limits spec;
  FaultList& faults = reader.faults();
  read_scale(reader, spec.scale);
  read_easier(reader, spec.easier);
  const NumberRange& range = level_range(spec.scale);
  reader.number("low", spec.low, range, Presence::required);
  reader.number("high", spec.high, range, Presence::required);
  reader.number("step", spec.step, kStep, Presence::required);
  reader.integer("series", spec.series, {1, 1000});
  reader.choice("first", spec.ascending_first, {{"ascending", true}, {"descending", false}});
  reader.integer("jitter_steps", spec.jitter_steps, {0, 100});
  if (!reader.has("low") || !reader.has("high") || !reader.has("step")) return spec;
  if (!(spec.low < spec.high)) {
    faults.add(reader.pointer("high"), "expected more than low");
    return spec;
  }
  const double steps =
      (scale_position(spec.scale, spec.high) - scale_position(spec.scale, spec.low)) / spec.step;
  if (!(steps < kMostSeriesLevels)) {
    faults.add(reader.pointer("step"), "expected at most 1000 levels from low to high");
  } else if (steps < spec.jitter_steps + 1) {
    faults.add(reader.pointer("step"),
               "expected at least two levels in every series, also where it starts jitter_steps "
               "inside");
  }
  return spec;
}

Asked read_asked(ObjectReader& reader) {
  Asked spec;
  read_scale(reader, spec.scale);
  read_easier(reader, spec.easier);
  const NumberRange& range = level_range(spec.scale);
  reader.number("min", spec.min, range, Presence::required);
  reader.number("max", spec.max, range, Presence::required);
  reader.section(
      "stop",
      [&](ObjectReader& stop) {
        stop.integer("trials", spec.stop_trials, kTrials, Presence::required);
      },
      Presence::required);
  if (!(spec.min < spec.max) && reader.has("min") && reader.has("max"))
    reader.faults().add(reader.pointer("max"), "expected more than min");
  return spec;
}

enum class ProcedureKind { none, constant, staircase, quest_plus, limits, ask };

ProcedureSpec read_kind(ObjectReader& reader, ProcedureKind kind) {
  switch (kind) {
    case ProcedureKind::staircase:
      return read_staircase(reader);
    case ProcedureKind::quest_plus:
      return read_quest(reader);
    case ProcedureKind::limits:
      return read_limits(reader);
    case ProcedureKind::ask:
      return read_asked(reader);
    default:
      return read_constant(reader);
  }
}

}  // namespace

std::optional<ProcedureSpec> read_procedure(ObjectReader& reader) {
  const std::size_t before = reader.faults().count();
  ProcedureKind kind = ProcedureKind::none;
  reader.choice("kind", kind,
                {{"constant", ProcedureKind::constant},
                 {"staircase", ProcedureKind::staircase},
                 {"quest_plus", ProcedureKind::quest_plus},
                 {"limits", ProcedureKind::limits},
                 {"ask", ProcedureKind::ask}},
                Presence::required);
  if (kind == ProcedureKind::none) return std::nullopt;  // other keys depend on it
  ProcedureSpec spec = read_kind(reader, kind);
  reader.refuse_unknown_keys();
  if (reader.faults().count() != before) return std::nullopt;
  return spec;
}

void read_procedures(ObjectReader& block, std::vector<ProcedureSpec>& procedures) {
  const json* const value = block.member("procedure");
  if (value == nullptr) return;
  const std::string pointer = block.pointer("procedure");
  const auto read_one = [&](const json& one, const std::string& where) {
    ObjectReader procedure(one, where, block.faults());
    if (auto spec = read_procedure(procedure)) procedures.push_back(std::move(*spec));
  };
  if (!value->is_array()) return read_one(*value, pointer);
  if (block.array("procedure", 1, kMaxTracks) == nullptr) return;
  for (std::size_t i = 0; i < value->size(); ++i) read_one((*value)[i], child_pointer(pointer, i));
}

}  // namespace palpate::protocols
