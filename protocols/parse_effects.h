#pragma once
// Reading of textures, fields and knocks of objects (scene.schema.json), for scenes and protocols.

#include "protocols/object_reader.h"
#include "protocols/parse_scene.h"
#include "stimuli/shapes.h"

namespace palpate::protocols {

/// Reads the keys `texture`, `fields` and `contact_transient` of an object whose other keys were
/// read. Faults objects that cannot have them.
void read_effects(ObjectReader& reader, const MeshFiles& files, stimuli::ObjectSpec& spec);

/// Faults these keys at a part of a compound.
void refuse_effects_of_part(ObjectReader& part);

}  // namespace palpate::protocols
