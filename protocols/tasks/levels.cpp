#include "protocols/tasks/levels.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <glm/gtc/quaternion.hpp>
#include <numbers>
#include <string_view>
#include <utility>

#include "data/base/json_text.h"
#include "protocols/json_document.h"
#include "protocols/parse_scene.h"

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

}  // namespace

std::string level_text(double level) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, level).ptr};
}

std::string level_in_words(const TaskBlock& block, double level) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", level);
  const std::string unit = block.level ? unit_of_level(block.level->pointer) : "1";
  return level_text(std::strtod(text, nullptr)) + (unit == "1" ? "" : " " + unit);
}

StimulusSpec at_level(const Protocol& protocol, const TaskBlock& block, int stimulus,
                      double level) {
  const StimulusSpec& plain = protocol.stimuli[static_cast<std::size_t>(stimulus)];
  StimulusSpec varied = plain;
  varied.name += " at " + level_text(level);
  if (block.level->orientation) {
    const double half = level * std::numbers::pi / 360;
    const Quat turn(std::cos(half), std::sin(half) * block.level->axis);
    varied.object.pose.orientation = turn * varied.object.pose.orientation;
    return varied;
  }
  json value = palpate::read_json(protocol.stimulus_texts[static_cast<std::size_t>(stimulus)]);
  try {
    value[json::json_pointer(block.level->pointer)] = number_of(level);
  } catch (const json::exception&) {
    throw InputError({{"stimulus '" + plain.name + "'", block.level->pointer,
                       "expected a number of the stimulus; it has none here", 0}});
  }
  StimulusSpec read = read_again(value, protocol, plain);
  varied.object = std::move(read.object);
  varied.seen = std::move(read.seen);
  varied.sound = std::move(read.sound);
  return varied;
}

std::optional<double> own_level(const Protocol& protocol, const TaskBlock& block, int stimulus) {
  if (!block.level) return std::nullopt;
  if (block.level->orientation) return 0;
  const json value =
      palpate::read_json(protocol.stimulus_texts[static_cast<std::size_t>(stimulus)]);
  try {
    const json& number = value.at(json::json_pointer(block.level->pointer));
    if (number.is_number()) return number.get<double>();
  } catch (const json::exception&) {  // a default
  }
  const stimuli::Material& material =
      protocol.stimuli[static_cast<std::size_t>(stimulus)].object.material;
  if (block.level->pointer == "/stiffness_n_per_m") return material.stiffness;
  if (block.level->pointer == "/damping_ns_per_m") return material.damping;
  if (block.level->pointer == "/friction_static") return material.friction_static;
  if (block.level->pointer == "/friction_dynamic") return material.friction_dynamic;
  return std::nullopt;
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
    for (const int stimulus : block.stimuli) {
      for (const double level : levels_of(block)) {
        StimulusSpec varied = at_level(protocol, block, stimulus, level);
        const auto known = [&](const StimulusSpec& s) { return s.name == varied.name; };
        if (std::any_of(all.stimuli.begin(), all.stimuli.end(), known))
          varied.name += " (" + block.name + ")";
        all.stimuli.push_back(std::move(varied));
      }
    }
  }
  return all;
}

PsychometricParticipant typical_participant(const Protocol& protocol, const TaskBlock& block,
                                            const TypicalSettings& settings) {
  PsychometricParticipant participant;
  participant.function.shape = PsychometricShape::normal;
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
