#include "protocols/tasks/block_procedures.h"

#include <algorithm>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>

#include "protocols/json_document.h"
#include "protocols/object_reader.h"
#include "protocols/tasks/block_tracks.h"
#include "protocols/tasks/levels.h"
#include "protocols/tasks/parse_blocks.h"

namespace palpate::protocols {

namespace {

std::size_t count_of(const nlohmann::json& of, const char* list, std::size_t missing) {
  const auto found = of.is_object() ? of.find(list) : of.end();
  return found != of.end() && found->is_array() ? found->size() : missing;
}

bool has_cells_apart(const nlohmann::json& block) {
  return block.is_object() && block.contains("factors") && block.value("mixing", "") == "blocked";
}

}  // namespace

const ProcedureSpec& BlockProcedures::spec_of(int track) const {
  return specs[static_cast<std::size_t>(track - 1) % specs.size()];
}

Procedure BlockProcedures::begin(int participant_number, int track) const {
  auto own = static_cast<std::size_t>(track - 1);
  std::optional<std::size_t> cell;
  if (tracks_of_cell > 0) {
    cell = own / tracks_of_cell;
    own %= tracks_of_cell;
  }
  const std::uint64_t seed =
      task_stream(protocol_seed, participant_number, stream_of(index, cell), kTaskTracks).next();
  return {spec_of(track), track_seed(seed, own)};
}

std::map<std::string, BlockProcedures> procedures_of_blocks(const std::string& text,
                                                            const std::string& file_name) {
  FaultList faults(file_name);
  const nlohmann::json root = read_json(text, faults);
  std::map<std::string, BlockProcedures> all;
  if (!root.is_object() || !root.contains("blocks") || !root["blocks"].is_array()) return all;
  std::uint64_t seed = 0;
  ObjectReader(root, "", faults).seed("seed", seed);
  for (const nlohmann::json& one : root["blocks"]) {
    ObjectReader block(one, "/blocks/" + std::to_string(all.size()), faults);
    std::string name;
    block.name("name", name);
    BlockProcedures procedures;
    procedures.protocol_seed = seed;
    procedures.index = all.size();
    std::optional<LevelTarget> number;
    if (one.is_object() && one.contains(nlohmann::json::json_pointer("/level/dimensions")))
      read_level(block, number, procedures.dimensions);
    for (const LevelDimension& dimension : procedures.dimensions)
      procedures.dimension_units.push_back(unit_of_level(dimension.target.pointer));
    read_procedures(block, procedures.dimensions, procedures.specs);
    if (has_cells_apart(one))
      procedures.tracks_of_cell = count_of(one, "stimuli", 1) *
                                  count_of(one, "renderers", count_of(root, "renderers", 1)) *
                                  std::max<std::size_t>(1, procedures.specs.size());
    block.boolean("shared", procedures.cells_share_tracks);
    block.choice("asks", procedures.asks_smaller, {{"larger", false}, {"smaller", true}});
    const nlohmann::json::json_pointer path("/level/path");
    if (one.is_object() && one.contains(path) && one[path].is_string())
      procedures.level_unit = unit_of_level(one[path].get<std::string>());
    if (one.is_object() && one.contains("task") && one["task"] == "rate")
      procedures.rating_steps = read_scale_steps(block, "scale", Presence::optional);
    all.emplace(name, std::move(procedures));
  }
  faults.throw_if_any();
  return all;
}

}  // namespace palpate::protocols
