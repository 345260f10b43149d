#include "rendering/scene.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <stdexcept>
#include <utility>

#include "rendering/first_contact.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/texture.h"

namespace palpate::rendering {
namespace {

/// Makes the parts of one surface or layer contiguous. Keeps the order if they already are.
void bring_together(std::vector<SceneObject>& objects) {
  const auto key = [](const SceneObject& o) { return std::pair(o.own_solid(), o.layer); };
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

/// Sets the margin by which the law enlarges a part.
void add_margin(ScenePart& part) {
  // Above the rounding of a plane here, and below 1e-6 of the size, however thin the part.
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
             std::shared_ptr<const SceneMotion> motion, std::vector<SceneSurface> surfaces)
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
    features.texture |= part.material.texture != nullptr;
    part.shallow_ridges = side_contact && part.trees->shallow_ridges();
    part.object = object.object;
    part.solid = object.own_solid();
    part.layer = object.layer;
    part.break_force = object.break_force;
    parts_.push_back(std::move(part));
  }
  group_parts();
  index_parts();
  add_surfaces(std::move(surfaces), features);
  features.unions = std::any_of(groups_.begin(), groups_.end(),
                                [](const PartGroup& group) { return group.by_law; });
  features.several_parts = parts_.size() != 1 || features.unions;
  features_index_ = features.index();
  is_one_surface_ = parts_.empty() && surfaces_.size() == 1 && tool_.segments.empty();
  if (motion_) features_index_ += TickFeatures::kCount;
}

void Scene::group_parts() {
  std::vector<int> solids;
  for (std::uint32_t i = 0; i < parts_.size(); ++i) {
    const ScenePart& part = parts_[i];
    if (i == 0 || part.solid != parts_[i - 1].solid || part.layer != parts_[i - 1].layer) {
      const auto known = std::find(solids.begin(), solids.end(), part.solid);
      PartGroup group;
      group.first_part = i;
      group.first_pair = i * static_cast<std::uint32_t>(segments());
      group.solid = part.solid;
      group.object_state = static_cast<std::uint32_t>(known - solids.begin());
      group.felt = part.layer != kNotFelt;
      if (known == solids.end()) solids.push_back(part.solid);
      groups_.push_back(group);
    }
    ++groups_.back().part_count;
    parts_[i].group = static_cast<std::uint32_t>(groups_.size() - 1);
  }
  object_states_ = solids.size();
  find_breaking_parts();
  std::vector<std::uint32_t> parts_of_object(object_states_);
  for (const PartGroup& group : groups_) parts_of_object[group.object_state] += group.part_count;
  for (const BreakingParts& parts : breaking_) ++parts_of_object[parts.object_state];
  for (PartGroup& group : groups_) {
    // The walk alone handles one part that never breaks.
    group.by_law = tool() != nullptr || !group.felt || parts_of_object[group.object_state] > 1;
    if (group.by_law) prepare_for_law(group);
  }
}

void Scene::prepare_for_law(PartGroup& group) {
  constexpr double kSkin = 1e-9;  // of the size of the largest part
  for (std::uint32_t k = 0; k < group.part_count; ++k) {
    ScenePart& part = parts_[group.first_part + k];
    add_margin(part);
    group.skin = std::max({group.skin, 3 * part.margin, kSkin * part.mesh->size()});
  }
}

Feel Scene::feel_of(std::uint32_t part) const {
  const stimuli::Material& material = material_of(part);
  return {material.stiffness, material.damping, material.friction_static,
          material.friction_dynamic};
}

void Scene::set_feel(std::uint32_t part, const Feel& feel) noexcept {
  stimuli::Material& material =
      part < parts_.size() ? parts_[part].material : materials_[part - parts_.size()];
  material.stiffness = feel.stiffness;
  material.damping = feel.damping;
  material.friction_static = feel.friction_static;
  material.friction_dynamic = feel.friction_dynamic;
  TickFeatures features = TickFeatures::of(features_index_);
  features.damping |= material.damping != 0;
  features.friction |= material.has_friction();
  features_index_ = features.index() + (effects_ ? kWithEffects : 0);
}

void Scene::set_effects(SceneEffects effects) {
  std::erase_if(effects.objects, [](const ObjectEffects& object) {
    const bool knocks = object.transient && object.transient->amplitude > 0;
    return object.fields.empty() && !knocks;
  });
  features_index_ %= kWithEffects;
  effects_ = nullptr;
  if (effects.objects.empty()) return;
  effects_ = std::make_shared<const SceneEffects>(std::move(effects));
  features_index_ += kWithEffects;
}

bool Scene::differs_in_feel_only(const Scene& other) const {
  const auto same_place = [](const auto& a, const auto& b) {
    return a.to_world == b.to_world && a.position == b.position && a.object == b.object &&
           a.group == b.group;
  };
  const auto same_texture = [](const stimuli::Material& a, const stimuli::Material& b) {
    return a.texture == b.texture ||
           (a.texture != nullptr && b.texture != nullptr && a.texture->same_as(*b.texture));
  };
  const auto same_part = [&](const ScenePart& a, const ScenePart& b) {
    return same_place(a, b) && same_texture(a.material, b.material) && a.layer == b.layer &&
           a.break_force == b.break_force && a.breaking == b.breaking &&
           std::ranges::equal(a.mesh->vertices(), b.mesh->vertices());
  };
  const auto same_surface = [&](const PlacedSurface& a, const PlacedSurface& b) {
    return same_place(a, b) && a.first_material == b.first_material && a.layer == b.layer &&
           a.breaking == b.breaking && a.break_force == b.break_force &&
           std::ranges::equal(a.surface->vertices(), b.surface->vertices()) &&
           a.surface->triangles().size() == b.surface->triangles().size();
  };
  return motion_ == nullptr && other.motion_ == nullptr && effects_ == nullptr &&
         other.effects_ == nullptr && features().unions == other.features().unions &&
         groups_.size() == other.groups_.size() && materials() == other.materials() &&
         segments() == other.segments() && std::ranges::equal(parts_, other.parts_, same_part) &&
         std::ranges::equal(surfaces_, other.surfaces_, same_surface) &&
         std::ranges::equal(materials_, other.materials_, same_texture);
}

void Scene::add_surfaces(std::vector<SceneSurface> surfaces, TickFeatures& features) {
  constexpr double kRounding = 1e-12, kSkin = 1e-9, kThickestSkin = 1e-3;  // of the size
  constexpr double kOverSeam = 1.5;                                        // times its width
  constexpr double kRoundings = 8 * std::numeric_limits<double>::epsilon();
  auto pairs = static_cast<std::uint32_t>(parts_.size() * segments());
  for (SceneSurface& placed : surfaces) {
    PlacedSurface surface;
    surface.surface = std::move(placed.surface);
    surface.to_world = glm::mat3_cast(placed.pose.orientation);
    surface.position = placed.pose.position;
    surface.sphere_centre = surface.world_vector(surface.surface->centre()) + surface.position;
    surface.sphere_radius = surface.surface->radius();
    surface.tolerance = kRounding * surface.surface->size() +
                        kRoundings * (glm::length(surface.sphere_centre) +
                                      glm::length(surface.surface->centre()) + tool_reach_);
    // Over steps and cracks that rounding leaves between shells.
    const double over_seam =
        std::min(kOverSeam * surface.surface->seam(), kThickestSkin * surface.surface->size());
    surface.skin = std::max({kSkin * surface.surface->size(), 64 * surface.tolerance, over_seam});
    surface.object = placed.object;
    surface.of_shell = std::move(placed.of_shell);
    surface.of_shell.resize(surface.surface->materials().size(), placed.object);
    surface.group = static_cast<std::uint32_t>(groups_.size());
    surface.first_material = static_cast<std::uint32_t>(parts_.size() + materials_.size());
    for (const stimuli::Material& material : surface.surface->materials()) {
      features.damping |= material.damping != 0;
      features.friction |= material.has_friction();
      features.texture |= material.texture != nullptr;
      materials_.push_back(material);
    }
    PartGroup group;
    group.first_part = static_cast<std::uint32_t>(parts_.size());
    group.first_pair = pairs;
    group.solid = placed.object;
    group.by_law = true;
    group.felt = placed.layer != kNotFelt;
    group.skin = surface.skin;
    group.surface = static_cast<std::uint32_t>(surfaces_.size());
    const auto same = std::find_if(groups_.begin(), groups_.end(), [&](const PartGroup& other) {
      return other.solid == placed.object;
    });
    group.object_state =
        same != groups_.end() ? same->object_state : static_cast<std::uint32_t>(object_states_++);
    pairs += kMostPlanes;
    surface.layer = placed.layer;
    if (std::isfinite(placed.break_force)) {
      surface.breaking = static_cast<std::uint32_t>(breaking_.size());
      surface.break_force = placed.break_force;
      breaking_.push_back({group.object_state, placed.break_force, surface.group});
    }
    groups_.push_back(group);
    surfaces_.push_back(std::move(surface));
  }
  // A single part for the walk alone now shares its object with a surface.
  for (PartGroup& group : groups_) {
    const auto shares = [&](const PlacedSurface& s) {
      return groups_[s.group].object_state == group.object_state;
    };
    if (group.by_law || std::none_of(surfaces_.begin(), surfaces_.end(), shares)) continue;
    group.by_law = true;
    prepare_for_law(group);
  }
}

void Scene::index_parts() {
  if (parts_.size() <= kFewParts) return;
  std::vector<stimuli::Box> boxes;
  boxes.reserve(parts_.size());
  for (const ScenePart& part : parts_) {
    boxes.push_back(
        {part.sphere_centre - part.sphere_radius, part.sphere_centre + part.sphere_radius});
    mean_radius_ += part.sphere_radius / static_cast<double>(parts_.size());
  }
  part_tree_ = stimuli::BoundingTree(boxes);
  const auto& nodes = part_tree_.nodes();
  node_spheres_.resize(nodes.size());
  for (std::uint32_t n = static_cast<std::uint32_t>(nodes.size()); n-- > 0;) {
    Sphere& sphere = node_spheres_[n];
    sphere.centre = 0.5 * (nodes[n].box.low + nodes[n].box.high);
    const auto include = [&](const Vec3& centre, double radius) {
      sphere.radius = std::max(sphere.radius, glm::length(centre - sphere.centre) + radius);
    };
    if (nodes[n].count == 0) {
      for (const std::uint32_t child : {n + 1, nodes[n].first})
        include(node_spheres_[child].centre, node_spheres_[child].radius);
      const double of_box = 0.5 * glm::length(nodes[n].box.high - nodes[n].box.low);
      sphere.radius = std::min(sphere.radius, of_box);
      continue;
    }
    for (std::uint32_t i = nodes[n].first; i < nodes[n].first + nodes[n].count; ++i) {
      const ScenePart& part = parts_[part_tree_.order()[i]];
      include(part.sphere_centre, part.sphere_radius);
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
      if (same == breaking_.size())
        breaking_.push_back({group.object_state, part.break_force, part.group});
      part.breaking = static_cast<std::uint32_t>(same);
    }
  }
}

RenderState Scene::initial_state() const {
  RenderState state;
  state.parts.resize(parts_.size());
  state.near_parts.reserve(parts_.size());
  if (!part_tree_.nodes().empty()) state.nearby.parts.reserve(parts_.size());
  if (!features().several_parts) state.near_parts.push_back(0);  // a single part is always near
  state.contacts.reserve(parts_.size());
  if (features().texture) state.textures.resize(parts_.size());
  if (effects_) {
    std::size_t fields = 0;
    for (const ObjectEffects& object : effects_->objects) fields += object.fields.size();
    state.effects.velocities.resize(fields);
    state.effects.knocks.resize(effects_->objects.size());
  }
  if (motion_) state.motion = OwnedMotion(motion_->initial_state());
  if (features().unions) {
    std::size_t most_pairs = 0, contacts = 0;
    for (const PartGroup& group : groups_) {
      most_pairs = std::max(most_pairs, group.part_count * segments());
      contacts += group.by_law ? kMostPlanes : 1;
    }
    state.unions.pairs.resize(parts_.size() * segments() + kMostPlanes * surfaces_.size());
    state.unions.surfaces.resize(surfaces_.size());
    state.unions.groups.resize(groups_.size());
    state.unions.objects.resize(object_states_);
    state.unions.breaking.resize(breaking_.size());
    state.unions.near.reserve(most_pairs);
    state.unions.contacts.reserve(contacts);
    state.unions.rubbed.reserve(contacts);
    if (features().texture) state.unions.carved.resize(groups_.size());
  }
  return state;
}

}  // namespace palpate::rendering
