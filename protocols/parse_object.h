#pragma once

#include <string>

#include "protocols/object_reader.h"
#include "protocols/parse.h"
#include "stimuli/object_spec.h"

namespace palpate::protocols {

/// Where the files are that a scene or protocol names.
struct MeshFiles {
  std::string folder;     ///< on the disk
  StoredFiles kept = {};  ///< that need not be there any more
};

/// Reads an object of a scene (scene.schema.json) from an open reader, with the keys that its
/// shape takes. The caller refuses unknown keys, for a
/// stimulus has some more of its own.
stimuli::ObjectSpec read_object(ObjectReader& reader, const stimuli::Material& default_material,
                                const MeshFiles& files);

/// Reads stiffness_n_per_m and damping_ns_per_m.
void read_material(ObjectReader& reader, stimuli::Material& material);

/// The folder that a file's relative paths start from.
std::string folder_of(const std::string& file);

}  // namespace palpate::protocols
