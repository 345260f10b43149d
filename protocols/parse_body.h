#pragma once
// Reading of what makes an object move (scene.schema.json), for scenes and protocols.

#include <optional>

#include "protocols/object_reader.h"
#include "stimuli/shapes.h"

namespace palpate::protocols {

/// The key `body` of an object.
void read_body(ObjectReader& reader, std::optional<stimuli::Body>& body);

/// gravity_m_per_s2.
void read_gravity(ObjectReader& reader, Vec3& gravity);

}  // namespace palpate::protocols
