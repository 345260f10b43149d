#include <algorithm>
#include <cstring>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <string>
#include <utility>

#include "protocols/tasks/levels.h"
#include "rendering/bodies/soft/soft_build.h"
#include "rendering/bodies/soft/soft_object.h"
#include "rendering/bodies/soft/soft_scene.h"
#include "runner/scene_builder.h"
#include "runner/sight_bounds.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/texture.h"

namespace palpate::runner {
namespace {

/// The corners of the box about what is drawn of a stimulus, as it stands.
/// \param builder  which has built it, as a rule
DrawnBounds bounds_as_it_stands(const stimuli::ObjectSpec& object, SceneBuilder& builder) {
  DrawnBounds out;
  out.origin = object.pose.position;
  const double infinite = std::numeric_limits<double>::infinity();
  Vec3 low(infinite), high(-infinite);
  const rendering::Scene scene = builder.build({object}, false);
  const auto add = [&](const Vec3& corner) {
    low = glm::min(low, corner);
    high = glm::max(high, corner);
  };
  for (const rendering::ScenePart& part : scene.parts()) {
    for (const Vec3& corner : part.mesh->vertices()) add(part.position + part.to_world * corner);
  }
  for (const rendering::PlacedSurface& placed : scene.surfaces()) {
    add(placed.sphere_centre - Vec3(placed.sphere_radius));
    add(placed.sphere_centre + Vec3(placed.sphere_radius));
  }
  for (const auto& soft : rendering::soft_objects(scene)) {
    for (const Vec3& node : soft->rest) add(node);
  }
  for (int i = 0; i < 8; ++i)
    out.points.emplace_back((i & 1) != 0 ? high.x : low.x, (i & 2) != 0 ? high.y : low.y,
                            (i & 4) != 0 ? high.z : low.z);
  return out;
}

/// \param reach  m, of the felt stimulus from the origin of the workspace
/// \throws MeshError: what is drawn of it leaves the screen
void require_on_screen(const protocols::Protocol& protocol, const protocols::StimulusSpec& stimulus,
                       double reach, SceneBuilder& builder) {
  if (!protocol.view || !stimulus.seen) return;
  const protocols::SeenSpec& seen = *stimulus.seen;
  if (!seen.object && !seen.picture) return;
  DrawnBounds bounds;
  if (protocol.orientation == protocols::OrientationKind::fixed) {
    bounds = bounds_as_it_stands(seen.shape ? *seen.shape : stimulus.object, builder);
  } else {
    bounds.points = {Vec3(0)};
    bounds.radius = reach;
    if (seen.shape) {
      bounds.radius = 0;
      for (const Vec3& corner : bounds_as_it_stands(*seen.shape, builder).points)
        bounds.radius = std::max(bounds.radius, glm::length(corner));
    }
  }
  const std::string fault = off_screen(*protocol.view, workspace_of(protocol), seen, bounds);
  if (!fault.empty())
    throw stimuli::MeshError({"stimulus '" + stimulus.name + "': /seen/what: " + fault +
                              ": move /view/eye_m or /view/screen_m, or draw it smaller"});
}

}  // namespace

StimulusLibrary::StimulusLibrary(const protocols::Protocol& protocol, SceneBuilder builder)
    : soft_radius_(protocol.tool.radius > 0 ? protocol.tool.radius : protocols::kSoftRadius),
      gravity_(protocol.gravity),
      tool_(tool_of(protocol.tool)),
      grip_(grip_from_virtual_tip(protocol)) {
  for (const protocols::StimulusSpec& stimulus : protocols::with_all_levels(protocol).stimuli) {
    double reach = 0;
    soft_.emplace_back();
    specs_.emplace_back();
    if (stimulus.object.soft) specs_.back() = stimulus.object;
    for (const bool sides : {false, true}) {
      std::vector<rendering::SceneObject> objects;
      try {
        const rendering::Scene scene =
            builder.build({stimulus.object}, sides, {}, gravity_, soft_radius_);
        for (const auto& object : rendering::soft_objects(scene)) {
          soft_.back() = object;
          for (const Vec3& node : object->rest) reach = std::max(reach, glm::length(node));
        }
        for (const rendering::ScenePart& part : scene.parts()) {
          objects.push_back({part.mesh,
                             {part.position, glm::quat_cast(part.to_world)},
                             part.material,
                             0,
                             part.trees,
                             part.layer,
                             part.break_force});
          if (part.layer <= 0)  // layers are inside of the surface
            reach = std::max(reach, glm::length(part.sphere_centre) + part.sphere_radius);
        }
        if (!sides) {
          edges_.emplace_back(scene);
          auto& own = surfaces_.emplace_back();
          for (const rendering::PlacedSurface& placed : scene.surfaces()) {
            own.push_back({placed.surface, {placed.position, glm::quat_cast(placed.to_world)}, 0});
            own.back().layer = placed.layer;
            if (placed.breaking != rendering::PlacedSurface::kHolds)
              own.back().break_force = placed.break_force;
            reach = std::max(reach, glm::length(placed.sphere_centre) + placed.sphere_radius);
          }
        }
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
    effects_.push_back(effects_of({stimulus.object}));
    textures_.push_back(builder.texture_of(stimulus.object));
    moving_.push_back(builder.moving_of({stimulus.object}));
    require_on_screen(protocol, stimulus, reach, builder);
    reaches_.push_back(reach);
    felt_.push_back(stimulus.felt);
  }
}

rendering::Scene StimulusLibrary::empty_scene(protocols::RendererKind renderer) const {
  return rendering::Scene({}, renderer_for(renderer).side_contact(), tool_);
}

rendering::Scene StimulusLibrary::scene(const protocols::Trial& trial) const {
  if (!felt_[static_cast<std::size_t>(trial.stimulus)]) return empty_scene(trial.renderer);
  const bool sides = renderer_for(trial.renderer).side_contact();
  std::vector<rendering::SceneObject> objects =
      (sides ? with_sides_ : without_sides_)[trial.stimulus];
  for (rendering::SceneObject& object : objects)
    object.pose = stimuli::compose({Vec3(0), trial.orientation}, object.pose);
  std::vector<rendering::MovingObject> moving = moving_[trial.stimulus];
  for (rendering::MovingObject& object : moving)
    object.pose = stimuli::compose({Vec3(0), trial.orientation}, object.pose);
  std::vector<rendering::SceneSurface> surfaces = surfaces_[trial.stimulus];
  for (rendering::SceneSurface& surface : surfaces)
    surface.pose = stimuli::compose({Vec3(0), trial.orientation}, surface.pose);
  std::shared_ptr<const rendering::SoftObject> soft = soft_[trial.stimulus];
  std::vector<rendering::ObjectEffects> effects = effects_[trial.stimulus];
  for (rendering::ObjectEffects& object : effects)
    object.pose = stimuli::compose({Vec3(0), trial.orientation}, object.pose);
  const auto with_effects = [&](rendering::Scene scene) {
    scene.set_effects({std::move(effects), grip_});
    return scene;
  };
  if (soft == nullptr)
    return with_effects(rendering::moving_scene(std::move(objects), moving, gravity_, sides, tool_,
                                                true, std::move(surfaces)));
  if (trial.orientation != Quat(1, 0, 0, 0)) {
    const stimuli::ObjectSpec& spec = specs_[trial.stimulus];
    soft = rendering::build_soft_object(spec,
                                        stimuli::compose({Vec3(0), trial.orientation}, spec.pose),
                                        {soft_radius_, gravity_, 0});
  }
  return with_effects(rendering::soft_scene(rendering::Scene({}, sides, tool_), std::move(objects),
                                            {soft}, sides, tool_));
}

}  // namespace palpate::runner
