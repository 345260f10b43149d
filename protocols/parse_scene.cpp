#include "protocols/parse_scene.h"

#include <algorithm>
#include <filesystem>
#include <glm/geometric.hpp>
#include <iterator>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "data/base/input_file.h"
#include "data/base/text.h"
#include "protocols/json_document.h"
#include "protocols/object_reader.h"
#include "protocols/parse.h"
#include "protocols/parse_effects.h"
#include "protocols/parse_sight.h"
#include "protocols/parse_sound.h"
#include "protocols/parse_tool.h"
#include "stimuli/mesh_file.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/shapes.h"
#include "stimuli/solids/gmsh_file.h"
#include "stimuli/solids/solid_mesh.h"

namespace palpate::protocols {

namespace {

using nlohmann::json;

constexpr NumberRange kMass{1e-6, 1e4, "kg"};
constexpr NumberRange kDensity{0.01, 1e5, "kg/m^3"};
// Ten times as fast as a hand: beyond it a unit was mistaken.
constexpr NumberRange kVelocity{-100, 100, "m/s"};
constexpr NumberRange kSpin{-1000, 1000, "rad/s"};
constexpr NumberRange kBodyDamping{0, 1000, "1/s"};
constexpr NumberRange kRestitution{0, 1};
constexpr NumberRange kBodyFriction{0, 10};

// The range in which coupling of body steps and servo was found stable (rendering/README.md).
constexpr NumberRange kYoung{1e3, 1e7, "Pa"};
constexpr NumberRange kSpring{200, 3000, "N/m, on a soft object"};
constexpr NumberRange kPoisson{0, 0.495};
constexpr NumberRange kSoftDensity{100, 20000, "kg/m^3"};
constexpr NumberRange kStrainDamping{0, 1, "s"};
constexpr NumberRange kResolution{stimuli::kLeastResolution, stimuli::kMostResolution};
constexpr NumberRange kPoint{-1000, 1000, "m"};
constexpr std::size_t kMostPoints = 1000;

bool can_be_soft(const stimuli::ObjectSpec& spec) {
  switch (spec.shape) {
    case stimuli::ShapeKind::cube:
    case stimuli::ShapeKind::box:
    case stimuli::ShapeKind::sphere:
    case stimuli::ShapeKind::cylinder:
      return true;
    case stimuli::ShapeKind::mesh:
      return stimuli::is_gmsh_file_name(spec.file);
    case stimuli::ShapeKind::cone:
    case stimuli::ShapeKind::none:
    case stimuli::ShapeKind::compound:
      return false;
  }
  return false;
}

void read_fixed(ObjectReader& reader, stimuli::Soft& soft) {
  const nlohmann::json* const value = reader.member("fixed");
  if (value == nullptr) return;
  if (!value->is_array()) {
    read_choice(*value, reader.pointer("fixed"), soft.fixed,
                {{"base", stimuli::Soft::Fixed::base}, {"none", stimuli::Soft::Fixed::none}},
                reader.faults());
    return;
  }
  soft.fixed = stimuli::Soft::Fixed::points;
  const nlohmann::json* const list = reader.array("fixed", 1, kMostPoints);
  if (list == nullptr) return;
  for (std::size_t i = 0; i < list->size(); ++i) {
    const std::string pointer = child_pointer(reader.pointer("fixed"), i);
    const nlohmann::json& point = (*list)[i];
    Vec3 read(0);
    if (!point.is_array() || point.size() != 3) {
      reader.faults().add(pointer,
                          "expected [x, y, z], m, in the object's frame" + found_text(point));
      continue;
    }
    for (int c = 0; c < 3; ++c) {
      const auto k = static_cast<std::size_t>(c);
      read_number(point[k], child_pointer(pointer, k), read[c], kPoint, reader.faults());
    }
    soft.points.push_back(read);
  }
}

void refuse_with(ObjectReader& reader, bool has, const char* key, const char* why) {
  if (has) reader.faults().add(reader.pointer(key), why);
}

/// Reads the key `soft` of an object whose other keys were read. Faults objects that cannot be
/// soft.
void read_soft(ObjectReader& reader, stimuli::ObjectSpec& spec) {
  const bool is_gmsh =
      spec.shape == stimuli::ShapeKind::mesh && stimuli::is_gmsh_file_name(spec.file);
  if (reader.member("soft") == nullptr) {
    refuse_with(reader, is_gmsh, "file",
                "expected the key 'soft' beside a .msh file: only soft objects use its tetrahedra");
    return;
  }
  stimuli::Soft& soft = spec.soft.emplace();
  reader.section("soft", [&](ObjectReader& section) {
    section.number("young_pa", soft.young, kYoung, Presence::required);
    section.number("poisson", soft.poisson, kPoisson);
    section.number("density_kg_per_m3", soft.density, kSoftDensity);
    section.number("damping_s", soft.damping, kStrainDamping);
    read_fixed(section, soft);
    soft.resolution = 0;  // the highest whose steps are in time
    section.integer("resolution", soft.resolution, kResolution);
    refuse_with(section, is_gmsh && section.has("resolution"), "resolution",
                "expected no resolution: a .msh file has its own elements");
  });
  if (!can_be_soft(spec)) {
    reader.faults().add(
        reader.pointer("soft"),
        "expected a cube, box, sphere, cylinder or a mesh with a .msh file; found " +
            std::string(stimuli::traits_of(spec.shape).name));
  }
  if (!(spec.material.stiffness >= kSpring.min && spec.material.stiffness <= kSpring.max)) {
    reader.faults().add(reader.pointer("stiffness_n_per_m"),
                        "expected 200 to 3000 N/m on a soft object, the spring between tool and "
                        "surface: there its coupling was found stable");
  }
  refuse_with(reader, spec.body.has_value(), "body",
              "expected body or soft, not both: a soft object moves by itself with fixed: none");
  refuse_with(reader, spec.material.has_friction(), "friction_static",
              "expected no friction on a soft object: it is not rendered there");
  refuse_with(reader, spec.material.damping > 0, "damping_ns_per_m",
              "expected no damping on a soft object: set soft/damping_s");
  refuse_with(reader, !spec.material.layers.empty(), "layers",
              "expected no layers on a soft object");
}

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
constexpr NumberRange kScale{0, 1000, "", true};
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
                        "expected an existing file; " + (std::filesystem::is_directory(path, error)
                                                             ? path.string() + " is a folder"
                                                             : "there is no " + path.string()));
  } else {
    try {
      stimuli::MeshFileBytes read = stimuli::mesh_file_bytes(path.string());
      if (files.kept) spec.file_bytes = std::make_shared<const std::string>(std::move(read.bytes));
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
    refuse_effects_of_part(part);
    if (spec.parts.back().shape == stimuli::ShapeKind::none)
      part.faults().add(part.pointer("shape"), "expected a shape: fields alone are an object");
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
                            "file", "scale", "parts"}) {
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
  if (spec.shape == stimuli::ShapeKind::mesh) {
    read_file(reader, files, spec);
    reader.number("scale", spec.scale, kScale);
  }
  if (spec.shape == stimuli::ShapeKind::compound) {
    read_parts(reader, files, compounds, spec);
  } else if (spec.material.stiffness == 0 && spec.material.layers.empty() &&
             spec.shape != stimuli::ShapeKind::none) {
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

/// The key `body` of an object.
void read_body(ObjectReader& reader, std::optional<stimuli::Body>& body) {
  reader.section("body", [&](ObjectReader& section) {
    if (!reader.member("body")->is_object()) return;
    stimuli::Body& read = body.emplace();
    const auto number = [&section](const char* key, std::optional<double>& out,
                                   const NumberRange& range) {
      if (section.member(key) == nullptr) return;  // so that it counts as known
      double value = 1;
      section.number(key, value, range);
      out = value;
    };
    number("mass_kg", read.mass, kMass);
    number("density_kg_per_m3", read.density, kDensity);
    if (section.has("mass_kg") == section.has("density_kg_per_m3")) {
      section.faults().add(section.pointer(),
                           section.has("mass_kg")
                               ? "expected mass_kg or density_kg_per_m3, not both"
                               : "expected mass_kg or density_kg_per_m3");
    }
    section.vector("velocity_m_per_s", read.velocity, kVelocity);
    section.vector("spin_rad_per_s", read.spin, kSpin);
    section.number("damping_per_s", read.damping, kBodyDamping);
    section.number("restitution", read.restitution, kRestitution);
    section.number("friction", read.friction, kBodyFriction);
  });
}

}  // namespace

void read_material(ObjectReader& reader, stimuli::Material& material) {
  reader.number("stiffness_n_per_m", material.stiffness, kStiffness);
  reader.number("damping_ns_per_m", material.damping, kDamping);
  read_friction(reader, material);
  read_layers(reader, material);
}

std::shared_ptr<const std::string> read_kept_file(ObjectReader& section, const char* key,
                                                  const char* what, const MeshFiles& files) {
  const json* const value = section.member(key);
  if (value == nullptr || !value->is_string()) return nullptr;
  const auto name = value->get<std::string>();
  if (const auto stored = files.stored.find(name); stored != files.stored.end())
    return std::make_shared<const std::string>(stored->second);
  if (files.others == OtherFiles::refuse) {
    section.faults().add(section.pointer(key),
                         "expected a file that is stored with the protocol; '" + name + "' is not");
    return nullptr;
  }
  const std::filesystem::path path = std::filesystem::path(files.folder) / name;
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error)) {
    section.faults().add(section.pointer(key), std::string("expected an existing ") + what +
                                                   "; there is no " + path.string());
    return nullptr;
  }
  constexpr std::size_t kMostBytes = std::size_t{16} << 20U;
  try {
    return std::make_shared<const std::string>(read_whole(path.string(), kMostBytes));
  } catch (const std::runtime_error& unreadable) {
    section.faults().add(section.pointer(key), std::string("expected a ") + what +
                                                   " of at most 16 MiB; " + path.string() + ": " +
                                                   unreadable.what());
    return nullptr;
  }
}

stimuli::ObjectSpec read_object(ObjectReader& reader, const stimuli::Material& default_material,
                                const MeshFiles& files) {
  stimuli::ObjectSpec spec = read_nested(reader, default_material, files, 0);
  read_body(reader, spec.body);
  read_soft(reader, spec);
  read_effects(reader, files, spec);
  return spec;
}

StimulusSpec read_stimulus(ObjectReader& reader, const stimuli::Material& default_material,
                           const MeshFiles& files) {
  StimulusSpec stimulus;
  reader.name("name", stimulus.name);
  stimuli::Material material = default_material;
  reader.section("material", [&](ObjectReader& section) {
    read_material(section, material);
    for (const char* key : {"stiffness_n_per_m", "damping_ns_per_m", "friction_static",
                            "friction_dynamic", "layers"}) {
      if (section.has(key) && reader.has(key)) {
        reader.faults().add(reader.pointer(key), "expected in 'material' or here, found in both");
      }
    }
  });
  stimulus.object = read_object(reader, material, files);
  read_seen(reader, files, stimulus);
  read_sound(reader, files, stimulus);
  reader.refuse_unknown_keys();
  return stimulus;
}

std::string folder_of(const std::string& file) {
  return std::filesystem::path(file).parent_path().string();
}

// Pa, of a .msh file that stands for a scene: soft tissue.
constexpr double kYoungOfFile = 20000;

std::string read_scene_text(const std::string& path) {
  const bool is_solid = stimuli::is_gmsh_file_name(path);
  if (!is_solid && !stimuli::is_mesh_file_name(path)) return read_text_file(path);
  const std::string name = std::filesystem::path(path).filename().string();
  if (!is_plain_utf8(name))
    throw InputError({{path, "(file)", "a name in UTF-8, as scenes are", 0}});
  json object{{"shape", "mesh"}, {"file", name}};
  if (is_solid) object["soft"] = {{"young_pa", kYoungOfFile}};
  return json{{"objects", {object}}}.dump();
}

SceneSpec parse_scene(const std::string& path) {
  return parse_scene_text(read_scene_text(path), path);
}

SceneSpec parse_scene_text(const std::string& text, const std::string& path) {
  constexpr std::size_t kMaxObjects = 1000;
  FaultList faults(path);
  const nlohmann::json root = read_json(text, faults);
  ObjectReader reader(root, "", faults);
  reader.member("$schema");
  MeshFiles files{folder_of(path)};
  files.kept = false;
  SceneSpec scene;
  if (const auto* const list = reader.array("objects", 1, kMaxObjects, Presence::required)) {
    for (std::size_t i = 0; i < list->size(); ++i) {
      ObjectReader object((*list)[i], child_pointer("/objects", i), faults);
      scene.objects.push_back(read_object(object, stimuli::Material{}, files));
      object.refuse_unknown_keys();
    }
  }
  read_tool(reader, scene.tool);
  check_radius(reader, scene.tool,
               std::any_of(scene.objects.begin(), scene.objects.end(),
                           [](const auto& object) { return object.soft.has_value(); }));
  read_reach(reader, scene.reach);
  read_gravity(reader, scene.gravity);
  reader.refuse_unknown_keys();
  faults.throw_if_any();
  return scene;
}

}  // namespace palpate::protocols
