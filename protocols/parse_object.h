#pragma once
// Reading of scene objects (scene.schema.json), for scenes and protocols.

#include <string>

#include "protocols/object_reader.h"
#include "protocols/parse.h"
#include "stimuli/shapes.h"

namespace palpate::protocols {

/// Where the mesh files are that a scene or protocol names.
struct MeshFiles {
  std::string folder;       ///< on disk
  StoredFiles stored = {};  ///< contents that were stored with a protocol; these are preferred
  OtherFiles others = OtherFiles::read;
};

/// Reads an object with the keys that its shape takes. The caller refuses unknown keys, since a
/// stimulus has some more of its own.
stimuli::ObjectSpec read_object(ObjectReader& reader, const stimuli::Material& default_material,
                                const MeshFiles& files);

/// Reads stiffness_n_per_m, damping_ns_per_m, friction_static, friction_dynamic and layers.
void read_material(ObjectReader& reader, stimuli::Material& material);

/// The folder that a file's relative paths start from.
std::string folder_of(const std::string& file);

}  // namespace palpate::protocols
