#pragma once
// Reading of what is heard of a stimulus (protocol.v2.schema.json).

#include "protocols/object_reader.h"
#include "protocols/parse_scene.h"
#include "protocols/protocol.h"

namespace palpate::protocols {

/// Reads `sound` of a stimulus.
void read_sound(ObjectReader& reader, const MeshFiles& files, StimulusSpec& stimulus);

}  // namespace palpate::protocols
