#include "protocols/tasks/levels.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <glm/gtc/quaternion.hpp>
#include <numbers>
#include <set>
#include <string_view>
#include <utility>

#include "data/base/json_text.h"
#include "protocols/json_document.h"
#include "protocols/object_reader.h"
#include "protocols/parse_scene.h"
#include "protocols/tasks/block_order.h"

namespace palpate::protocols {
namespace {

using nlohmann::json;

/// Adds the contents of an object's mesh files, by name.
void add_files(const stimuli::ObjectSpec& object, StoredFiles& files) {
  if (object.file_bytes) files.emplace(object.file_name, *object.file_bytes);
  if (object.texture && object.texture->file_bytes)
    files.emplace(object.texture->file_name, *object.texture->file_bytes);
  for (const stimuli::ObjectSpec& part : object.parts) add_files(part, files);
}

void add_files(const StimulusSpec& stimulus, StoredFiles& files) {
  add_files(stimulus.object, files);
  if (stimulus.sound && stimulus.sound->file_bytes)
    files.emplace(stimulus.sound->file_name, *stimulus.sound->file_bytes);
  if (!stimulus.seen) return;
  if (stimulus.seen->file_bytes)
    files.emplace(stimulus.seen->file_name, *stimulus.seen->file_bytes);
  if (stimulus.seen->shape) add_files(*stimulus.seen->shape, files);
}

json number_of(double level) {
  constexpr double kExact = 9007199254740992;
  if (std::floor(level) == level && std::abs(level) < kExact)
    return static_cast<std::int64_t>(level);
  return level;
}

/// The folder does not matter: the contents of a stimulus's files were read with the protocol.
StimulusSpec read_again(const json& value, const Protocol& protocol, const StimulusSpec& before) {
  MeshFiles files{before.object.file.empty() ? "" : folder_of(before.object.file), {}};
  add_files(before, files.stored);
  FaultList faults("stimulus '" + before.name + "'");
  ObjectReader reader(value, "", faults);
  StimulusSpec read = read_stimulus(reader, protocol.material, files);
  faults.throw_if_any();
  return read;
}

/// Endings of names, and the unit that each stands for.
constexpr std::array<std::pair<std::string_view, const char*>, 14> kUnits = {
    {{"_per_m_per_s", "s/m"},
     {"_m_per_s", "m/s"},
     {"_rad_per_s", "rad/s"},
     {"_per_s", "1/s"},
     {"_deg", "deg"},
     {"_hz", "Hz"},
     {"_s", "s"},
     {"_n_per_m", "N/m"},
     {"_ns_per_m", "N s/m"},
     {"_n", "N"},
     {"_kg_per_m3", "kg/m^3"},
     {"_kg", "kg"},
     {"_pa", "Pa"},
     {"_m", "m"}}};

/// Without list indices: /size_m/0.
std::string named_part(std::string path) {
  while (!path.empty() && path.back() >= '0' && path.back() <= '9') path.pop_back();
  if (path.ends_with('/')) path.pop_back();
  return path;
}

double guesses_of(const TaskBlock& block, const TypicalSettings& settings, bool both_sides) {
  if (block.task != TaskKind::compare || block.same_different) return settings.false_alarm;
  return both_sides ? settings.lapse : 1.0 / block.intervals;
}

struct VariedNumber {
  const LevelTarget& target;
  double value;
};

/// \pre `numbers` is not empty
StimulusSpec with_numbers(const Protocol& protocol, int stimulus,
                          const std::vector<VariedNumber>& numbers) {
  const StimulusSpec& plain = protocol.stimuli[static_cast<std::size_t>(stimulus)];
  StimulusSpec varied = plain;
  json value = palpate::read_json(protocol.stimulus_texts[static_cast<std::size_t>(stimulus)]);
  bool read_anew = false;
  for (const auto& [target, number] : numbers) {
    if (target.orientation) continue;
    try {
      value[json::json_pointer(target.pointer)] = number_of(number);
    } catch (const json::exception&) {
      throw InputError({{"stimulus '" + plain.name + "'", target.pointer,
                         "expected a number of the stimulus; it has none here", 0}});
    }
    read_anew = true;
  }
  if (read_anew) {
    StimulusSpec read = read_again(value, protocol, plain);
    varied.object = std::move(read.object);
    varied.seen = std::move(read.seen);
    varied.sound = std::move(read.sound);
  }
  for (const auto& [target, number] : numbers) {
    if (!target.orientation) continue;
    const double half = number * std::numbers::pi / 360;
    const Quat turn(std::cos(half), std::sin(half) * target.axis);
    varied.object.pose.orientation = turn * varied.object.pose.orientation;
  }
  return varied;
}

/// The stimuli of a block's points, each once: of the standard and of what is compared with it.
/// \param visit  called with stimulus, point and whether it is the standard
template <class Visit>
void for_each_stimulus_at_points(const TaskBlock& block, Visit visit) {
  const std::vector<LevelPoint> points = points_of(block);
  for (const bool standard : {false, true}) {
    const std::vector<int> stimuli = varied_stimuli(block, standard);
    std::set<LevelPoint> shown;
    for (const LevelPoint& point : points) {
      LevelPoint own;
      for (std::size_t d = 0; d < point.size(); ++d)
        if (block.dimensions[d].applies_to(standard)) own.push_back(point[d]);
      if (own.empty() || !shown.insert(own).second) continue;
      for (const int stimulus : stimuli) visit(stimulus, point, standard);
    }
  }
}

/// A stimulus's own number at a place; none: it lacks one.
std::optional<double> own_number(const Protocol& protocol, const LevelTarget& target,
                                 int stimulus) {
  if (target.orientation) return 0;
  const json value =
      palpate::read_json(protocol.stimulus_texts[static_cast<std::size_t>(stimulus)]);
  try {
    const json& number = value.at(json::json_pointer(target.pointer));
    if (number.is_number()) return number.get<double>();
  } catch (const json::exception&) {  // a default
  }
  const stimuli::Material& material =
      protocol.stimuli[static_cast<std::size_t>(stimulus)].object.material;
  if (target.pointer == "/stiffness_n_per_m") return material.stiffness;
  if (target.pointer == "/damping_ns_per_m") return material.damping;
  if (target.pointer == "/friction_static") return material.friction_static;
  if (target.pointer == "/friction_dynamic") return material.friction_dynamic;
  return std::nullopt;
}

}  // namespace

std::string level_text(double level) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, level).ptr};
}

std::string number_in_words(const std::string& path, double number) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", number);
  const std::string unit = path.empty() ? "1" : unit_of_level(path);
  return level_text(std::strtod(text, nullptr)) + (unit == "1" ? "" : " " + unit);
}

std::string level_in_words(const TaskBlock& block, double level) {
  return number_in_words(block.level ? block.level->pointer : "", level);
}

StimulusSpec at_level(const Protocol& protocol, const TaskBlock& block, int stimulus,
                      double level) {
  StimulusSpec varied = with_numbers(protocol, stimulus, {{*block.level, level}});
  varied.name += " at " + level_text(level);
  return varied;
}

StimulusSpec at_point(const Protocol& protocol, const TaskBlock& block, int stimulus,
                      const LevelPoint& point, bool standard) {
  std::vector<VariedNumber> numbers;
  std::string name;
  for (std::size_t d = 0; d < point.size(); ++d) {
    const LevelDimension& dimension = block.dimensions[d];
    if (!dimension.applies_to(standard)) continue;
    numbers.push_back({dimension.target, point[d]});
    name += (name.empty() ? " at " : ", ") + dimension.name + " " + level_text(point[d]);
  }
  if (numbers.empty()) return protocol.stimuli[static_cast<std::size_t>(stimulus)];
  StimulusSpec varied = with_numbers(protocol, stimulus, numbers);
  varied.name += name;
  return varied;
}

StimulusSpec shown_stimulus(const Protocol& protocol, const TaskBlock& block,
                            const Interval& interval) {
  if (!interval.point.empty())
    return at_point(protocol, block, interval.stimulus, interval.point, interval.standard);
  if (interval.level && block.level)
    return at_level(protocol, block, interval.stimulus, *interval.level);
  return protocol.stimuli[static_cast<std::size_t>(interval.stimulus)];
}

std::vector<int> varied_stimuli(const TaskBlock& block, bool standard) {
  if (!standard) return block.stimuli;
  if (block.standard_of.empty())
    return block.standard ? std::vector<int>{*block.standard} : std::vector<int>{};
  std::vector<int> stimuli;
  for (const auto& [cell, of_cell] : block.standard_of) {
    if (std::ranges::find(stimuli, of_cell) == stimuli.end()) stimuli.push_back(of_cell);
  }
  return stimuli;
}

std::vector<LevelTarget> targets_of(const TaskBlock& block) {
  std::vector<LevelTarget> targets;
  if (block.level) targets.push_back(*block.level);
  for (const LevelDimension& dimension : block.dimensions) targets.push_back(dimension.target);
  return targets;
}

const LevelDimension& judged_dimension(const TaskBlock& block) {
  const auto first = std::ranges::find_if(
      block.dimensions, [](const LevelDimension& one) { return one.applies_to(false); });
  return first != block.dimensions.end() ? *first : block.dimensions.front();
}

std::optional<double> judged_value(const Protocol& protocol, const TaskBlock& block,
                                   const Interval& interval) {
  if (interval.stimulus < 0) return std::nullopt;
  const LevelTarget& target = judged_dimension(block).target;
  for (std::size_t d = 0; d < interval.point.size(); ++d) {
    const LevelDimension& dimension = block.dimensions[d];
    if (dimension.applies_to(interval.standard) && dimension.target.pointer == target.pointer)
      return interval.point[d];
  }
  return own_number(protocol, target, interval.stimulus);
}

std::string point_text(const TaskBlock& block, const LevelPoint& point) {
  std::string text;
  for (std::size_t d = 0; d < point.size(); ++d)
    text += (d > 0 ? ", " : "") + block.dimensions[d].name + " " + level_text(point[d]);
  return text;
}

std::vector<LevelPoint> points_of(const TaskBlock& block) {
  std::vector<LevelPoint> points;
  if (block.dimensions.empty()) return points;
  for (const ProcedureSpec& procedure : block.procedures) {
    const std::vector<LevelPoint> more = points_to_check(procedure);
    points.insert(points.end(), more.begin(), more.end());
  }
  std::ranges::sort(points);
  points.erase(std::unique(points.begin(), points.end()), points.end());
  return points;
}

std::vector<DimensionRange> ranges_of(const TaskBlock& block) {
  std::vector<DimensionRange> all;
  for (const ProcedureSpec& procedure : block.procedures) {
    const std::vector<DimensionRange> own = ranges_of(procedure);
    if (all.empty()) all = own;
    for (std::size_t d = 0; d < std::min(own.size(), all.size()); ++d) {
      all[d].min = std::min(all[d].min, own[d].min);
      all[d].max = std::max(all[d].max, own[d].max);
    }
  }
  for (std::size_t d = 0; d < std::min(block.dimensions.size(), all.size()); ++d)
    all[d].scale = block.dimensions[d].scale;
  return all;
}

std::optional<double> own_level(const Protocol& protocol, const TaskBlock& block, int stimulus) {
  if (!block.level) return std::nullopt;
  return own_number(protocol, *block.level, stimulus);
}

std::vector<double> levels_of(const TaskBlock& block) {
  if (!block.level) return {};
  std::vector<double> levels = block.starts;
  if (block.task == TaskKind::adjust || block.task == TaskKind::external) {
    levels.push_back(*block.least);
    levels.push_back(*block.most);
  }
  for (const ProcedureSpec& procedure : block.procedures) {
    const std::vector<double> more = levels_to_check(procedure);
    levels.insert(levels.end(), more.begin(), more.end());
  }
  std::sort(levels.begin(), levels.end());
  levels.erase(std::unique(levels.begin(), levels.end()), levels.end());
  return levels;
}

std::string unit_of_level(const std::string& of) {
  const std::string path = named_part(of);
  if (path.ends_with("/orientation")) return "deg";
  for (const auto& [ending, unit] : kUnits) {
    if (path.ends_with(ending)) return unit;
  }
  return "1";
}

std::string level_name(const std::string& of) {
  const std::string path = named_part(of);
  std::string name = path.substr(path.rfind('/') + 1);
  for (const auto& [ending, unit] : kUnits) {
    if (!name.ends_with(ending)) continue;
    name.resize(name.size() - ending.size());
    break;
  }
  std::replace(name.begin(), name.end(), '_', ' ');
  return name;
}

int side_of_levels(const Protocol& protocol, const TaskBlock& block) {
  if (block.task != TaskKind::compare || block.same_different || block.intervals > 2) return 0;
  const std::vector<double> levels = levels_of(block);
  const std::optional<double> standard =
      block.standard ? own_level(protocol, block, *block.standard) : std::nullopt;
  if (levels.empty() || !standard) return 0;
  if (levels.front() >= *standard && levels.back() > *standard) return 1;
  return levels.back() <= *standard && levels.front() < *standard ? -1 : 0;
}

Protocol with_all_levels(const Protocol& protocol) {
  Protocol all = protocol;
  for (const TaskBlock& block : protocol.blocks) {
    const auto add = [&](StimulusSpec varied) {
      const auto known = [&](const StimulusSpec& s) { return s.name == varied.name; };
      if (std::any_of(all.stimuli.begin(), all.stimuli.end(), known))
        varied.name += " (" + block.name + ")";
      all.stimuli.push_back(std::move(varied));
    };
    for (const int stimulus : block.stimuli) {
      for (const double level : levels_of(block)) add(at_level(protocol, block, stimulus, level));
    }
    for_each_stimulus_at_points(block, [&](int stimulus, const LevelPoint& point, bool standard) {
      add(at_point(protocol, block, stimulus, point, standard));
    });
  }
  return all;
}

void check_points(const Protocol& protocol, const TaskBlock& block,
                  const std::function<void(int, const LevelPoint&, bool, const Fault&)>& fault) {
  for_each_stimulus_at_points(block, [&](int stimulus, const LevelPoint& point, bool standard) {
    try {
      at_point(protocol, block, stimulus, point, standard);
    } catch (const InputError& error) {
      fault(stimulus, point, standard, error.faults().front());
    }
  });
}

double typical_success(const Protocol& protocol, const Trial& trial,
                       const TypicalSettings& settings) {
  const TaskBlock& block = block_of(protocol, trial);
  const auto* const quest = std::get_if<FieldQuestPlus>(procedure_of(block, trial));
  const bool compares = block.task == TaskKind::compare && !block.same_different;
  if (quest != nullptr) {
    std::vector<double> middle;
    for (const ParameterGrid& grid : quest->parameters)
      middle.push_back(grid.values[grid.values.size() / 2]);
    return field_success(quest->function, middle, trial.point);
  }
  if (compares && block.intervals == 2 && block.standard) {
    constexpr double kWeber = 0.15;
    std::optional<double> standard, other;
    for (const Interval& interval : trial.intervals)
      (interval.standard ? standard : other) = judged_value(protocol, block, interval);
    if (!standard || !other) return 0.5;
    const double apart = block.asks_smaller ? *standard - *other : *other - *standard;
    const double sd = kWeber * std::max(std::abs(*standard), 1e-12);
    return settings.lapse + (1 - 2 * settings.lapse) *
                                psychometric_share({PsychometricShape::normal}, apart, 1 / sd);
  }
  const std::vector<DimensionRange> ranges = ranges_of(block);
  double share = 0;
  for (std::size_t d = 0; d < ranges.size(); ++d) {
    const double low = scale_position(ranges[d].scale, ranges[d].min);
    const double high = scale_position(ranges[d].scale, ranges[d].max);
    const double place = scale_position(ranges[d].scale, trial.point[d]);
    share += (high > low ? (place - low) / (high - low) : 0.5) / static_cast<double>(ranges.size());
  }
  const double guess = guesses_of(block, settings, false);
  return guess + (1 - guess - settings.lapse) * psychometric_share({PsychometricShape::normal},
                                                                   share - settings.place,
                                                                   1 / settings.spread);
}

PsychometricParticipant typical_participant(const Protocol& protocol, const TaskBlock& block,
                                            const TypicalSettings& settings) {
  PsychometricParticipant participant;
  participant.function.shape = PsychometricShape::normal;
  if (!block.dimensions.empty()) return participant;
  const int side = side_of_levels(protocol, block);
  if (side < 0 || (side == 0 && block.asks_smaller)) participant.function.easier = Easier::lower;
  for (const ProcedureSpec& procedure : block.procedures) {
    const std::optional<Easier> easier = easier_of(procedure);
    if (!easier) continue;
    participant.function.easier = *easier;
    participant.function.scale = scale_of(procedure).value_or(LevelScale::linear);
    break;
  }
  const LevelScale scale = participant.function.scale;
  const std::vector<double> levels = levels_of(block);
  double hard = scale_position(scale, levels.front()), easy = scale_position(scale, levels.back());
  if (participant.function.easier == Easier::lower) std::swap(hard, easy);
  const double range = std::max(std::abs(easy - hard), 1e-12);
  const bool both_sides =
      block.task == TaskKind::compare && !block.same_different && block.intervals == 2 && side == 0;
  double threshold = level_at(scale, hard + settings.place * (easy - hard));
  if (both_sides && block.standard)
    threshold = own_level(protocol, block, *block.standard).value_or(threshold);
  participant.parameters = {threshold, 1 / (settings.spread * range),
                            guesses_of(block, settings, both_sides), settings.lapse};
  return participant;
}

}  // namespace palpate::protocols
