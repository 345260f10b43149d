#include "protocols/tasks/block_procedures.h"

#include <nlohmann/json.hpp>
#include <utility>

#include "protocols/json_document.h"
#include "protocols/tasks/block_tracks.h"
#include "protocols/tasks/levels.h"
#include "protocols/tasks/parse_blocks.h"

namespace palpate::protocols {

const ProcedureSpec& BlockProcedures::spec_of(int track) const {
  return specs[static_cast<std::size_t>(track - 1) % specs.size()];
}

Procedure BlockProcedures::begin(int participant_number, int track) const {
  const std::uint64_t seed =
      task_stream(protocol_seed, participant_number, index, kTaskTracks).next();
  return {spec_of(track), track_seed(seed, static_cast<std::size_t>(track - 1))};
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
    BlockProcedures procedures{seed, all.size(), {}};
    read_procedures(block, procedures.specs);
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
