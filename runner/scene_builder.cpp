#include "runner/scene_builder.h"

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstdio>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/vector_relational.hpp>
#include <limits>
#include <optional>
#include <span>
#include <sstream>
#include <stdexcept>

#include "rendering/bodies/soft/soft_build.h"
#include "rendering/bodies/soft/soft_object.h"
#include "rendering/bodies/soft/soft_scene.h"
#include "rendering/first_contact.h"
#include "runner/touching_solids.h"
#include "stimuli/closed_surface.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/inset.h"
#include "stimuli/parts/convex_parts.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"
#include "stimuli/shapes.h"
#include "stimuli/texture.h"

namespace palpate::runner {
namespace {

// Of a part's reach: poses are written with six decimals or more.
constexpr double kPoseError = 1e-5;

std::string key_of(double value) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

bool same_layer(const stimuli::Layer& a, const stimuli::Layer& b) {
  return a.depth == b.depth && a.stiffness == b.stiffness && a.damping == b.damping &&
         a.break_force == b.break_force;
}

/// The mesh in the frame in which its own has this pose.
std::shared_ptr<const stimuli::ConvexMesh> in_frame(const stimuli::ConvexMesh& mesh,
                                                    const Pose& pose) {
  stimuli::PolygonSoup soup = mesh.polygons();
  for (Vec3& v : soup.vertices) v = pose.orientation * v + pose.position;
  return std::make_shared<const stimuli::ConvexMesh>(soup);
}

/// Shapes with equal keys have equal meshes.
std::string shape_key(const stimuli::ObjectSpec& spec, bool side_contact) {
  std::string key = std::to_string(static_cast<int>(spec.shape)) + (side_contact ? "s" : "p");
  for (const double value :
       {spec.radius, spec.height, spec.edge, spec.size.x, spec.size.y, spec.size.z, spec.scale})
    key += ' ' + key_of(value);
  return key + ' ' + std::to_string(spec.subdivisions) + ' ' + std::to_string(spec.segments) + ' ' +
         spec.file;
}

/// Empty: it is smooth. Equal keys, equal textures.
std::string texture_key(const stimuli::ObjectSpec& spec) {
  if (!spec.texture || spec.texture->depth == 0) return {};
  const stimuli::TextureSpec& t = *spec.texture;
  std::string key = std::to_string(static_cast<int>(t.kind)) + (t.around ? "a" : "d");
  for (const double value : {t.period, t.depth, t.direction.x, t.direction.y, t.direction.z,
                             t.phase, stimuli::ridge_of(t), stimuli::ramp_of(t), t.tip_radius,
                             t.jitter, t.exponent, t.longest.value_or(0), spec.radius})
    key += ' ' + key_of(value);
  return key + ' ' + std::to_string(t.seed) + ' ' + t.file;
}

/// Of a mesh file and its material: of the surface that stands alone.
std::string surface_key(const stimuli::ObjectSpec& spec) {
  std::string key = shape_key(spec, false);
  const stimuli::Material& m = spec.material;
  for (const double value : {m.stiffness, m.damping, m.friction_static, m.friction_dynamic})
    key += ' ' + key_of(value);
  return key + ' ' + texture_key(spec);
}

Pose inverse(const Pose& pose) {
  const Quat back = glm::conjugate(pose.orientation);
  return {-(back * pose.position), back};
}

/// The texture as a mesh sees it that has this pose in the object.
std::shared_ptr<const stimuli::Texture> seen_from(
    const std::shared_ptr<const stimuli::Texture>& texture, const Pose& in_object) {
  if (texture == nullptr) return nullptr;
  return std::make_shared<const stimuli::Texture>(texture->in_frame(in_object));
}

constexpr double kSteepestTexture = 2;  // of its slope

constexpr std::size_t kLargeMesh = 50'000;  // faces; worth another thread

/// Whether object i may collide with others.
bool may_collide(const std::vector<stimuli::ObjectSpec>& objects, std::size_t i) {
  if (objects[i].soft) return false;
  for (std::size_t k = 0; k < objects.size(); ++k) {
    if (k != i && !objects[k].soft && (objects[k].body || objects[i].body)) return true;
  }
  return false;
}

/// m; the size of the box of the corners that faces use.
Vec3 box_of(const stimuli::PolygonSoup& soup) {
  Vec3 low(std::numeric_limits<double>::max()), high = -low;
  for (const auto& face : soup.faces) {
    for (const std::uint32_t v : face) {
      low = glm::min(low, soup.vertices[v]);
      high = glm::max(high, soup.vertices[v]);
    }
  }
  return high - low;
}

std::vector<std::shared_ptr<const stimuli::ConvexMesh>> shared(
    std::vector<stimuli::ConvexMesh> parts) {
  std::vector<std::shared_ptr<const stimuli::ConvexMesh>> out;
  out.reserve(parts.size());
  for (stimuli::ConvexMesh& part : parts)
    out.push_back(std::make_shared<const stimuli::ConvexMesh>(std::move(part)));
  return out;
}

/// Whether rounding made steps or gaps between parts that the law of unions would feel: it has a
/// thinner skin.
bool has_seams(const std::vector<stimuli::SurfaceShell>& shells) {
  constexpr double kFelt = 5e-10;  // of the size
  const stimuli::Surface surface(shells);
  return surface.seam() > kFelt * surface.size();
}

/// Faults of an object, each with its place in the scene.
std::vector<std::string> at_object(const std::vector<stimuli::ObjectSpec>& objects, std::size_t i,
                                   std::vector<std::string> faults) {
  std::string where = "/objects/" + std::to_string(i);
  if (!objects[i].file.empty()) where += " (" + objects[i].file + ")";
  for (std::string& fault : faults) fault.insert(0, where + (fault.starts_with('/') ? "" : ": "));
  return faults;
}

bool has_layers(const stimuli::ObjectSpec& spec) {
  if (spec.shape != stimuli::ShapeKind::compound) return !spec.material.layers.empty();
  return std::any_of(spec.parts.begin(), spec.parts.end(), has_layers);
}

/// Of a layer that is less deep than the error of its depth. One at twice that error is wrong by
/// about half of its depth, if so much of the object is left.
std::string too_thin(int number, const stimuli::Layer& layer, const LayerSurfaces::Made& made) {
  char text[240], expected[80] = "a deeper layer or a thicker object";
  if (2 * made.error < made.deepest)
    std::snprintf(expected, sizeof expected, "at least %.2g m", 2 * made.error);
  std::snprintf(text, sizeof text,
                "/layers/%d/depth_m: where the surface is concave, the depth of this layer, %g m, "
                "would be wrong by up to %.2g m; expected %s",
                number - 1, layer.depth, made.error, expected);
  return text;
}

}  // namespace

std::vector<rendering::ObjectEffects> effects_of(const std::vector<stimuli::ObjectSpec>& objects) {
  std::vector<rendering::ObjectEffects> out;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const stimuli::ObjectSpec& spec = objects[i];
    if (spec.fields.empty() && !spec.transient) continue;
    out.push_back(
        {static_cast<int>(i), spec.pose, spec.body.has_value(), spec.fields, spec.transient});
  }
  return out;
}

rendering::Tool tool_of(const protocols::ToolSpec& spec) {
  rendering::Tool tool;
  for (const protocols::ToolSegmentSpec& segment : spec.segments)
    tool.segments.push_back({segment.from, segment.to});
  return tool;
}

rendering::Reach reach_of(const protocols::ReachSpec& spec, double length, double grip) {
  using Pivot = protocols::ReachSpec::Pivot;
  rendering::Reach reach{.factor = spec.factor, .point = spec.point};
  reach.in_world = spec.pivot == Pivot::point;
  if (spec.pivot == Pivot::tail) reach.fraction = 1;
  if (spec.pivot == Pivot::grip) reach.fraction = length > grip ? grip / length : 1;
  return reach;
}

WorkspaceMap workspace_of(const protocols::Protocol& protocol) {
  WorkspaceMap map{protocol.workspace.centre, protocol.workspace.scale};
  if (protocol.reach)
    map.reach = reach_of(*protocol.reach, protocol.stylus.length, protocol.stylus.grip);
  return map;
}

double grip_from_virtual_tip(const protocols::Protocol& protocol) {
  const WorkspaceMap map = workspace_of(protocol);
  const double grip = protocol.stylus.grip * map.scale;
  if (!map.reach) return grip;
  if (map.reach->in_world) return map.reach->factor * grip;
  return grip + (map.reach->factor - 1) * map.reach->fraction * protocol.stylus.length * map.scale;
}

const rendering::Renderer& renderer_for(protocols::RendererKind kind) {
  return kind == protocols::RendererKind::ray ? rendering::ray_renderer()
                                              : rendering::point_renderer();
}

/// One object on its way into a scene.
struct SceneBuilder::Placing {
  int solid;  ///< as of rendering::SceneObject
  bool side_contact;
  bool has_layers;  ///< anywhere: then its whole surface says where it ends
  bool by_surface;  ///< what is felt of its own surface is one closed surface
  std::vector<rendering::SceneObject>& out;
  std::vector<PlacedShape> objects = {};            ///< in the frame of the solid
  std::vector<LayeredShape> shapes = {};            ///< of those; empty until a layer is a surface
  LayerShells surfaces = {};                        ///< of those layers
  std::vector<PlacedShape> all = {}, layered = {};  ///< its shapes; those that have layers
  std::shared_ptr<const stimuli::Texture> texture = {};  ///< of the object that is placed
  Pose object_pose = {};                                 ///< its own

  void add(int object, int layer, const stimuli::Layer& of, const Prepared& prepared,
           const Pose& pose) {
    rendering::SceneObject part{prepared.mesh, pose, {}, object, prepared.trees};
    part.material.stiffness = of.stiffness;
    part.material.damping = of.damping;
    part.layer = layer;
    part.solid = solid;
    if (of.break_force) part.break_force = *of.break_force;
    out.push_back(std::move(part));
  }
};

std::vector<SceneBuilder::Prepared> SceneBuilder::with_trees(const Meshes& meshes,
                                                             bool side_contact) {
  std::vector<Prepared> parts;
  parts.reserve(meshes.size());
  for (const auto& mesh : meshes)
    parts.push_back({mesh, std::make_shared<const rendering::ContactTrees>(*mesh, side_contact)});
  return parts;
}

SceneBuilder::Meshes SceneBuilder::surface_of(const stimuli::ObjectSpec& spec, bool side_contact) {
  Meshes meshes;
  for (const Prepared& part : prepare(spec, 0, side_contact)) meshes.push_back(part.mesh);
  return meshes;
}

const std::vector<SceneBuilder::Prepared>& SceneBuilder::prepare(const stimuli::ObjectSpec& spec,
                                                                 double depth, bool side_contact) {
  const std::string key = shape_key(spec, side_contact) + ' ' + key_of(depth);
  if (const auto known = prepared_.find(key); known != prepared_.end()) return known->second;
  Meshes meshes;
  if (depth > 0) {
    meshes = stimuli::inset_union(surface_of(spec, side_contact), depth);
  } else {
    if (spec.shape == stimuli::ShapeKind::mesh) meshes = mesh(spec).parts;
    if (meshes.empty()) meshes = shared(stimuli::convex_parts(spec));
  }
  return prepared_.emplace(key, with_trees(meshes, side_contact)).first->second;
}

SceneBuilder::Meshes SceneBuilder::surfaces_of(const std::vector<PlacedShape>& shapes,
                                               bool side_contact) {
  Meshes surface;
  for (const PlacedShape& shape : shapes) {
    for (const auto& mesh : surface_of(*shape.spec, side_contact))
      surface.push_back(in_frame(*mesh, shape.pose));
  }
  return surface;
}

/// The object's surface moved inwards, as far as the shapes go that have the layer: what lies
/// between two shapes is no surface, whatever layers they have.
std::vector<SceneBuilder::Prepared> SceneBuilder::layer_of(const std::vector<PlacedShape>& shapes,
                                                           double depth, const Placing& placing,
                                                           Pose& pose) {
  std::vector<PlacedShape> others = placing.all;
  std::erase_if(others, [&](const PlacedShape& shape) {
    return std::ranges::any_of(shapes, [&](const auto& one) { return one.spec == shape.spec; });
  });
  if (others.empty() && shapes.size() == 1) {
    pose = shapes[0].pose;
    return prepare(*shapes[0].spec, depth, placing.side_contact);
  }
  const Meshes own = surfaces_of(shapes, placing.side_contact);
  Meshes beside;  // what a ball of that radius about a point of the shapes can reach into
  for (const auto& other : surfaces_of(others, placing.side_contact)) {
    const bool near = std::ranges::any_of(own, [&](const auto& mesh) {
      return glm::distance(mesh->centre(), other->centre()) <=
             mesh->radius() + other->radius() + depth;
    });
    if (near) beside.push_back(other);
  }
  if (beside.empty() && shapes.size() == 1) {
    pose = shapes[0].pose;
    return prepare(*shapes[0].spec, depth, placing.side_contact);
  }
  if (beside.empty()) return with_trees(stimuli::inset_union(own, depth), placing.side_contact);
  Meshes whole = own;
  whole.insert(whole.end(), beside.begin(), beside.end());
  return with_trees(stimuli::inset_union_within(whole, depth, own), placing.side_contact);
}

/// \param deepest  m; where nothing is left, in: of other shapes, out: the greater one
/// \return whether something is left
bool SceneBuilder::place_layer_in_parts(int object, const std::vector<PlacedShape>& shapes,
                                        const stimuli::Layer& layer, int number, Placing& placing,
                                        double& deepest) {
  Pose pose;
  const std::vector<Prepared> parts = layer_of(shapes, layer.depth, placing, pose);
  for (const Prepared& part : parts) placing.add(object, number, layer, part, pose);
  if (parts.empty())
    deepest = std::max(deepest, stimuli::largest_inset(surfaces_of(shapes, placing.side_contact)));
  return !parts.empty();
}

/// The same, as a closed surface.
bool SceneBuilder::place_layer_surface(int object, const std::vector<PlacedShape>& shapes,
                                       const stimuli::Layer& layer, int number, Placing& placing,
                                       double& deepest) {
  if (placing.shapes.empty()) {
    for (const PlacedShape& one : placing.objects)
      add_shapes(*one.spec, one.pose, one.object, placing.shapes);
  }
  LayerSurfaces::Wanted wanted{layer, number, {}};
  for (const PlacedShape& shape : shapes) wanted.shapes.push_back(shape.spec);
  const LayerSurfaces::Made* made = nullptr;
  try {
    made = &layer_surfaces_.make(placing.shapes, wanted);
  } catch (const stimuli::MeshError&) {
    throw stimuli::MeshError({"/layers/" + std::to_string(number - 1) +
                              "/depth_m: the layer at this depth has parts that are too thin to "
                              "resolve; expected another depth, by a few percent"});
  }
  deepest = std::max(deepest, made->deepest);
  if (made->surface == nullptr) return false;
  if (made->error > layer.depth) throw stimuli::MeshError({too_thin(number, layer, *made)});
  placing.surfaces.add(wanted, object, made->surface);
  char text[160];
  std::snprintf(
      text, sizeof text,
      "/layers/%d: %zu triangles; where it is round, its depth of %g mm is wrong by up to "
      "%.2g mm",
      number - 1, made->surface->triangles.size(), 1e3 * layer.depth, 1e3 * made->error);
  layer_notes_[object].emplace_back(text);
  return true;
}

void SceneBuilder::place_layers(int object, Placing& placing) {
  std::vector<PlacedShape> layered = placing.layered;
  std::erase_if(layered, [&](const PlacedShape& shape) { return shape.object != object; });
  std::size_t most = 0;
  for (const PlacedShape& shape : layered)
    most = std::max(most, shape.spec->material.layers.size());
  std::vector<std::string> faults;
  for (std::size_t i = 0; i < most; ++i) {
    std::vector<PlacedShape> left = layered;
    std::erase_if(left, [&](const auto& shape) { return shape.spec->material.layers.size() <= i; });
    double least = left.front().spec->material.layers[i].depth, deepest = 0;
    bool is_left = false;
    while (!left.empty()) {
      const stimuli::Layer layer = left.front().spec->material.layers[i];
      const auto others = std::stable_partition(left.begin(), left.end(), [&](const auto& shape) {
        return same_layer(shape.spec->material.layers[i], layer);
      });
      const std::vector<PlacedShape> same(left.begin(), others);
      left.erase(left.begin(), others);
      least = std::min(least, layer.depth);
      const int number = static_cast<int>(i) + 1;
      bool by_surface = placing.by_surface, here = false;
      try {
        if (!by_surface) here = place_layer_in_parts(object, same, layer, number, placing, deepest);
      } catch (const stimuli::MeshError&) {
        by_surface = true;  // where several concave edges meet, parts are not deep enough
      }
      try {
        if (by_surface) here = place_layer_surface(object, same, layer, number, placing, deepest);
      } catch (const stimuli::MeshError& error) {
        faults.insert(faults.end(), error.faults().begin(), error.faults().end());
        here = true;
      }
      is_left |= here;
    }
    if (is_left) continue;
    std::ostringstream text;
    text << "/layers/" << i << "/depth_m: nothing of the object is left at a depth of " << least
         << " m; expected less than " << deepest << " m";
    faults.push_back(text.str());
  }
  if (!faults.empty()) throw stimuli::MeshError(std::move(faults));
}

void SceneBuilder::place(const stimuli::ObjectSpec& spec, const Pose& parent, int object,
                         Placing& placing) {
  const Pose pose = stimuli::compose(parent, spec.pose);
  if (spec.shape == stimuli::ShapeKind::compound) {
    for (const stimuli::ObjectSpec& part : spec.parts) place(part, pose, object, placing);
    return;
  }
  stimuli::Material surface = spec.material;
  surface.layers.clear();
  const bool is_object = pose.position == placing.object_pose.position &&
                         pose.orientation == placing.object_pose.orientation;
  surface.texture =
      is_object ? placing.texture
                : seen_from(placing.texture, stimuli::compose(inverse(placing.object_pose), pose));
  if (!placing.by_surface && (surface.stiffness > 0 || placing.has_layers)) {
    for (const Prepared& part : prepare(spec, 0, placing.side_contact)) {
      rendering::SceneObject placed{part.mesh, pose, surface, object, part.trees};
      placed.solid = placing.solid;
      if (!(surface.stiffness > 0)) {
        placed.layer = rendering::kNotFelt;
        placed.material = {};
        placed.material.stiffness = 0;
      }
      placing.out.push_back(std::move(placed));
    }
  }
  placing.all.push_back({&spec, pose, object});
  if (!spec.material.layers.empty()) placing.layered.push_back({&spec, pose, object});
}

/// Prepares the surface for the law while it is checked, and gives the polygons up on the way.
void SceneBuilder::take_large_surface(const stimuli::ObjectSpec& spec, stimuli::PolygonSoup soup,
                                      LoadedMesh& loaded) {
  std::shared_ptr<const stimuli::Surface> prepared;
  const auto prepare_it = [&](const stimuli::ClosedSurface& unchecked) {
    if (!(spec.material.stiffness > 0) || spec.texture) return;
    stimuli::Material material = spec.material;
    material.layers.clear();
    const std::vector<stimuli::SurfaceShell> shells = {
        {std::shared_ptr<const stimuli::ClosedSurface>(std::shared_ptr<void>(), &unchecked), Pose{},
         std::move(material)}};
    prepared = std::make_shared<const stimuli::Surface>(shells);
  };
  stimuli::CleanedSurface cleaned;
  try {
    cleaned = stimuli::closed_surface(std::move(soup), prepare_it);
  } catch (const stimuli::MeshError&) {
    cleaned = stimuli::closed_surface(stimuli::polygons_of(spec));  // names the faces
  }
  if (prepared != nullptr && cleaned.surface.at_pockets.empty())
    surfaces_.emplace(surface_key(spec), std::move(prepared));
  loaded.surface = std::make_shared<const stimuli::ClosedSurface>(std::move(cleaned.surface));
  loaded.notes = std::move(cleaned.notes);
}

std::shared_ptr<const stimuli::Texture> SceneBuilder::texture_of(const stimuli::ObjectSpec& spec) {
  const std::string key = texture_key(spec);
  if (key.empty()) return nullptr;
  std::shared_ptr<const stimuli::Texture>& known = textures_[key];
  if (known == nullptr) {
    try {
      known = std::make_shared<const stimuli::Texture>(*spec.texture, spec.radius);
    } catch (const std::invalid_argument& error) {
      throw stimuli::MeshError({std::string("/texture: ") + error.what()});
    }
  }
  std::ostringstream fault;
  if (known->greatest_slope() > kSteepestTexture) {
    fault << "/texture/depth_m: expected a slope of at most 2; the steepest is "
          << known->greatest_slope();
  } else {
    std::vector<Vec3> corners;
    add_corners(spec, Pose{}, corners);
    Vec3 low(std::numeric_limits<double>::max()), high = -low;
    for (const Vec3& v : corners) {
      low = glm::min(low, v);
      high = glm::max(high, v);
    }
    const Vec3 size = high - low;
    const double thickness = std::min({size.x, size.y, size.z});
    if (!corners.empty() && spec.texture->depth > thickness)
      fault << "/texture/depth_m: expected at most the thickness of the object, " << thickness
            << " m";
  }
  if (!fault.str().empty()) throw stimuli::MeshError({fault.str()});
  return known;
}

const LoadedMesh& SceneBuilder::mesh(const stimuli::ObjectSpec& spec) {
  const std::string key = shape_key(spec, false);
  if (const auto known = meshes_.find(key); known != meshes_.end()) return known->second;
  stimuli::PolygonSoup soup = stimuli::polygons_of(spec);
  LoadedMesh loaded{box_of(soup), soup.faces.size(), soup.group_names.size() > 1, {}, {}, {}};
  const auto take_surface = [&] {
    stimuli::CleanedSurface cleaned = stimuli::closed_surface(soup);
    loaded.surface = std::make_shared<const stimuli::ClosedSurface>(std::move(cleaned.surface));
    loaded.notes = std::move(cleaned.notes);
  };
  auto parts = stimuli::convex_as_it_is(soup);
  if (!parts && soup.faces.size() >= kLargeMesh) {
    take_large_surface(spec, std::move(soup), loaded);
  } else if (!parts) {
    take_surface();
  } else if (parts->size() == 1) {
    loaded.parts = shared(std::move(*parts));
  } else {
    try {
      take_surface();
    } catch (const stimuli::MeshError&) {
      // Its groups are convex within their coordinates' error, and that is enough.
    }
    if (loaded.surface == nullptr || !has_seams({{loaded.surface, {}, {}, 0}})) {
      loaded.parts = shared(std::move(*parts));
      loaded.surface = nullptr;
      loaded.notes.clear();
    }
  }
  return meshes_.emplace(key, std::move(loaded)).first->second;
}

bool SceneBuilder::is_surface(const stimuli::ObjectSpec& spec) {
  if (spec.soft) return false;
  if (has_concave(spec)) return true;
  if (spec.shape != stimuli::ShapeKind::compound) return false;
  try {
    std::vector<stimuli::SurfaceShell> shells;
    add_shells(spec, Pose{}, false, shells);
    return has_seams(shells);
  } catch (const stimuli::MeshError&) {
    return false;  // convex within its coordinates' error only
  }
}

bool SceneBuilder::has_concave(const stimuli::ObjectSpec& spec) {
  if (spec.shape == stimuli::ShapeKind::mesh) return mesh(spec).surface != nullptr;
  return std::any_of(spec.parts.begin(), spec.parts.end(),
                     [&](const stimuli::ObjectSpec& part) { return has_concave(part); });
}

/// Of a shape that is no compound, in its own frame.
std::shared_ptr<const stimuli::ClosedSurface> SceneBuilder::closed_surface_of(
    const stimuli::ObjectSpec& spec) {
  std::shared_ptr<const stimuli::ClosedSurface> surface;
  if (spec.shape == stimuli::ShapeKind::mesh) surface = mesh(spec).surface;
  if (surface != nullptr) return surface;
  std::shared_ptr<const stimuli::ClosedSurface>& known = convex_[shape_key(spec, false)];
  if (known == nullptr)
    known = std::make_shared<const stimuli::ClosedSurface>(
        stimuli::closed_surface(stimuli::polygons_of(spec)).surface);
  return known;
}

/// The closed shapes of an object.
void SceneBuilder::add_shapes(const stimuli::ObjectSpec& spec, const Pose& in_frame, int object,
                              std::vector<LayeredShape>& shapes) {
  if (spec.shape != stimuli::ShapeKind::compound) {
    shapes.push_back({&spec, closed_surface_of(spec), in_frame, object, shape_key(spec, false)});
    return;
  }
  for (const stimuli::ObjectSpec& part : spec.parts)
    add_shapes(part, stimuli::compose(in_frame, part.pose), object, shapes);
}

std::vector<std::string> SceneBuilder::layer_notes(int object) const {
  const auto known = layer_notes_.find(object);
  return known != layer_notes_.end() ? known->second : std::vector<std::string>{};
}

/// The closed surfaces of an object.
/// \param in_object  the pose of the shape's own frame
/// \param felt  only of what is felt of it
void SceneBuilder::add_shells(const stimuli::ObjectSpec& spec, const Pose& in_object, bool felt,
                              std::vector<stimuli::SurfaceShell>& shells) {
  if (spec.shape == stimuli::ShapeKind::compound) {
    for (const stimuli::ObjectSpec& part : spec.parts)
      add_shells(part, stimuli::compose(in_object, part.pose), felt, shells);
    return;
  }
  if (felt && !(spec.material.stiffness > 0)) return;
  std::shared_ptr<const stimuli::ClosedSurface> surface = closed_surface_of(spec);
  stimuli::Material material = spec.material;
  material.layers.clear();
  double error = 0;
  if (in_object.position != Vec3(0) || in_object.orientation != Quat(1, 0, 0, 0)) {
    for (const Vec3& v : surface->vertices) error = std::max(error, glm::length(v));
    error = kPoseError * (error + glm::length(in_object.position));
  }
  shells.push_back({std::move(surface), in_object, std::move(material), error});
}

std::vector<rendering::MovingObject> SceneBuilder::moving_of(
    const std::vector<stimuli::ObjectSpec>& objects) {
  std::vector<rendering::MovingObject> moving;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const stimuli::ObjectSpec& spec = objects[i];
    if (!spec.body) continue;
    moving.push_back({static_cast<int>(i), *spec.body, spec.pose});
    if (!is_surface(spec)) continue;
    std::vector<stimuli::SurfaceShell> felt, all;
    add_shells(spec, Pose{}, true, felt);
    add_shells(spec, Pose{}, false, all);
    if (felt.size() < all.size())
      moving.back().solid = std::make_shared<const stimuli::Surface>(all);
  }
  return moving;
}

/// Adds the corners of an object's shapes.
void SceneBuilder::add_corners(const stimuli::ObjectSpec& spec, const Pose& parent,
                               std::vector<Vec3>& corners) {
  const Pose pose = stimuli::compose(parent, spec.pose);
  const auto add = [&](std::span<const Vec3> vertices) {
    for (const Vec3& v : vertices) corners.push_back(pose.orientation * v + pose.position);
  };
  for (const stimuli::ObjectSpec& part : spec.parts) add_corners(part, pose, corners);
  if (spec.shape == stimuli::ShapeKind::compound) return;
  if (spec.shape != stimuli::ShapeKind::mesh) return add(stimuli::polygons_of(spec).vertices);
  const LoadedMesh& loaded = mesh(spec);
  if (loaded.surface != nullptr) add(loaded.surface->vertices);
  for (const auto& part : loaded.parts) add(part->vertices());
}

std::vector<std::vector<int>> SceneBuilder::solids_of(
    const std::vector<stimuli::ObjectSpec>& objects) {
  struct Standing {
    Vec3 low{0}, high{0};
    double room = 0;  ///< m; more than the errors of its corners
    std::optional<StandingSurface> surface = {};
  };
  const auto is_fixed = [](const stimuli::ObjectSpec& object) {
    return !object.body && !object.soft && object.shape != stimuli::ShapeKind::none;
  };
  std::vector<std::optional<Standing>> standing_here(objects.size());
  const bool several = std::ranges::count_if(objects, is_fixed) > 1;
  for (std::size_t i = 0; i < objects.size() && several; ++i) {
    if (!is_fixed(objects[i])) continue;
    try {
      std::vector<Vec3> corners;
      add_corners(objects[i], Pose{}, corners);
      if (corners.empty()) continue;
      Standing& here = standing_here[i].emplace();
      here.low = here.high = corners.front();
      for (const Vec3& v : corners) {
        here.low = glm::min(here.low, v);
        here.high = glm::max(here.high, v);
      }
      here.room = 0.01 * glm::length(here.high - here.low) +
                  2 * kPoseError * glm::length(here.high + here.low);
    } catch (const std::exception&) {
      standing_here[i].reset();  // its fault is found where it is placed
    }
  }
  const auto meet = [&](int i, int k) {
    auto &a = standing_here[static_cast<std::size_t>(i)],
         &b = standing_here[static_cast<std::size_t>(k)];
    if (!a || !b) return false;
    const double room = a->room + b->room;
    if (glm::any(glm::greaterThan(a->low, b->high + room)) ||
        glm::any(glm::greaterThan(b->low, a->high + room)))
      return false;
    for (const int one : {i, k}) {
      auto& here = standing_here[static_cast<std::size_t>(one)];
      if (here->surface) continue;
      const stimuli::ObjectSpec& spec = objects[static_cast<std::size_t>(one)];
      std::vector<stimuli::SurfaceShell> shells;
      try {
        add_shells(spec, spec.pose, false, shells);
      } catch (const stimuli::MeshError&) {
        here.reset();  // convex within its coordinates' error only
        return false;
      }
      here->surface = standing(shells);
    }
    return touch(*a->surface, *b->surface);
  };
  return connected(static_cast<int>(objects.size()), meet);
}

/// Places convex parts, of surfaces and layers without concave edges, and other layers.
void SceneBuilder::place_parts(const std::vector<stimuli::ObjectSpec>& objects,
                               const std::vector<int>& solid, Placing& placing, Placed& out) {
  for (const int object : solid) {
    const auto index = static_cast<std::size_t>(object);
    try {
      if (object == solid.front()) {
        for (const int one : solid) {
          const stimuli::ObjectSpec& spec = objects[static_cast<std::size_t>(one)];
          placing.objects.push_back({&spec, solid.size() == 1 ? Pose{} : spec.pose, one});
          placing.texture = texture_of(spec);
          placing.object_pose = spec.pose;
          place(spec, Pose{}, one, placing);
        }
      }
      layer_notes_.erase(object);
      place_layers(object, placing);
    } catch (const stimuli::MeshError& error) {
      throw stimuli::MeshError(at_object(objects, index, error.faults()));
    }
  }
  // The parts of a layer stand side by side.
  std::stable_sort(out.parts.begin(), out.parts.end(),
                   [](const auto& a, const auto& b) { return a.layer < b.layer; });
}

SceneBuilder::Placed SceneBuilder::placed(const std::vector<stimuli::ObjectSpec>& objects,
                                          const std::vector<int>& solid, bool side_contact) {
  Placed out;
  const bool alone = solid.size() == 1;
  const auto index = static_cast<std::size_t>(solid.front());
  const stimuli::ObjectSpec& first = objects[index];
  // A solid of tetrahedra need not fall into convex parts, and nothing rigid is made of it.
  if (first.soft && first.shape == stimuli::ShapeKind::mesh) return out;
  stimuli::ObjectSpec joined;
  joined.shape = stimuli::ShapeKind::compound;
  for (const int object : solid) joined.parts.push_back(objects[static_cast<std::size_t>(object)]);
  const stimuli::ObjectSpec& whole = alone ? first : joined;
  bool by_surface = false;
  try {
    by_surface = is_surface(whole);
  } catch (const stimuli::MeshError& error) {
    throw stimuli::MeshError(at_object(objects, index, error.faults()));
  }
  Placing placing{alone ? rendering::kAlone : solid.front(), side_contact, has_layers(whole),
                  by_surface, out.parts};
  place_parts(objects, solid, placing, out);
  for (const LayeredShape& shape : placing.shapes) {
    if (by_surface && !(shape.spec->material.stiffness > 0)) placing.surfaces.add_bound(shape);
  }
  const auto add_layers = [&] {
    for (rendering::SceneSurface& layer :
         placing.surfaces.surfaces(alone ? first.pose : Pose{}, solid.front()))
      out.surfaces.push_back(std::move(layer));
  };
  if (!by_surface) {
    add_layers();
    return out;
  }
  rendering::SceneSurface placed{nullptr, alone ? first.pose : Pose{}, solid.front(), {}};
  std::vector<stimuli::SurfaceShell> shells;
  for (const int object : solid) {
    const stimuli::ObjectSpec& spec = objects[static_cast<std::size_t>(object)];
    const std::size_t before = shells.size();
    add_shells(spec, alone ? Pose{} : spec.pose, true, shells);
    if (const auto texture = texture_of(spec); texture != nullptr) {
      for (std::size_t i = before; i < shells.size(); ++i)
        shells[i].material.texture = alone ? texture : seen_from(texture, inverse(spec.pose));
    }
    placed.of_shell.resize(shells.size(), object);
  }
  std::string key;
  if (alone && first.shape == stimuli::ShapeKind::mesh) {
    key = surface_key(first);
    if (const auto known = surfaces_.find(key); known != surfaces_.end())
      placed.surface = known->second;
  }
  if (placed.surface == nullptr && !shells.empty())
    placed.surface = std::make_shared<const stimuli::Surface>(shells);
  if (!key.empty() && placed.surface != nullptr) surfaces_.emplace(key, placed.surface);
  for (const int object : solid) {
    if (!may_collide(objects, static_cast<std::size_t>(object))) continue;
    const stimuli::ObjectSpec& spec = objects[static_cast<std::size_t>(object)];
    std::vector<stimuli::SurfaceShell> own;
    add_shells(spec, Pose{}, false, own);
    const bool is_felt = alone && own.size() == shells.size();
    out.solids.push_back({is_felt ? placed.surface : std::make_shared<const stimuli::Surface>(own),
                          spec.pose,
                          object,
                          {}});
  }
  if (!shells.empty()) out.surfaces.push_back(std::move(placed));
  add_layers();
  return out;
}

rendering::Scene SceneBuilder::build(const std::vector<stimuli::ObjectSpec>& objects,
                                     bool side_contact, const rendering::Tool& tool,
                                     const Vec3& gravity, double soft_radius, double grip) {
  std::vector<rendering::SceneObject> parts, shown;
  std::vector<rendering::SceneSurface> surfaces, solids;
  std::vector<std::shared_ptr<const rendering::SoftObject>> soft;
  std::vector<std::string> faults;
  for (const std::vector<int>& solid : solids_of(objects)) {
    const auto index = static_cast<std::size_t>(solid.front());
    const stimuli::ObjectSpec& first = objects[index];
    if (first.shape == stimuli::ShapeKind::none) continue;
    try {
      const Placed placed_here = placed(objects, solid, side_contact);
      const std::vector<rendering::SceneObject>& own = placed_here.parts;
      shown.insert(shown.end(), own.begin(), own.end());
      if (first.soft) {
        try {
          soft.push_back(rendering::build_soft_object(first, first.pose,
                                                      {soft_radius, gravity, solid.front()}));
        } catch (const stimuli::MeshError& error) {
          throw stimuli::MeshError(at_object(objects, index, error.faults()));
        }
      } else {
        parts.insert(parts.end(), own.begin(), own.end());
        surfaces.insert(surfaces.end(), placed_here.surfaces.begin(), placed_here.surfaces.end());
        solids.insert(solids.end(), placed_here.solids.begin(), placed_here.solids.end());
      }
    } catch (const stimuli::MeshError& error) {
      faults.insert(faults.end(), error.faults().begin(), error.faults().end());
    }
  }
  if (!faults.empty()) throw stimuli::MeshError(std::move(faults));
  try {
    rendering::Scene others =
        rendering::moving_scene(std::move(parts), moving_of(objects), gravity, side_contact, tool,
                                true, std::move(surfaces), std::move(solids));
    if (!soft.empty())
      others = rendering::soft_scene(std::move(others), std::move(shown), std::move(soft),
                                     side_contact, tool);
    others.set_effects({effects_of(objects), grip});
    return others;
  } catch (const std::invalid_argument& error) {
    throw stimuli::MeshError({error.what()});
  }
}

}  // namespace palpate::runner
