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

/// Parts of one surface or layer stand side by side; the order in which they come first stays.
void bring_together(std::vector<SceneObject>& objects) {
  const auto key = [](const SceneObject& o) { return std::pair(o.object, o.layer); };
  std::vector<std::pair<int, int>> seen;
  bool apart = false;
  for (const SceneObject& object : objects) {
    const auto found = std::find(seen.begin(), seen.end(), key(object));
    apart |= found != seen.end() && *found != seen.back();
    if (found == seen.end())
      seen.push_back(key(object));
    else if (apart)
      break;
  }
  if (!apart) return;
  std::stable_sort(objects.begin(), objects.end(),
                   [&](const SceneObject& a, const SceneObject& b) { return key(a) < key(b); });
}

/// The margin by which the law sees a part larger.
void add_margin(ScenePart& part) {
  // Above what rounding can do to a plane here, and below 1e-6 of the size, however thin the part.
  constexpr double kOfSize = 1e-12, kRoundings = 64, kMostScale = 1e-6;
  const stimuli::ConvexMesh& mesh = *part.mesh;
  Vec3 sum(0);
  for (const Vec3& vertex : mesh.vertices()) sum += vertex;
  part.inside = sum / static_cast<double>(mesh.vertices().size());
  double thinnest = HUGE_VAL, farthest = 0;
  for (const stimuli::Facet& facet : mesh.facets())
    thinnest = std::min(thinnest, facet.offset - glm::dot(facet.normal, part.inside));
  for (const Vec3& vertex : mesh.vertices())
    farthest = std::max(farthest, glm::length(vertex - part.inside));
  const double wanted = kOfSize * mesh.size() + kRoundings *
                                                    std::numeric_limits<double>::epsilon() *
                                                    (mesh.size() + glm::length(part.sphere_centre));
  const double scale = thinnest > 0 ? std::min(wanted / thinnest, kMostScale) : kMostScale;
  part.shrink = 1 / (1 + scale);
  part.margin = scale * farthest;
}

}  // namespace

Scene::Scene(std::vector<SceneObject> objects, bool side_contact, Tool tool,
             std::shared_ptr<const SceneMotion> motion)
    : tool_(std::move(tool)), motion_(std::move(motion)) {
  if (tool_.segments.size() > Tool::kMostSegments)
    throw std::invalid_argument("a tool has 1 to 16 segments");
  for (const ToolSegment& segment : tool_.segments)
    tool_reach_ = std::max({tool_reach_, glm::length(segment.from), glm::length(segment.to)});
  bring_together(objects);
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
    part.shallow_ridges = side_contact && part.trees->shallow_ridges();
    part.object = object.object;
    part.layer = object.layer;
    part.break_force = object.break_force;
    parts_.push_back(std::move(part));
  }
  group_parts();
  features.unions = std::any_of(groups_.begin(), groups_.end(),
                                [](const PartGroup& group) { return group.by_law; });
  features.several_parts = parts_.size() != 1 || features.unions;
  features_index_ = features.index();
  if (motion_) features_index_ += TickFeatures::kCount;
}

void Scene::group_parts() {
  constexpr double kSkin = 1e-9;  // of the size of the largest part
  std::vector<int> objects;
  for (std::uint32_t i = 0; i < parts_.size(); ++i) {
    const ScenePart& part = parts_[i];
    if (i == 0 || part.object != parts_[i - 1].object || part.layer != parts_[i - 1].layer) {
      const auto known = std::find(objects.begin(), objects.end(), part.object);
      PartGroup group;
      group.first_part = i;
      group.first_pair = i * static_cast<std::uint32_t>(segments());
      group.object = part.object;
      group.object_state = static_cast<std::uint32_t>(known - objects.begin());
      group.felt = part.layer != kNotFelt;
      if (known == objects.end()) objects.push_back(part.object);
      groups_.push_back(group);
    }
    ++groups_.back().part_count;
    parts_[i].group = static_cast<std::uint32_t>(groups_.size() - 1);
  }
  object_states_ = objects.size();
  find_breaking_parts();
  std::vector<std::uint32_t> parts_of_object(object_states_);
  for (const PartGroup& group : groups_) parts_of_object[group.object_state] += group.part_count;
  for (const BreakingParts& parts : breaking_) ++parts_of_object[parts.object_state];
  for (PartGroup& group : groups_) {
    // The walk knows one part that never gives way.
    group.by_law = tool() != nullptr || !group.felt || parts_of_object[group.object_state] > 1;
    if (!group.by_law) continue;
    for (std::uint32_t k = 0; k < group.part_count; ++k) {
      ScenePart& part = parts_[group.first_part + k];
      add_margin(part);
      group.skin = std::max({group.skin, 3 * part.margin, kSkin * part.mesh->size()});
    }
  }
}

void Scene::find_breaking_parts() {
  for (const PartGroup& group : groups_) {
    const std::size_t first = breaking_.size();
    for (std::uint32_t k = 0; k < group.part_count; ++k) {
      ScenePart& part = parts_[group.first_part + k];
      if (!std::isfinite(part.break_force)) continue;
      std::size_t same = first;
      while (same < breaking_.size() && breaking_[same].force != part.break_force) ++same;
      if (same == breaking_.size()) breaking_.push_back({group.object_state, part.break_force});
      part.breaking = static_cast<std::uint32_t>(same);
    }
  }
}

RenderState Scene::initial_state() const {
  RenderState state;
  state.parts.resize(parts_.size());
  state.near_parts.reserve(parts_.size());
  if (!features().several_parts) state.near_parts.push_back(0);  // a single part is always near
  state.contacts.reserve(parts_.size());
  if (motion_) state.motion = OwnedMotion(motion_->initial_state());
  if (features().unions) {
    std::size_t most_pairs = 0, contacts = 0;
    for (const PartGroup& group : groups_) {
      most_pairs = std::max(most_pairs, group.part_count * segments());
      contacts += group.by_law ? kMostPlanes : 1;
    }
    state.unions.pairs.resize(parts_.size() * segments());
    state.unions.groups.resize(groups_.size());
    state.unions.objects.resize(object_states_);
    state.unions.breaking.resize(breaking_.size());
    state.unions.near.reserve(most_pairs);
    state.unions.contacts.reserve(contacts);
    state.unions.rubbed.reserve(contacts);
  }
  return state;
}

void update_near_parts(const Scene& scene, RenderState& state, const LineProbe& probe,
                       const ToolPose& tool, bool sides) {
  if (state.clearance == std::numeric_limits<double>::infinity()) return;
  UnionMemory& memory = state.unions;
  const Tool* const carried = sides ? scene.tool() : nullptr;
  // The tool moves no farther than its tip and what its size makes of the turn of its frame.
  const auto moved = [&](const ToolPose& a, const ToolPose& b) {
    double out = glm::length(a.tip - b.tip);
    if (carried == nullptr) return std::max(out, glm::length(a.tip + a.d - b.tip - b.d));
    double turned2 = 0;
    for (int k = 0; k < 3; ++k) {
      const Vec3 apart = a.frame[k] - b.frame[k];
      turned2 += glm::dot(apart, apart);
    }
    return out + scene.tool_reach() * std::sqrt(turned2);
  };
  const double step = state.has_last ? moved(tool, memory.last) : 0;
  const double slack = memory.reach + step;
  if (state.clearance > 0 && moved(tool, memory.near_pose) + slack < state.clearance) return;
  state.near_parts.clear();
  state.near_parts_pose = probe;
  memory.near_pose = tool;
  state.clearance = std::numeric_limits<double>::infinity();
  const PlacedTool placed = place(carried, sides, tool);
  for (std::uint32_t i = 0; i < scene.parts().size(); ++i) {
    const ScenePart& part = scene.parts()[i];
    double gap = HUGE_VAL;
    for (std::size_t j = 0; j < placed.count; ++j) {
      const Vec3 from = tool.tip + placed.segments[j].from;
      gap = std::min(
          gap, distance_to_segment(part.sphere_centre, {from, from + placed.segments[j].along}));
    }
    gap -= part.sphere_radius;
    const bool in_contact = state.parts[i].feature.kind != ContactFeature::Kind::none;
    if (in_contact || in_reach(part, gap, step + slack)) {
      state.near_parts.push_back(i);
    } else {
      state.clearance = std::min(state.clearance, gap);
    }
  }
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
