#pragma once
// Reading of what version 2 of a protocol has besides: blocks of tasks, and pages.

#include <optional>

#include "protocols/json_document.h"
#include "protocols/parse_scene.h"
#include "protocols/procedures/procedure_spec.h"
#include "protocols/protocol.h"

namespace palpate::protocols {

/// Reads {"kind": "staircase", ...}; the keys stand in README.md. nullopt where something is at
/// fault. Unknown keys become faults.
std::optional<ProcedureSpec> read_procedure(ObjectReader& reader);

/// Reads blocks, which refer to the renderers and stimuli of the protocol, and block_order.
void read_blocks(ObjectReader& reader, Protocol& protocol);
/// Reads `procedure` of a block: one, or a list of them.
void read_procedures(ObjectReader& block, std::vector<ProcedureSpec>& procedures);
/// Reads pages, which refer to the blocks. \param files  where their pictures are
void read_pages(ObjectReader& reader, Protocol& protocol, const MeshFiles& files);
/// Reads sounds and responses: what is heard and pressed beside screen and keyboard.
void read_periphery(ObjectReader& reader, Protocol& protocol);
/// Every stimulus can have every level that a block may show, and the blocks have an order.
void check_blocks(const Protocol& protocol, FaultList& faults);

}  // namespace palpate::protocols
