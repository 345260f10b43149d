#include "runner/touch/scene_notes.h"

#include <algorithm>
#include <cstddef>
#include <cstdio>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <utility>

#include "data/base/text.h"
#include "rendering/bodies/soft/soft_scene.h"
#include "runner/session/effect_check.h"
#include "stimuli/closed_surface.h"
#include "stimuli/mesh_file.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"
#include "stimuli/solids/gmsh_file.h"
#include "stimuli/solids/solid_mesh.h"

namespace palpate::runner::touch {
namespace {

// mm; a hand cannot reach around larger objects, nor feel the shape of smaller ones.
constexpr double kBeyondHands = 1000, kBelowTouch = 0.1;

std::string size_in_mm(const Vec3& size_m) {
  const Vec3 size = 1000.0 * size_m;
  const bool is_large = std::max({size.x, size.y, size.z}) >= 1000;
  char text[100];
  std::snprintf(text, sizeof text, is_large ? "%.0f x %.0f x %.0f mm" : "%.4g x %.4g x %.4g mm",
                size.x, size.y, size.z);
  return text;
}

/// A note on the unit of a size; empty: none.
std::string unit_advice(const Vec3& size_m, const std::string& file_name) {
  const double largest = 1000 * std::max({size_m.x, size_m.y, size_m.z});
  if (largest > kBeyondHands) {
    return stimuli::has_unit(file_name)
               ? "; larger than a metre: check the unit in the file"
               : "; larger than a metre: expected coordinates in metres; for a file in "
                 "millimetres give \"scale\": 0.001 beside \"file\"";
  }
  return largest < kBelowTouch
             ? "; smaller than a tenth of a millimetre: expected coordinates in metres"
             : "";
}

/// Of a .msh file.
std::string solid_note(const stimuli::ObjectSpec& object) {
  const stimuli::SolidMesh solid = stimuli::solid_of_file(object);
  Vec3 low(std::numeric_limits<double>::max()), high = -low;
  for (const Vec3& node : solid.nodes) {
    low = glm::min(low, node);
    high = glm::max(high, node);
  }
  return printable(object.file_name) + ": " + size_in_mm(high - low) + ", " +
         std::to_string(solid.tetrahedra.size()) +
         (solid.tetrahedra.size() == 1 ? " tetrahedron, " : " tetrahedra, ") +
         std::to_string(solid.nodes.size()) + " nodes" + unit_advice(high - low, object.file_name);
}

/// A sentence with its place for each object that falls through others, because soft objects touch
/// only the tool. Without line ends.
std::vector<std::string> objects_passed_through(const protocols::SceneSpec& scene) {
  const auto is_soft = [](const stimuli::ObjectSpec& object) { return object.soft.has_value(); };
  const bool any_soft = std::any_of(scene.objects.begin(), scene.objects.end(), is_soft);
  std::vector<std::string> notes;
  for (std::size_t i = 0; i < scene.objects.size(); ++i) {
    const stimuli::ObjectSpec& object = scene.objects[i];
    const std::string place = "/objects/" + std::to_string(i) + ": ";
    if (object.body && any_soft)
      notes.push_back(place + "moves through soft objects: they touch only the tool");
    const bool falls = object.soft && object.soft->fixed == stimuli::Soft::Fixed::none &&
                       glm::length(scene.gravity) > 0;
    if (falls && scene.objects.size() > 1)
      notes.push_back(place +
                      "is soft, not fixed, and falls through the other objects: soft ones "
                      "touch only the tool");
  }
  return notes;
}

}  // namespace

std::optional<std::string> elements_felt(const rendering::SoftObject& object) {
  const double spacing = object.node_spacing(), radius = object.contact.radius;
  if (spacing <= radius) return std::nullopt;
  char text[240];
  std::snprintf(text, sizeof text,
                "the nodes of its elements are %.1f mm apart and the tool has a radius of %.1f mm: "
                "a sliding tool feels each node; expected a tool/radius_m of the "
                "spacing or more, or smaller elements (soft/resolution, or those of the file)",
                1000 * spacing, 1000 * radius);
  return text;
}

std::vector<std::string> mesh_notes(const stimuli::ObjectSpec& object, SceneBuilder& builder) {
  std::vector<std::string> notes;
  for (const stimuli::ObjectSpec& part : object.parts) {
    for (std::string& note : mesh_notes(part, builder)) notes.push_back(std::move(note));
  }
  if (object.shape != stimuli::ShapeKind::mesh) return notes;
  if (object.soft) return {solid_note(object)};
  const LoadedMesh& mesh = builder.mesh(object);
  std::string note = printable(object.file_name) + ": " + size_in_mm(mesh.size) + ", " +
                     std::to_string(mesh.faces) + " faces" +
                     unit_advice(mesh.size, object.file_name);
  std::vector<std::string> cleaned = mesh.notes;
  if (mesh.surface == nullptr) {
    try {
      cleaned = stimuli::cleaning_notes(stimuli::polygons_of(object));
    } catch (const stimuli::MeshError&) {
      // It is convex anyway, within its coordinates' error.
    }
  }
  for (const std::string& done : cleaned) note += "; " + done;
  notes.push_back(std::move(note));
  return notes;
}

std::vector<std::string> scene_notes(const protocols::SceneSpec& spec,
                                     const rendering::Scene& scene, SceneBuilder& builder) {
  std::vector<std::string> notes = objects_passed_through(spec);
  for (std::size_t i = 0; i < spec.objects.size(); ++i) {
    for (const std::string& note : mesh_notes(spec.objects[i], builder))
      notes.push_back("/objects/" + std::to_string(i) + ": " + note);
    for (const std::string& note : builder.layer_notes(static_cast<int>(i)))
      notes.push_back("/objects/" + std::to_string(i) + note);
    constexpr double kUsualRate = 1000;  // Hz
    const auto texture = builder.texture_of(spec.objects[i]);
    for (const std::string& note :
         session::effect_notes(spec.objects[i], texture.get(), kUsualRate))
      notes.push_back("/objects/" + std::to_string(i) + note);
  }
  for (const auto& object : rendering::soft_objects(scene)) {
    if (const auto felt = elements_felt(*object))
      notes.push_back("/objects/" + std::to_string(object->object) + ": " + *felt);
  }
  return notes;
}

}  // namespace palpate::runner::touch
