#include "rendering/scene.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <stdexcept>
#include <utility>

namespace palpate::rendering {
namespace {

double distance_to_segment(const Vec3& p, const LineProbe& probe) {
  const Vec3 d = probe.tail - probe.tip;
  const double d2 = glm::dot(d, d);
  const double t = d2 > 0 ? std::clamp(glm::dot(p - probe.tip, d) / d2, 0.0, 1.0) : 0;
  return glm::length(p - (probe.tip + t * d));
}

}  // namespace

Scene::Scene(std::vector<SceneObject> objects, bool side_contact, Tool tool)
    : tool_(std::move(tool)) {
  if (tool_.segments.size() > Tool::kMostSegments)
    throw std::invalid_argument("a tool has 1 to 16 segments");
  TickFeatures features;
  parts_.reserve(objects.size());
  for (auto& object : objects) {
    if (!object.mesh) throw std::invalid_argument("a scene's object has no mesh");
    ScenePart part;
    part.mesh = std::move(object.mesh);
    part.trees = object.trees ? std::move(object.trees)
                              : std::make_shared<const ContactTrees>(*part.mesh, side_contact);
    part.to_world = glm::mat3_cast(object.pose.orientation);
    part.position = object.pose.position;
    part.sphere_centre = part.world_vector(part.mesh->centre()) + part.position;
    part.sphere_radius = part.mesh->radius();
    part.tolerance = 1e-12 * part.mesh->size() +
                     8 * std::numeric_limits<double>::epsilon() * glm::length(part.sphere_centre);
    part.material = object.material;
    features.damping |= part.material.damping != 0;
    features.friction |= part.material.has_friction();
    features.layers |= !part.material.layers.empty();
    part.object = object.object;
    part.layer = object.layer;
    part.break_force = object.break_force;
    parts_.push_back(std::move(part));
  }
  features.several_parts = parts_.size() != 1;
  features_index_ = features.index();
}

RenderState Scene::initial_state() const {
  RenderState state;
  state.parts.resize(parts_.size());
  state.near_parts.reserve(parts_.size());
  if (!features().several_parts) state.near_parts.push_back(0);  // a single part is always near
  state.contacts.reserve(parts_.size());
  return state;
}

void rebuild_near_parts(const Scene& scene, RenderState& state, const LineProbe& probe) {
  // How far the probe moved in this tick: what it may have passed counts as near.
  const double step = state.has_last ? std::max(glm::length(probe.tip - state.last.tip),
                                                glm::length(probe.tail - state.last.tail))
                                     : 0;
  state.near_parts.clear();
  state.near_parts_pose = probe;
  state.clearance = std::numeric_limits<double>::infinity();
  for (std::uint32_t i = 0; i < scene.parts().size(); ++i) {
    const ScenePart& part = scene.parts()[i];
    const double gap = distance_to_segment(part.sphere_centre, probe) - part.sphere_radius;
    // A part in contact stays: pressed through a thin plate, the virtual probe may be far from it.
    const bool in_contact = state.parts[i].feature.kind != ContactFeature::Kind::none;
    if (in_contact || in_reach(part, gap, step)) {
      state.near_parts.push_back(i);
    } else {
      state.clearance = std::min(state.clearance, gap);
    }
  }
}

}  // namespace palpate::rendering
