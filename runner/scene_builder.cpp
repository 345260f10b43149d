#include "runner/scene_builder.h"

#include <algorithm>
#include <charconv>
#include <cstddef>
#include <cstring>
#include <glm/geometric.hpp>
#include <sstream>

#include "stimuli/inset.h"
#include "stimuli/parts/convex_parts.h"

namespace palpate::runner {
namespace {

Pose compose(const Pose& outer, const Pose& inner) {
  return {outer.orientation * inner.position + outer.position,
          outer.orientation * inner.orientation};
}

std::string key_of(double value) {
  char text[32];
  return {text, std::to_chars(text, text + sizeof text, value).ptr};
}

/// Shapes with equal keys have equal meshes.
std::string shape_key(const stimuli::ObjectSpec& spec, bool side_contact) {
  std::string key = std::to_string(static_cast<int>(spec.shape)) + (side_contact ? "s" : "p");
  for (const double value :
       {spec.radius, spec.height, spec.edge, spec.size.x, spec.size.y, spec.size.z})
    key += ' ' + key_of(value);
  return key + ' ' + std::to_string(spec.subdivisions) + ' ' + std::to_string(spec.segments) + ' ' +
         spec.file;
}

/// The same shape with nothing under a surface that is felt.
stimuli::ObjectSpec as_surface(stimuli::ObjectSpec spec) {
  spec.material = {};
  for (stimuli::ObjectSpec& part : spec.parts) part = as_surface(std::move(part));
  return spec;
}

}  // namespace

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
  int object;
  bool side_contact;
  std::vector<rendering::SceneObject>& out;
  struct Layer {
    double depth = 0;      ///< m, the least that was asked for
    bool is_left = false;  ///< of some part
    void add(double asked, bool left) {
      depth = depth > 0 ? std::min(depth, asked) : asked;
      is_left = is_left || left;
    }
  };
  std::vector<Layer> layers = {};
  double deepest = 0;  ///< m, at which the last part with layers is gone

  void check() const {
    std::vector<std::string> faults;
    for (std::size_t i = 0; i < layers.size(); ++i) {
      if (layers[i].is_left) continue;
      std::ostringstream text;
      text << "/layers/" << i << "/depth_m: nothing of the object is left at a depth of "
           << layers[i].depth << " m; expected less than " << deepest << " m";
      faults.push_back(text.str());
    }
    if (!faults.empty()) throw stimuli::MeshError(std::move(faults));
  }
};

const std::vector<SceneBuilder::Prepared>& SceneBuilder::prepare(const stimuli::ObjectSpec& spec,
                                                                 double depth, bool side_contact) {
  const std::string key = shape_key(spec, side_contact) + ' ' + key_of(depth);
  if (const auto known = prepared_.find(key); known != prepared_.end()) return known->second;
  std::vector<Prepared> parts;
  const auto add = [&](std::shared_ptr<const stimuli::ConvexMesh> mesh) {
    if (!mesh) return;
    auto trees = std::make_shared<const rendering::ContactTrees>(*mesh, side_contact);
    parts.push_back({std::move(mesh), std::move(trees)});
  };
  if (depth > 0) {
    for (const Prepared& part : prepare(spec, 0, side_contact))
      add(stimuli::inset(*part.mesh, depth));
  } else {
    for (stimuli::ConvexMesh& part : stimuli::convex_parts(spec))
      add(std::make_shared<const stimuli::ConvexMesh>(std::move(part)));
  }
  return prepared_.emplace(key, std::move(parts)).first->second;
}

void SceneBuilder::place_layers(const stimuli::ObjectSpec& spec, const Pose& pose,
                                Placing& placing) {
  const std::vector<stimuli::Layer>& layers = spec.material.layers;
  if (placing.layers.size() < layers.size()) placing.layers.resize(layers.size());
  for (std::size_t i = 0; i < layers.size(); ++i) {
    const stimuli::Layer& layer = layers[i];
    const std::vector<Prepared>& left = prepare(spec, layer.depth, placing.side_contact);
    placing.layers[i].add(layer.depth, !left.empty());
    for (const Prepared& prepared : left) {
      rendering::SceneObject part{prepared.mesh, pose, {}, placing.object, prepared.trees};
      part.material.stiffness = layer.stiffness;
      part.material.damping = layer.damping;
      part.layer = static_cast<int>(i) + 1;
      if (layer.break_force) part.break_force = *layer.break_force;
      placing.out.push_back(std::move(part));
    }
  }
}

void SceneBuilder::place(const stimuli::ObjectSpec& spec, const Pose& parent, Placing& placing) {
  const Pose pose = compose(parent, spec.pose);
  if (spec.shape == stimuli::ShapeKind::compound) {
    for (const stimuli::ObjectSpec& part : spec.parts) place(part, pose, placing);
    return;
  }
  stimuli::Material surface = spec.material;
  surface.layers.clear();
  for (const Prepared& part : prepare(spec, 0, placing.side_contact)) {
    if (surface.stiffness > 0)
      placing.out.push_back({part.mesh, pose, surface, placing.object, part.trees});
    if (!spec.material.layers.empty())
      placing.deepest =
          std::max(placing.deepest, stimuli::largest_inscribed_ball(*part.mesh).radius);
  }
  place_layers(spec, pose, placing);
}

rendering::Scene SceneBuilder::build(const std::vector<stimuli::ObjectSpec>& objects,
                                     bool side_contact, const rendering::Tool& tool) {
  std::vector<rendering::SceneObject> parts;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    try {
      Placing placing{static_cast<int>(i), side_contact, parts};
      const auto first = static_cast<std::ptrdiff_t>(parts.size());
      place(objects[i], Pose{}, placing);
      placing.check();
      // The parts of a layer stand side by side.
      std::stable_sort(parts.begin() + first, parts.end(),
                       [](const auto& a, const auto& b) { return a.layer < b.layer; });
    } catch (const stimuli::MeshError& error) {
      std::string where = "/objects/" + std::to_string(i);
      if (!objects[i].file.empty()) where += " (" + objects[i].file + ")";
      std::vector<std::string> faults;
      for (const auto& fault : error.faults()) {
        faults.push_back(where + (fault.starts_with('/') ? "" : ": ") + fault);
      }
      throw stimuli::MeshError(std::move(faults));
    }
  }
  return rendering::Scene(std::move(parts), side_contact, tool);
}

StimulusLibrary::StimulusLibrary(const protocols::Protocol& protocol)
    : tool_(tool_of(protocol.tool)) {
  SceneBuilder builder;
  for (const protocols::StimulusSpec& stimulus : protocol.stimuli) {
    double reach = 0;
    for (const bool sides : {false, true}) {
      std::vector<rendering::SceneObject> objects;
      try {
        const rendering::Scene scene = builder.build({stimulus.object}, sides);
        for (const rendering::ScenePart& part : scene.parts()) {
          objects.push_back({part.mesh,
                             {part.position, glm::quat_cast(part.to_world)},
                             part.material,
                             0,
                             part.trees,
                             part.layer,
                             part.break_force});
        }
        if (!sides) edges_.emplace_back(scene);
        // Where it stands: its surface as well where only its layers are felt.
        const rendering::Scene surface = builder.build({as_surface(stimulus.object)}, sides);
        for (const rendering::ScenePart& part : surface.parts())
          reach = std::max(reach, glm::length(part.sphere_centre) + part.sphere_radius);
      } catch (const stimuli::MeshError& error) {
        std::vector<std::string> faults;
        for (std::string fault : error.faults()) {
          if (fault.starts_with("/objects/0/")) fault.erase(0, std::strlen("/objects/0"));
          faults.push_back("stimulus '" + stimulus.name + "': " + fault);
        }
        throw stimuli::MeshError(std::move(faults));
      }
      (sides ? with_sides_ : without_sides_).push_back(std::move(objects));
    }
    reaches_.push_back(reach);
  }
}

rendering::Scene StimulusLibrary::scene(const protocols::Trial& trial) const {
  const bool sides = renderer_for(trial.renderer).side_contact();
  std::vector<rendering::SceneObject> objects =
      (sides ? with_sides_ : without_sides_)[trial.stimulus];
  for (rendering::SceneObject& object : objects)
    object.pose = compose({Vec3(0), trial.orientation}, object.pose);
  return rendering::Scene(std::move(objects), sides, tool_);
}

}  // namespace palpate::runner
