#pragma once
// Reading of objects (scene.schema.json), for scenes and protocols.

#include <memory>
#include <string>

#include "protocols/object_reader.h"
#include "protocols/parse.h"
#include "protocols/protocol.h"
#include "stimuli/shapes.h"

namespace palpate::protocols {

/// Where to find the mesh files of a scene or protocol.
struct MeshFiles {
  std::string folder;       ///< on disk
  StoredFiles stored = {};  ///< contents that were stored with a protocol; these are preferred
  OtherFiles others = OtherFiles::read;
  /// Whether objects keep the contents, for a record; else building an object reads its file again.
  bool kept = true;
};

/// The file that a key names, beside the protocol or stored with it; null and a fault where there
/// is none. \param what  it is, for messages
std::shared_ptr<const std::string> read_kept_file(ObjectReader& section, const char* key,
                                                  const char* what, const MeshFiles& files);

/// Reads an object with the keys that its shape takes. The caller refuses unknown keys, since a
/// stimulus has further keys.
stimuli::ObjectSpec read_object(ObjectReader& reader, const stimuli::Material& default_material,
                                const MeshFiles& files);

/// Reads a stimulus of a protocol: a name, and an object with a material of its own.
StimulusSpec read_stimulus(ObjectReader& reader, const stimuli::Material& default_material,
                           const MeshFiles& files);

/// Reads stiffness_n_per_m, damping_ns_per_m, friction_static, friction_dynamic and layers.
void read_material(ObjectReader& reader, stimuli::Material& material);

/// The folder that a file's relative paths start from.
std::string folder_of(const std::string& file);

}  // namespace palpate::protocols
