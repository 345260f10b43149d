#pragma once
// Reading of what makes an object give (scene.schema.json), for scenes and protocols.

#include "protocols/object_reader.h"
#include "stimuli/shapes.h"

namespace palpate::protocols {

/// The key `soft` of an object whose other keys were read. Faults what cannot be soft.
void read_soft(ObjectReader& reader, stimuli::ObjectSpec& spec);

}  // namespace palpate::protocols
