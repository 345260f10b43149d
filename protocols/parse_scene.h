#pragma once
// Reading of objects, bodies, grids of numbers and tools, for scenes and protocols.

#include <cstddef>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "protocols/json_document.h"
#include "protocols/parse.h"
#include "protocols/procedures/procedure_spec.h"
#include "protocols/protocol.h"
#include "stimuli/shapes.h"

namespace palpate::protocols {

/// Reads the keys `tool` and `reach` of a scene or protocol.
void read_tool(ObjectReader& reader, ToolSpec& tool);
/// Faults a radius that nothing needs. \param soft whether an object is soft
void check_radius(ObjectReader& reader, const ToolSpec& tool, bool soft);
void read_reach(ObjectReader& reader, std::optional<ReachSpec>& reach);

/// Reading of moving bodies (scene.schema.json), for scenes and protocols.
/// gravity_m_per_s2.
void read_gravity(ObjectReader& reader, Vec3& gravity);

// Lists of numbers, written out or as a range.

struct GridLimits {
  NumberRange range;
  std::size_t most = 1000;
  Presence presence = Presence::optional;
  bool may_repeat = false;  ///< false: each value once
};

/// A number, a list of numbers, {"from": 1, "to": 10, "count": 19, "spacing": "linear" or "log"},
/// or
/// {"values": [...], "weights": [...]}. Empty and a fault otherwise.
ParameterGrid read_grid(ObjectReader& reader, const char* key, const GridLimits& limits);
/// The same without weights.
std::vector<double> read_grid_values(ObjectReader& reader, const char* key,
                                     const GridLimits& limits);

// Reading of scene objects (scene.schema.json), for scenes and protocols.

/// Where to find the mesh files of a scene or protocol.
struct MeshFiles {
  std::string folder;       ///< on disk
  StoredFiles stored = {};  ///< contents that were stored with a protocol; these are preferred
  OtherFiles others = OtherFiles::read;
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
