#pragma once

#include <string>

#include "protocols/object_reader.h"
#include "stimuli/object_spec.h"

namespace palpate {

/// Reads an object of a scene (contracts, "Scene") from an open reader, with the keys that its
/// shape takes; `folder` is where mesh files are looked for. The caller refuses unknown keys, for a
/// stimulus has some more of its own.
ObjectSpec read_object(ObjectReader& reader, const Material& default_material,
                       const std::string& folder);

/// Reads stiffness_n_per_m and damping_ns_per_m.
void read_material(ObjectReader& reader, Material& material);

/// The folder that a file's relative paths start from.
std::string folder_of(const std::string& file);

}  // namespace palpate
