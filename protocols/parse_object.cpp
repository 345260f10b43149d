#include "protocols/parse_object.h"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <optional>
#include <utility>
#include <vector>

#include "protocols/parse_body.h"
#include "protocols/parse_soft.h"
#include "stimuli/mesh_file.h"
#include "stimuli/shapes.h"
#include "stimuli/solids/gmsh_file.h"

namespace palpate::protocols {
namespace {

using nlohmann::json;

// Wide: a wrong unit (30 for 30 mm) is caught by the device's workspace, not here.
constexpr NumberRange kLength{0, 1000, "m", true};
constexpr NumberRange kPosition{-1000, 1000, "m"};
// Ten times stiffer than the stiffest haptic devices: beyond it a decimal point has slipped.
constexpr NumberRange kStiffness{0, 1e5, "N/m"};
constexpr NumberRange kLayerStiffness{0, 1e5, "N/m", true};
constexpr NumberRange kBreakForce{0, 1000, "N", true};
constexpr NumberRange kDamping{0, 1000, "N s/m"};
constexpr NumberRange kFriction{0, 10};
constexpr std::size_t kMaxLayers = 16;
constexpr NumberRange kSubdivisions{0, 8};  // 8: 1.3 million triangles
constexpr NumberRange kSegments{3, 4096};
constexpr int kMaxCompounds = 8;  // within each other
constexpr std::size_t kMaxParts = 1000;

stimuli::ObjectSpec read_nested(ObjectReader& reader, const stimuli::Material& default_material,
                                const MeshFiles& files, int compounds);

void read_file(ObjectReader& reader, const MeshFiles& files, stimuli::ObjectSpec& spec) {
  std::string name;
  reader.text("file", name);
  const json* const value = reader.member("file", Presence::required);
  if (value == nullptr || !value->is_string()) return;
  const std::filesystem::path path = std::filesystem::path(files.folder) / name;
  std::error_code error;
  if (!stimuli::is_mesh_file_name(path.string()) && !stimuli::is_gmsh_file_name(path.string())) {
    reader.faults().add(reader.pointer("file"), std::string("expected a file ") +
                                                    stimuli::kMeshExtensions + found_text(*value));
  } else if (const auto stored = files.stored.find(name); stored != files.stored.end()) {
    spec.file_bytes = std::make_shared<const std::string>(stored->second);
  } else if (files.others == OtherFiles::refuse) {
    reader.faults().add(reader.pointer("file"),
                        "expected a file that is stored with the protocol; '" + name + "' is not");
  } else if (!std::filesystem::is_regular_file(path, error)) {
    reader.faults().add(reader.pointer("file"),
                        "expected an existing file; there is no " + path.string());
  } else {
    try {
      stimuli::MeshFileBytes read = stimuli::mesh_file_bytes(path.string());
      spec.file_bytes = std::make_shared<const std::string>(std::move(read.bytes));
      spec.files_read = std::move(read.files);
    } catch (const stimuli::MeshError& unreadable) {
      reader.faults().add(reader.pointer("file"), unreadable.what());
    }
  }
  spec.file_name = name;
  spec.file = path.string();
}

void read_parts(ObjectReader& reader, const MeshFiles& files, int compounds,
                stimuli::ObjectSpec& spec) {
  const json* const parts = reader.array("parts", 1, kMaxParts, Presence::required);
  if (parts == nullptr) return;
  if (compounds == kMaxCompounds) {
    reader.faults().add(
        reader.pointer("parts"),
        "expected compounds at most " + std::to_string(kMaxCompounds) + " deep within each other");
    return;
  }
  for (std::size_t i = 0; i < parts->size(); ++i) {
    ObjectReader part((*parts)[i], child_pointer(reader.pointer("parts"), i), reader.faults());
    spec.parts.push_back(read_nested(part, spec.material, files, compounds + 1));
    if (part.member("soft") != nullptr)
      part.faults().add(part.pointer("soft"), "expected at an object, not at a part of a compound");
    if (part.member("body") != nullptr)
      part.faults().add(part.pointer("body"), "expected at the object: its parts move as one");
    part.refuse_unknown_keys();
  }
}

stimuli::ObjectSpec read_nested(ObjectReader& reader, const stimuli::Material& default_material,
                                const MeshFiles& files, int compounds) {
  stimuli::ObjectSpec spec;
  spec.material = default_material;
  reader.vector("position_m", spec.pose.position, kPosition);
  reader.quaternion("orientation_wxyz", spec.pose.orientation);
  read_material(reader, spec.material);

  std::optional<stimuli::ShapeKind> shape;
  std::vector<std::pair<const char*, std::optional<stimuli::ShapeKind>>> shapes;
  shapes.reserve(std::size(stimuli::kShapes));
  for (const stimuli::ShapeKind kind : stimuli::kShapes)
    shapes.emplace_back(stimuli::traits_of(kind).name, kind);
  reader.choice<std::optional<stimuli::ShapeKind>>("shape", shape, shapes, Presence::required);
  if (!shape) {
    // Without a shape no key of any shape is called unknown.
    for (const char* key : {"radius_m", "height_m", "edge_m", "size_m", "subdivisions", "segments",
                            "file", "parts"}) {
      reader.member(key);
    }
    return spec;
  }
  spec.shape = *shape;
  const stimuli::ShapeTraits traits = stimuli::traits_of(spec.shape);
  if (traits.radius) reader.number("radius_m", spec.radius, kLength, Presence::required);
  if (traits.height) reader.number("height_m", spec.height, kLength, Presence::required);
  if (traits.edge) reader.number("edge_m", spec.edge, kLength, Presence::required);
  if (traits.size) reader.vector("size_m", spec.size, kLength, Presence::required);
  if (traits.subdivisions) reader.integer("subdivisions", spec.subdivisions, kSubdivisions);
  if (traits.segments) reader.integer("segments", spec.segments, kSegments);
  if (spec.shape == stimuli::ShapeKind::mesh) read_file(reader, files, spec);
  if (spec.shape == stimuli::ShapeKind::compound) {
    read_parts(reader, files, compounds, spec);
  } else if (spec.material.stiffness == 0 && spec.material.layers.empty()) {
    reader.faults().add(reader.pointer("layers"),
                        "expected layers under a surface of stiffness 0: there is nothing to feel");
  }
  return spec;
}

/// A coefficient given alone is used for both; static friction must be at least dynamic friction.
void read_friction(ObjectReader& reader, stimuli::Material& material) {
  reader.number("friction_dynamic", material.friction_dynamic, kFriction);
  if (reader.has("friction_dynamic") && !reader.has("friction_static"))
    material.friction_static = material.friction_dynamic;
  reader.number("friction_static", material.friction_static, kFriction);
  if (reader.has("friction_static") && !reader.has("friction_dynamic"))
    material.friction_dynamic = material.friction_static;
  if (reader.has("friction_static") && reader.has("friction_dynamic") &&
      material.friction_static < material.friction_dynamic) {
    reader.faults().add(
        reader.pointer("friction_static"),
        "expected at least friction_dynamic: static friction is not below dynamic friction");
  }
}

void read_layers(ObjectReader& reader, stimuli::Material& material) {
  const nlohmann::json* const list = reader.array("layers", 0, kMaxLayers);
  if (list == nullptr) return;
  material.layers.clear();
  double above = 0;
  for (std::size_t i = 0; i < list->size(); ++i) {
    ObjectReader layer((*list)[i], child_pointer(reader.pointer("layers"), i), reader.faults());
    stimuli::Layer read;
    layer.number("depth_m", read.depth, kLength, Presence::required);
    layer.number("stiffness_n_per_m", read.stiffness, kLayerStiffness, Presence::required);
    layer.number("damping_ns_per_m", read.damping, kDamping);
    layer.number("break_n", read.break_force, kBreakForce);
    layer.refuse_unknown_keys();
    if (layer.has("depth_m") && read.depth <= above && read.depth > 0) {
      reader.faults().add(layer.pointer("depth_m"), "expected to be deeper than the layer above");
    }
    above = read.depth;
    material.layers.push_back(read);
  }
}

}  // namespace

void read_material(ObjectReader& reader, stimuli::Material& material) {
  reader.number("stiffness_n_per_m", material.stiffness, kStiffness);
  reader.number("damping_ns_per_m", material.damping, kDamping);
  read_friction(reader, material);
  read_layers(reader, material);
}

stimuli::ObjectSpec read_object(ObjectReader& reader, const stimuli::Material& default_material,
                                const MeshFiles& files) {
  stimuli::ObjectSpec spec = read_nested(reader, default_material, files, 0);
  read_body(reader, spec.body);
  read_soft(reader, spec);
  return spec;
}

std::string folder_of(const std::string& file) {
  return std::filesystem::path(file).parent_path().string();
}

}  // namespace palpate::protocols
