// Reads the level of a block: one number of its stimuli that varies from trial to trial, or
// several.

#include <algorithm>
#include <cstddef>
#include <glm/geometric.hpp>
#include <set>
#include <string>
#include <utility>

#include "data/base/column_names.h"
#include "data/base/words.h"
#include "protocols/parse_scene.h"
#include "protocols/tasks/levels.h"
#include "protocols/tasks/parse_blocks.h"

namespace palpate::protocols {
namespace {

using nlohmann::json;

constexpr std::size_t kFewestDimensions = 2;
constexpr std::size_t kMostDimensions = 4;

/// nullopt and a fault: no number of a stimulus.
std::optional<LevelTarget> read_target(ObjectReader& reader) {
  LevelTarget target;
  const json* const path = reader.member("path", Presence::required);
  const bool text = path != nullptr && path->is_string();
  target.pointer = text ? path->get<std::string>() : "";
  if (path != nullptr &&
      (target.pointer.size() < 2 || target.pointer.front() != '/' || target.pointer == "/name")) {
    reader.faults().add(reader.pointer("path"),
                        "expected a JSON pointer to a number of the stimulus, such as "
                        "'/stiffness_n_per_m' or '/layers/0/depth_m'" +
                            found_text(*path));
    target.pointer.clear();
  }
  target.orientation = target.pointer == "/orientation";
  if (target.orientation) {
    reader.vector("axis", target.axis, {-1e3, 1e3}, Presence::required);
    if (glm::length(target.axis) > 1e-9) {
      target.axis = glm::normalize(target.axis);
    } else if (reader.has("axis")) {
      reader.faults().add(reader.pointer("axis"), "expected an axis that is not zero");
    }
  }
  if (target.pointer.empty()) return std::nullopt;
  return target;
}

/// \param names  of the dimensions before it
LevelDimension read_dimension(ObjectReader& reader, std::set<std::string>& names) {
  LevelDimension dimension;
  reader.name("name", dimension.name);
  if (!dimension.name.empty() && is_column_name(dimension.name))
    reader.faults().add(reader.pointer("name"), "expected another name: tables have a column '" +
                                                    dimension.name + "' already");
  if (!dimension.name.empty() && !names.insert(lower_case(dimension.name)).second)
    reader.faults().add(reader.pointer("name"), "expected a unique name, found '" + dimension.name +
                                                    "' again; capitals make no difference");
  if (const auto target = read_target(reader)) dimension.target = *target;
  using Of = LevelDimension::Of;
  reader.choice("of", dimension.of,
                {{"comparison", Of::comparison}, {"standard", Of::standard}, {"both", Of::both}});
  reader.choice("scale", dimension.scale,
                {{"linear", LevelScale::linear}, {"log", LevelScale::log10}});
  reader.refuse_unknown_keys();
  return dimension;
}

bool overlap(const LevelDimension& a, const LevelDimension& b) {
  using Of = LevelDimension::Of;
  const bool together = a.of == b.of || a.of == Of::both || b.of == Of::both;
  return together && !a.target.pointer.empty() && a.target.pointer == b.target.pointer;
}

void read_dimensions(ObjectReader& level, std::vector<LevelDimension>& dimensions) {
  const json* const list =
      level.array("dimensions", kFewestDimensions, kMostDimensions, Presence::required);
  if (list == nullptr) return;
  std::set<std::string> names;
  for (std::size_t i = 0; i < list->size(); ++i) {
    ObjectReader one((*list)[i], child_pointer(level.pointer("dimensions"), i), level.faults());
    const LevelDimension dimension = read_dimension(one, names);
    for (const LevelDimension& other : dimensions) {
      if (overlap(dimension, other))
        level.faults().add(one.pointer("path"),
                           "expected another number than that of the dimension '" + other.name +
                               "', which sets it in the same stimulus");
    }
    dimensions.push_back(dimension);
  }
  if (std::ranges::none_of(dimensions, [](const auto& one) { return one.applies_to(false); }))
    level.faults().add(level.pointer("dimensions"),
                       "expected a dimension of the comparison, or of both");
}

}  // namespace

bool read_level(ObjectReader& reader, std::optional<LevelTarget>& number,
                std::vector<LevelDimension>& dimensions) {
  bool named = true;
  reader.section("level", [&](ObjectReader& level) {
    if (!level.has("dimensions")) {
      number = read_target(level);
      return;
    }
    if (level.has("path")) {
      level.member("path");
      level.faults().add(level.pointer("path"), "expected path or dimensions, not both");
    }
    read_dimensions(level, dimensions);
    named = !dimensions.empty() &&
            std::ranges::none_of(dimensions, [](const auto& one) { return one.name.empty(); });
  });
  return named;
}

void check_dimensions(ObjectReader& reader, const Protocol& protocol, const TaskBlock& block) {
  const std::string pointer = reader.pointer("level") + "/dimensions";
  const bool one_number = block.task == TaskKind::adjust || block.task == TaskKind::external;
  if (!block.dimensions.empty() && one_number)
    reader.faults().add(pointer, "expected a path instead: this task varies one number");
  for (std::size_t i = 0; i < block.dimensions.size(); ++i) {
    const LevelDimension& dimension = block.dimensions[i];
    const std::string place = child_pointer(pointer, i);
    if (std::ranges::find(protocol.factors, dimension.name, &Factor::name) !=
        protocol.factors.end())
      reader.faults().add(
          place + "/name",
          "expected another name: tables have a column of the factor '" + dimension.name + "'");
    if (!dimension.applies_to(true)) continue;
    if (!block.standard) {
      reader.faults().add(place + "/of", "expected 'comparison': the block has no standard");
    } else if (block.same_different) {
      reader.faults().add(place + "/of",
                          "expected 'comparison' with the answer 'same_different': in catch trials "
                          "both stimuli are the standard as it is");
    }
  }
}

void check_shared_dimensions(const Protocol& protocol, FaultList& faults) {
  struct Known {
    std::string name, unit, block;
  };
  std::map<std::string, Known> units;  // by name without capitals
  for (std::size_t i = 0; i < protocol.blocks.size(); ++i) {
    const TaskBlock& block = protocol.blocks[i];
    for (std::size_t d = 0; d < block.dimensions.size(); ++d) {
      const LevelDimension& one = block.dimensions[d];
      const std::string unit = unit_of_level(one.target.pointer);
      const Known& known =
          units.emplace(lower_case(one.name), Known{one.name, unit, block.name}).first->second;
      const std::string place =
          "/blocks/" + std::to_string(i) + "/level/dimensions/" + std::to_string(d) + "/name";
      if (known.unit != unit)
        faults.add(place, "expected another name: '" + one.name + "' has the unit " + known.unit +
                              " in block '" + known.block + "', and tables have one column for it");
      else if (known.name != one.name)
        faults.add(place, "expected '" + known.name + "', as in block '" + known.block +
                              "', or another name: capitals make no difference");
    }
  }
}

}  // namespace palpate::protocols
