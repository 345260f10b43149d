#pragma once
// Crossed factors within participants: what their levels set, and the stimuli of every cell. Keys:
// protocol.v2.schema.json.

#include <cstddef>
#include <nlohmann/json_fwd.hpp>

#include "protocols/object_reader.h"
#include "protocols/parse_scene.h"
#include "protocols/protocol.h"

namespace palpate::protocols {

/// Reads the protocol's `factors`.
void read_factors(ObjectReader& reader, Protocol& protocol);

/// Reads `factors` and `mixing` of a block: which levels it crosses, and how it mixes the cells.
void read_crossing(ObjectReader& reader, const Protocol& protocol, TaskBlock& block);

/// Puts the stimuli of every cell in place of those of the blocks that cross factors, and splits
/// blocks whose cells stand apart. Faults are placed at what a level sets.
/// \param root  the protocol's JSON, without faults so far
void add_cells(const nlohmann::json& root, const MeshFiles& files, Protocol& protocol,
               FaultList& faults);

/// How many cells a block crosses; 1: no factors.
std::size_t cells_of(const TaskBlock& block);

}  // namespace palpate::protocols
