#pragma once
// Reads the additions of protocol version 2: blocks of tasks, and pages.

#include <optional>
#include <vector>

#include "protocols/object_reader.h"
#include "protocols/parse_scene.h"
#include "protocols/procedures/procedure_spec.h"
#include "protocols/protocol.h"

namespace palpate::protocols {

/// Reads {"kind": "staircase", ...}; README.md lists the keys. nullopt if there are faults. Unknown
/// keys become faults. \param dimensions  of the level; empty: it is one number
std::optional<ProcedureSpec> read_procedure(ObjectReader& reader,
                                            const std::vector<LevelDimension>& dimensions = {});

/// Reads `level` of a block: one number, or several. \return whether a procedure can name them
bool read_level(ObjectReader& reader, std::optional<LevelTarget>& number,
                std::vector<LevelDimension>& dimensions);
/// Faults dimensions that the block's task or the protocol's factors do not allow.
void check_dimensions(ObjectReader& reader, const Protocol& protocol, const TaskBlock& block);
/// Faults dimensions of one name with different units in several blocks.
void check_shared_dimensions(const Protocol& protocol, FaultList& faults);

/// Reads a block, which refers to the renderers, stimuli and factors of the protocol.
TaskBlock read_block(ObjectReader& reader, const Protocol& protocol);
/// Reads blocks, which refer to the renderers and stimuli of the protocol, and block_order.
void read_blocks(ObjectReader& reader, Protocol& protocol);
/// Reads `procedure` of a block: one, or a list of them.
void read_procedures(ObjectReader& block, const std::vector<LevelDimension>& dimensions,
                     std::vector<ProcedureSpec>& procedures);
/// Reads the steps of a labelled scale; without a number of its own a step has its place from 1.
std::vector<ScaleStep> read_scale_steps(ObjectReader& reader, const char* key, Presence presence);
/// Reads pages, which refer to the blocks.
/// \param files  source of their pictures
void read_pages(ObjectReader& reader, Protocol& protocol, const MeshFiles& files);
/// Reads sounds and responses: audio and input devices beside screen and keyboard.
void read_periphery(ObjectReader& reader, Protocol& protocol);
/// Faults blocks of reaching in a protocol that cannot have them.
void check_reaching(const Protocol& protocol, FaultList& faults);
/// Adds the channels of clamp trials as stimuli, "channel 1", ..., after all others.
void add_channels(Protocol& protocol);
/// Checks that every stimulus can have every level that a block may show, and that the blocks'
/// trials have an order.
void check_blocks(const Protocol& protocol, FaultList& faults);

}  // namespace palpate::protocols
