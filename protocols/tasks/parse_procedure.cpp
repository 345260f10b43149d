#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "protocols/parse_grid.h"
#include "protocols/parse_scene.h"
#include "protocols/tasks/levels.h"
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
constexpr std::size_t kMostListed = 1000;
constexpr std::size_t kMaxTracks = 16;
constexpr double kMostSeriesLevels = 1000;
// 32 MB of tables and some ms a trial; Watson's examples need a tenth.
constexpr double kMostGridCells = 4e6;

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

using Dimensions = std::vector<LevelDimension>;

std::string names_of(const Dimensions& dimensions) {
  std::string names;
  for (const LevelDimension& one : dimensions) names += (names.empty() ? "" : ", ") + one.name;
  return names;
}

/// The values of each dimension, whose product are the points; empty: faults.
std::vector<std::vector<double>> read_product(ObjectReader& reader, const Dimensions& dimensions,
                                              std::size_t most) {
  std::vector<std::vector<double>> levels;
  reader.section(
      "grid",
      [&](ObjectReader& grid) {
        for (const LevelDimension& one : dimensions)
          levels.push_back(read_grid_values(
              grid, one.name.c_str(), {level_range(one.scale), kMostListed, Presence::required}));
      },
      Presence::required);
  std::size_t size = levels.empty() ? 0 : 1;
  std::string factors;
  for (const auto& values : levels) {
    size *= values.size();
    factors += (factors.empty() ? "" : " x ") + std::to_string(values.size());
  }
  if (size > most)
    reader.faults().add(reader.pointer("grid"), "expected at most " + std::to_string(most) +
                                                    " points; this grid has " + factors + " = " +
                                                    std::to_string(size));
  if (size == 0 || size > most) levels.clear();
  return levels;
}

/// A list of points, each a list of numbers in the order of the dimensions.
std::vector<LevelPoint> read_points(ObjectReader& reader, const Dimensions& dimensions) {
  std::vector<LevelPoint> points;
  const json* const list = reader.array("levels", 1, kMostListed, Presence::required);
  if (list == nullptr) return points;
  for (std::size_t i = 0; i < list->size(); ++i) {
    const std::string place = child_pointer(reader.pointer("levels"), i);
    const json& value = (*list)[i];
    if (!value.is_array() || value.size() != dimensions.size()) {
      reader.faults().add(place, "expected a list of " + std::to_string(dimensions.size()) +
                                     " numbers, in the order of the dimensions: " +
                                     names_of(dimensions) + found_text(value));
      continue;
    }
    LevelPoint point(dimensions.size());
    for (std::size_t d = 0; d < point.size(); ++d)
      read_number(value[d], child_pointer(place, d), point[d], level_range(dimensions[d].scale),
                  reader.faults());
    if (std::ranges::find(points, point) != points.end())
      reader.faults().add(place, "expected each point once" + found_text(value) + " again");
    points.push_back(std::move(point));
  }
  return points;
}

ConstantStimuli read_constant_points(ObjectReader& reader, const Dimensions& dimensions) {
  ConstantStimuli spec;
  if (reader.has("levels") == reader.has("grid")) {
    reader.member("levels");
    reader.member("grid");
    reader.faults().add(reader.pointer("levels"),
                        "expected levels (a list of points) or grid (values of each dimension: " +
                            names_of(dimensions) + "), one of both");
  } else if (reader.has("grid")) {
    const auto levels = read_product(reader, dimensions, kMostListed);
    if (!levels.empty()) spec.points = product_of(levels);
  } else {
    spec.points = read_points(reader, dimensions);
  }
  reader.integer("repetitions", spec.repetitions, kTrials, Presence::required);
  return spec;
}

ConstantStimuli read_constant(ObjectReader& reader, const Dimensions& dimensions) {
  if (!dimensions.empty()) return read_constant_points(reader, dimensions);
  ConstantStimuli spec;
  const GridLimits limits{kAnyLevel, kMostListed, Presence::required};
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

/// \param spec  QuestPlus or FieldQuestPlus
template <class Spec>
void read_quest_stop(ObjectReader& reader, Spec& spec) {
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
  if (cells > kMostGridCells) {
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
  spec.levels = read_grid_values(reader, "levels", {range, kMostListed, Presence::required});
  spec.threshold = read_grid(reader, "threshold", {range, kMostListed, Presence::required});
  spec.slope = read_grid(reader, "slope", {kStep, kMostListed, Presence::required});
  spec.guess = read_grid(reader, "guess", {kShare, kMostListed, Presence::required});
  spec.lapse = read_grid(reader, "lapse", {kShare, kMostListed});
  if (!reader.has("lapse")) spec.lapse.values = {0.02};
  read_quest_stop(reader, spec);
  check_quest(reader, spec);
  return spec;
}

constexpr std::size_t kMostProductLevels = 4096;

/// The dimension that a key of the function names; `usual` without the key.
void read_place(ObjectReader& function, const char* key, const Dimensions& dimensions,
                std::optional<std::size_t> usual, std::size_t& place) {
  const json* const value = function.member(key, usual ? Presence::optional : Presence::required);
  if (usual) place = *usual;
  if (value == nullptr) return;
  const auto found = std::ranges::find(
      dimensions, value->is_string() ? value->get<std::string>() : "", &LevelDimension::name);
  if (found == dimensions.end())
    function.faults().add(function.pointer(key), "expected the name of a dimension, one of " +
                                                     names_of(dimensions) + found_text(*value));
  else
    place = static_cast<std::size_t>(found - dimensions.begin());
}

/// The one dimension that satisfies `is`; nullopt for zero or several.
template <class Is>
std::optional<std::size_t> only(const Dimensions& dimensions, Is is) {
  if (std::ranges::count_if(dimensions, is) != 1) return std::nullopt;
  return static_cast<std::size_t>(std::ranges::find_if(dimensions, is) - dimensions.begin());
}

/// x - S is the difference between the comparison and what it is compared with.
void check_roles(ObjectReader& reader, const Dimensions& dimensions,
                 const FieldFunction& function) {
  const LevelDimension &x = dimensions[function.x], &other = dimensions[function.other];
  if (x.of == LevelDimension::Of::standard)
    reader.faults().add(reader.pointer("x"), "expected a dimension of the comparison: '" + x.name +
                                                 "' is of the standard");
  const std::string unit = unit_of_level(other.target.pointer);
  if (unit_of_level(x.target.pointer) != unit)
    reader.faults().add(reader.pointer("x"), "expected a dimension in " + unit + ", the unit of '" +
                                                 other.name + "': their difference counts");
}

void read_places(ObjectReader& reader, const Dimensions& dimensions, FieldFunction& function) {
  const std::size_t before = reader.faults().count();
  const std::size_t wanted = function.form == FieldForm::cues ? 3 : 2;
  if (dimensions.size() != wanted) {
    reader.faults().add(reader.pointer("form"),
                        std::string("expected another form: '") + to_string(function.form) +
                            "' has " + std::to_string(wanted) + " dimensions, the level has " +
                            std::to_string(dimensions.size()));
    for (const char* const key : {"x", "standard", "conflict", "x1", "x2"}) reader.member(key);
    return;
  }
  using Of = LevelDimension::Of;
  if (!has_two_lapses(function.form)) {
    read_place(reader, "x1", dimensions, 0, function.x);
    read_place(reader, "x2", dimensions, 1, function.other);
    if (reader.faults().count() == before && function.x == function.other)
      reader.faults().add(reader.pointer("x2"), "expected another dimension than x1");
  } else {
    const auto standard = only(dimensions, [](const auto& d) { return d.of == Of::standard; });
    const auto x = only(dimensions, [&](const auto& d) { return d.of == Of::comparison; });
    read_place(reader, "x", dimensions, x, function.x);
    read_place(reader, "standard", dimensions, standard, function.other);
    std::set<std::size_t> places{function.x, function.other};
    if (function.form == FieldForm::cues) {
      std::optional<std::size_t> rest;
      for (std::size_t d = 0; d < dimensions.size(); ++d)
        if (!places.contains(d)) rest = d;
      read_place(reader, "conflict", dimensions, places.size() == 2 ? rest : std::nullopt,
                 function.conflict);
      places.insert(function.conflict);
    }
    if (reader.faults().count() == before && places.size() != wanted)
      reader.faults().add(reader.pointer("standard"),
                          "expected a dimension for each of the form's numbers, found one twice");
    if (reader.faults().count() == before) check_roles(reader, dimensions, function);
  }
  function.x_scale = dimensions[function.x].scale;
  function.other_scale = dimensions[function.other].scale;
}

void read_function(ObjectReader& reader, const Dimensions& dimensions, FieldFunction& function) {
  reader.choice("form", function.form,
                {{"weber", FieldForm::weber},
                 {"power", FieldForm::power},
                 {"threshold_line", FieldForm::threshold_line},
                 {"threshold_parabola", FieldForm::threshold_parabola},
                 {"cues", FieldForm::cues}},
                Presence::required);
  if (!reader.has("form")) return;
  read_places(reader, dimensions, function);
  if (has_two_lapses(function.form)) return;
  reader.choice("shape", function.shape,
                {{"normal", PsychometricShape::normal},
                 {"logistic", PsychometricShape::logistic},
                 {"weibull", PsychometricShape::weibull}});
  if (function.shape == PsychometricShape::weibull && function.x_scale == LevelScale::linear)
    reader.faults().add(reader.pointer("shape"),
                        "expected scale 'log' of the dimension x1 with the Weibull function: its "
                        "levels are ratios");
}

/// The values that a parameter of a form may have.
NumberRange parameter_range(FieldForm form, const std::string& name) {
  if (name == "guess" || name == "lapse") return kShare;
  const bool scale = name == "slope" || name == "s" || (name == "w" && form != FieldForm::cues);
  return scale ? kStep : kAnyLevel;
}

void read_interest(ObjectReader& reader, const std::vector<std::string>& names,
                   std::vector<bool>& interest) {
  interest.assign(names.size(), true);
  const json* const list = reader.array("interest", 1, names.size());
  if (list == nullptr) return;
  interest.assign(names.size(), false);
  std::string words;
  for (const std::string& name : names) words += (words.empty() ? "'" : ", '") + name + "'";
  for (std::size_t i = 0; i < list->size(); ++i) {
    const json& value = (*list)[i];
    const auto found = std::ranges::find(names, value.is_string() ? value.get<std::string>() : "");
    const std::string place = child_pointer(reader.pointer("interest"), i);
    if (found == names.end()) {
      reader.faults().add(place, "expected one of " + words + found_text(value));
      continue;
    }
    const auto at = static_cast<std::size_t>(found - names.begin());
    if (interest[at])
      reader.faults().add(place, "expected each parameter once" + found_text(value) + " again");
    interest[at] = true;
  }
}

/// The JND of Weber's law and of a power law is above 0 at every standard.
void check_jnd(ObjectReader& reader, const FieldQuestPlus& spec) {
  const FieldFunction& function = spec.function;
  if (function.form != FieldForm::weber && function.form != FieldForm::power) return;
  const double standard = std::ranges::min(spec.levels[function.other]);
  if (function.form == FieldForm::power && !(standard > 0))
    reader.faults().add(reader.pointer("grid"), "expected standards above 0 with the form 'power'");
  if (function.form == FieldForm::weber &&
      !(standard + std::ranges::min(spec.parameters[1].values) > 0))
    reader.faults().add(reader.pointer("c"),
                        "expected more than " + level_text(0 - standard) +
                            ": the JND w (S + c) is above 0 at every standard");
}

void check_rates(ObjectReader& reader, const FieldQuestPlus& spec) {
  const double lapse = std::ranges::max(spec.parameters.back().values);
  const double guess = has_two_lapses(spec.function.form)
                           ? lapse
                           : std::ranges::max(spec.parameters[spec.parameters.size() - 2].values);
  if (!(guess + lapse < 1))
    reader.faults().add(reader.pointer("lapse"),
                        has_two_lapses(spec.function.form)
                            ? "expected less than 0.5: it is at both ends of the function"
                            : "expected less than 1 together with the largest guess");
}

void check_size(ObjectReader& reader, const FieldQuestPlus& spec) {
  double parameters = 1, points = 1;
  for (const ParameterGrid& grid : spec.parameters)
    parameters *= static_cast<double>(grid.values.size());
  for (const auto& values : spec.levels) points *= static_cast<double>(values.size());
  const auto whole = [](double value) { return std::to_string(static_cast<long long>(value)); };
  if (points * parameters > kMostGridCells)
    reader.faults().add(reader.pointer("grid"),
                        "expected at most 4000000 combinations of point and parameters; " +
                            whole(points) + " points x " + whole(parameters) + " parameters are " +
                            whole(points * parameters));
  if (spec.stop_entropy_bits.has_value() && *spec.stop_entropy_bits >= std::log2(parameters))
    reader.faults().add(reader.pointer("stop") + "/entropy_bits",
                        "expected less than the entropy before the first trial, " +
                            std::to_string(std::log2(parameters)) + " bit");
}

FieldQuestPlus read_field_quest(ObjectReader& reader, const Dimensions& dimensions) {
  FieldQuestPlus spec;
  const std::size_t before = reader.faults().count();
  const json* const function = reader.member("function", Presence::required);
  if (function != nullptr && !function->is_object()) {
    reader.faults().add(reader.pointer("function"),
                        "expected an object with a form, such as {\"form\": \"weber\"}: the level "
                        "has several dimensions" +
                            found_text(*function));
  } else if (function != nullptr) {
    reader.section("function",
                   [&](ObjectReader& own) { read_function(own, dimensions, spec.function); });
  }
  const bool has_form = function != nullptr && reader.faults().count() == before;
  read_easier(reader, spec.function.easier);
  spec.levels = read_product(reader, dimensions, kMostProductLevels);
  if (!has_form) {  // it determines the other keys
    for (const char* const key :
         {"w", "c", "a", "b", "s", "slope", "guess", "lapse", "interest", "stop"})
      reader.member(key);
    return spec;
  }
  const std::vector<std::string> names = grid_names(spec.function.form);
  for (const std::string& name : names) {
    const bool lapse = name == "lapse";
    spec.parameters.push_back(read_grid(reader, name.c_str(),
                                        {parameter_range(spec.function.form, name), kMostListed,
                                         lapse ? Presence::optional : Presence::required}));
    if (lapse && !reader.has("lapse")) spec.parameters.back().values = {0.02};
  }
  read_interest(reader, names, spec.interest);
  read_quest_stop(reader, spec);
  if (reader.faults().count() != before) return spec;
  check_jnd(reader, spec);
  check_rates(reader, spec);
  check_size(reader, spec);
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

/// The range of each dimension.
std::vector<DimensionRange> read_ranges(ObjectReader& reader, const Dimensions& dimensions) {
  std::vector<DimensionRange> ranges;
  reader.section(
      "ranges",
      [&](ObjectReader& all) {
        for (const LevelDimension& one : dimensions) {
          DimensionRange range{0, 0, one.scale};
          all.section(
              one.name.c_str(),
              [&](ObjectReader& own) {
                own.number("min", range.min, level_range(one.scale), Presence::required);
                own.number("max", range.max, level_range(one.scale), Presence::required);
                if (!(range.min < range.max) && own.has("min") && own.has("max"))
                  own.faults().add(own.pointer("max"), "expected more than min");
              },
              Presence::required);
          ranges.push_back(range);
        }
      },
      Presence::required);
  return ranges;
}

SobolPoints read_sobol(ObjectReader& reader, const Dimensions& dimensions) {
  SobolPoints spec;
  spec.ranges = read_ranges(reader, dimensions);
  reader.integer("trials", spec.trials, kTrials, Presence::required);
  return spec;
}

AskedPoints read_asked_points(ObjectReader& reader, const Dimensions& dimensions) {
  AskedPoints spec;
  spec.own.ranges = read_ranges(reader, dimensions);
  reader.section(
      "stop",
      [&](ObjectReader& stop) {
        stop.integer("trials", spec.own.trials, kTrials, Presence::required);
      },
      Presence::required);
  return spec;
}

enum class ProcedureKind { none, constant, staircase, quest_plus, limits, ask, sobol };

ProcedureSpec read_kind(ObjectReader& reader, ProcedureKind kind, const Dimensions& dimensions) {
  switch (kind) {
    case ProcedureKind::staircase:
      return read_staircase(reader);
    case ProcedureKind::quest_plus:
      if (!dimensions.empty()) return read_field_quest(reader, dimensions);
      return read_quest(reader);
    case ProcedureKind::limits:
      return read_limits(reader);
    case ProcedureKind::ask:
      if (!dimensions.empty()) return read_asked_points(reader, dimensions);
      return read_asked(reader);
    case ProcedureKind::sobol:
      return read_sobol(reader, dimensions);
    default:
      return read_constant(reader, dimensions);
  }
}

}  // namespace

std::optional<ProcedureSpec> read_procedure(ObjectReader& reader, const Dimensions& dimensions) {
  const std::size_t before = reader.faults().count();
  ProcedureKind kind = ProcedureKind::none;
  reader.choice("kind", kind,
                {{"constant", ProcedureKind::constant},
                 {"staircase", ProcedureKind::staircase},
                 {"quest_plus", ProcedureKind::quest_plus},
                 {"limits", ProcedureKind::limits},
                 {"ask", ProcedureKind::ask},
                 {"sobol", ProcedureKind::sobol}},
                Presence::required);
  if (kind == ProcedureKind::none) return std::nullopt;  // other keys depend on it
  const bool one_number = kind == ProcedureKind::staircase || kind == ProcedureKind::limits;
  if (!dimensions.empty() && one_number) {
    reader.faults().add(reader.pointer("kind"),
                        "expected 'constant', 'sobol', 'quest_plus' or 'ask': the level has " +
                            std::to_string(dimensions.size()) + " dimensions");
    return std::nullopt;
  }
  if (dimensions.empty() && kind == ProcedureKind::sobol) {
    reader.faults().add(reader.pointer("kind"),
                        "expected a level with dimensions: 'sobol' fills the space between them");
    return std::nullopt;
  }
  ProcedureSpec spec = read_kind(reader, kind, dimensions);
  reader.refuse_unknown_keys();
  if (reader.faults().count() != before) return std::nullopt;
  return spec;
}

void read_procedures(ObjectReader& block, const Dimensions& dimensions,
                     std::vector<ProcedureSpec>& procedures) {
  const json* const value = block.member("procedure");
  if (value == nullptr) return;
  const std::string pointer = block.pointer("procedure");
  const auto read_one = [&](const json& one, const std::string& where) {
    ObjectReader procedure(one, where, block.faults());
    if (auto spec = read_procedure(procedure, dimensions)) procedures.push_back(std::move(*spec));
  };
  if (!value->is_array()) return read_one(*value, pointer);
  if (block.array("procedure", 1, kMaxTracks) == nullptr) return;
  std::optional<FieldFunction> first;
  for (std::size_t i = 0; i < value->size(); ++i) {
    const std::size_t before = procedures.size();
    read_one((*value)[i], child_pointer(pointer, i));
    const auto* const quest =
        procedures.size() > before ? std::get_if<FieldQuestPlus>(&procedures.back()) : nullptr;
    if (quest == nullptr) continue;
    if (first && !(quest->function == *first))
      block.faults().add(child_pointer(pointer, i) + "/function",
                         "expected the function of the block's first QUEST+: one is fitted to all "
                         "answers");
    if (!first) first = quest->function;
  }
}

}  // namespace palpate::protocols
