#include "protocols/tasks/block_procedures.h"

#include <cstddef>
#include <utility>

#include "protocols/parse_procedure.h"
#include "protocols/procedures/track_seed.h"
#include "protocols/tasks/block_tracks.h"
#include "protocols/tasks/levels.h"
#include "protocols/tasks/parse_blocks.h"

namespace palpate::protocols {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxTracks = 16;

}  // namespace

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
    all.emplace(name, std::move(procedures));
  }
  faults.throw_if_any();
  return all;
}

}  // namespace palpate::protocols
