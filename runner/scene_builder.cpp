#include "runner/scene_builder.h"

#include <algorithm>
#include <charconv>
#include <glm/geometric.hpp>

#include "stimuli/parts/convex_parts.h"

namespace palpate::runner {
namespace {

Pose compose(const Pose& outer, const Pose& inner) {
  return {outer.orientation * inner.position + outer.position,
          outer.orientation * inner.orientation};
}

/// Shapes with equal keys have equal meshes.
std::string shape_key(const stimuli::ObjectSpec& spec, bool side_contact) {
  std::string key = std::to_string(static_cast<int>(spec.shape)) + (side_contact ? "s" : "p");
  for (const double value :
       {spec.radius, spec.height, spec.edge, spec.size.x, spec.size.y, spec.size.z}) {
    char text[32];
    key.append(1, ' ').append(text, std::to_chars(text, text + sizeof text, value).ptr);
  }
  return key + ' ' + std::to_string(spec.subdivisions) + ' ' + std::to_string(spec.segments) + ' ' +
         spec.file;
}

}  // namespace

const rendering::Renderer& renderer_for(protocols::RendererKind kind) {
  return kind == protocols::RendererKind::ray ? rendering::ray_renderer()
                                              : rendering::point_renderer();
}

const std::vector<SceneBuilder::Prepared>& SceneBuilder::prepare(const stimuli::ObjectSpec& spec,
                                                                 bool side_contact) {
  std::vector<Prepared>& prepared = prepared_[shape_key(spec, side_contact)];
  if (!prepared.empty()) return prepared;
  for (stimuli::ConvexMesh& part : stimuli::convex_parts(spec)) {
    auto mesh = std::make_shared<const stimuli::ConvexMesh>(std::move(part));
    auto trees = std::make_shared<const rendering::ContactTrees>(*mesh, side_contact);
    prepared.push_back({std::move(mesh), std::move(trees)});
  }
  return prepared;
}

void SceneBuilder::place(const stimuli::ObjectSpec& spec, const Pose& parent, int object,
                         bool side_contact, std::vector<rendering::SceneObject>& out) {
  const Pose pose = compose(parent, spec.pose);
  if (spec.shape == stimuli::ShapeKind::compound) {
    for (const stimuli::ObjectSpec& part : spec.parts) place(part, pose, object, side_contact, out);
    return;
  }
  for (const Prepared& part : prepare(spec, side_contact))
    out.push_back({part.mesh, pose, spec.material, object, part.trees});
}

rendering::Scene SceneBuilder::build(const std::vector<stimuli::ObjectSpec>& objects,
                                     bool side_contact) {
  std::vector<rendering::SceneObject> parts;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    try {
      place(objects[i], Pose{}, static_cast<int>(i), side_contact, parts);
    } catch (const stimuli::MeshError& error) {
      std::string where = "/objects/" + std::to_string(i);
      if (!objects[i].file.empty()) where += " (" + objects[i].file + ")";
      std::vector<std::string> faults;
      for (const auto& fault : error.faults()) {
        faults.push_back(std::string(where).append(": ").append(fault));
      }
      throw stimuli::MeshError(std::move(faults));
    }
  }
  return rendering::Scene(std::move(parts), side_contact);
}

StimulusLibrary::StimulusLibrary(const protocols::Protocol& protocol) {
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
                             part.trees});
          reach = std::max(reach, glm::length(part.sphere_centre) + part.sphere_radius);
        }
      } catch (const stimuli::MeshError& error) {
        throw stimuli::MeshError({"stimulus '" + stimulus.name + "': " + error.what()});
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
  return rendering::Scene(std::move(objects), sides);
}

}  // namespace palpate::runner
