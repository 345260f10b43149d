#pragma once
// Reading of what is seen (protocol.v2.schema.json): keys of stimuli, and of the protocol.

#include "protocols/object_reader.h"
#include "protocols/parse_scene.h"
#include "protocols/protocol.h"

namespace palpate::protocols {

/// Reads `seen` and `felt` of a stimulus whose other keys were read.
void read_seen(ObjectReader& reader, const MeshFiles& files, StimulusSpec& stimulus);

/// Reads `view` and `cues`.
void read_view(ObjectReader& reader, Protocol& protocol);

/// Faults stimuli that are seen without a view, or neither seen nor felt, and cues whose blocks
/// cannot be analysed together. Cells of factors were added.
void check_sight(const Protocol& protocol, FaultList& faults);

}  // namespace palpate::protocols
