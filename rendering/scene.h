#pragma once
// The objects of a trial, compiled once into the least work a tick needs, and the state that a
// renderer keeps between ticks. World frame and SI units unless said otherwise.

#include <algorithm>
#include <cstdint>
#include <glm/geometric.hpp>
#include <limits>
#include <memory>
#include <vector>

#include "rendering/contact.h"
#include "rendering/contact_feature.h"
#include "rendering/fields.h"
#include "rendering/probe.h"
#include "rendering/separation.h"
#include "rendering/texture.h"
#include "rendering/tool.h"
#include "rendering/union_state.h"
#include "stimuli/bounding_tree.h"
#include "stimuli/shapes.h"

namespace palpate::stimuli {
class ConvexMesh;
}

namespace palpate::rendering {

class ContactTrees;

/// The layer of parts without force that bound an object with layers: a tool inside them has not
/// left the object.
inline constexpr int kNotFelt = -1;

/// The solid of an object that touches no other fixed one.
inline constexpr int kAlone = -1;

/// One convex part to be put into a scene.
struct SceneObject {
  std::shared_ptr<const stimuli::ConvexMesh> mesh;
  Pose pose;
  stimuli::Material material;
  int object =
      0;  ///< index of the object in the scene; the parts of a compound share it and are contiguous
  std::shared_ptr<const ContactTrees> trees;  ///< built by the scene when empty
  /// 0: the object's surface; 1 and up: its layers, each with its own ideal tool.
  int layer = 0;
  /// N; of a layer. Parts of equal break force whose total force exceeds it break, until the object
  /// has been left.
  double break_force = std::numeric_limits<double>::infinity();
  /// Fixed objects that touch share an ideal tool: the first one's index. kAlone: it touches none.
  int solid = kAlone;

  int own_solid() const { return solid != kAlone ? solid : object; }
};

/// A closed surface to be put into a scene: all shells of an object or of one of its layers, or of
/// fixed objects that touch.
struct SceneSurface {
  std::shared_ptr<const stimuli::Surface> surface;
  Pose pose;
  int object = 0;               ///< index of the object in the scene; of several the first
  std::vector<int> of_shell{};  ///< object of each shell; empty: all are of `object`
  int layer = 0;                ///< as of SceneObject
  double break_force = std::numeric_limits<double>::infinity();  ///< N; of a layer
};

/// One convex part as the tick uses it.
struct ScenePart {
  std::shared_ptr<const stimuli::ConvexMesh> mesh;
  std::shared_ptr<const ContactTrees> trees;
  Mat3 to_world;             ///< rotation from the mesh frame
  Vec3 position;             ///< m, of the mesh frame's origin
  Vec3 sphere_centre;        ///< m
  double sphere_radius = 0;  ///< m
  double tolerance = 0;      ///< m; shorter is rounding at this size and distance from the origin
  stimuli::Material material;
  int object = 0;
  int solid = 0;                ///< index of the object, or of the first of those that it touches
  bool shallow_ridges = false;  ///< equation (2) covers several faces (equivalent_point.h)

  int layer = 0;
  double break_force = std::numeric_limits<double>::infinity();  ///< N; of its layer
  std::uint32_t group = 0;                                       ///< index in Scene::groups()
  static constexpr std::uint32_t kHolds = std::numeric_limits<std::uint32_t>::max();
  std::uint32_t breaking = kHolds;  ///< index in Scene::breaking(); kHolds: never breaks

  // For unions and tools (union_contact.h): the law enlarges the part by a margin, far above
  // rounding and far below perception, so that abutting parts leave no crack. Instead of enlarging
  // the part, it shrinks the probe about a point inside.
  Vec3 inside;        ///< mesh frame, m
  double shrink = 1;  ///< of the probe; 1 / (1 + margin)
  double margin = 0;  ///< m, of the vertex that it moves most

  // Inlined: a tick rotates three to five vectors, at ten instructions each.
  [[gnu::always_inline]] Vec3 local_point(const Vec3& world) const {
    return local_vector(world - position);
  }
  [[gnu::always_inline]] Vec3 local_vector(const Vec3& world) const {
    return {glm::dot(to_world[0], world), glm::dot(to_world[1], world),
            glm::dot(to_world[2], world)};
  }
  [[gnu::always_inline]] Vec3 world_vector(const Vec3& local) const {
    return to_world[0] * local.x + to_world[1] * local.y + to_world[2] * local.z;
  }
};

/// The features that a tick needs beyond one convex part with a plain spring. A tick is compiled
/// for each combination, so unused features cost nothing.
struct TickFeatures {
  bool several_parts = false;  ///< broad phase, a list of contacts, sums over it
  bool damping = false;        ///< some material has it; so for the others
  bool friction = false;
  /// Objects of several parts, layers, or a tool: the law of union_contact.h; or closed surfaces.
  bool unions = false;
  bool texture = false;  ///< some surface is carved (texture.h)

  static constexpr std::size_t kCount = 32;  ///< combinations
  static constexpr TickFeatures of(std::size_t index) {
    return {(index & 1) != 0, (index & 2) != 0, (index & 4) != 0, (index & 8) != 0,
            (index & 16) != 0};
  }
  constexpr std::size_t index() const {
    return std::size_t{several_parts} | std::size_t{damping} << 1 | std::size_t{friction} << 2 |
           std::size_t{unions} << 3 | std::size_t{texture} << 4;
  }
  constexpr bool plain_springs() const { return !damping && !friction; }
};

/// The state of one part between ticks.
struct PartState {
  ContactFeature feature;     ///< in contact: the ideal probe is on it; kind none: no contact
  SeparatingPlane plane;      ///< mesh frame; where valid, the last pose was beyond it
  ContactFeature nearby;      ///< not in contact: the feature of a recent separating plane, if any
  std::uint32_t support = 0;  ///< result of the last search for a separating plane
  bool started_inside = false;  ///< the trial began inside: no force until the probe has left once
  FrictionState friction;       ///< where the material has friction
};

/// In a scene of many parts: those around the probe, in any order. The near parts are chosen from
/// them.
struct NearbyParts {
  std::vector<std::uint32_t> parts;
  LineProbe pose;   ///< the probe when they were listed; for a tool see UnionMemory
  double room = 0;  ///< m; the others are out of reach until the probe has moved so far
};

/// A renderer's whole memory between ticks. Copy it to replay from here.
struct RenderState {
  std::vector<PartState> parts;
  std::vector<std::uint32_t> near_parts;  ///< in order; all others are out of reach for now
  LineProbe near_parts_pose;              ///< the probe when near_parts was last rebuilt
  double clearance = 0;  ///< m; moved by less from near_parts_pose, the probe reaches no others
  NearbyParts nearby;    ///< empty where the scene has no tree of parts
  LineProbe last;        ///< last valid pose
  bool has_last = false;
  /// The tool's side, world frame, if the caller senses it; written before a tick. Its component at
  /// right angles to the stylus is +x. Zero: +x is carried along by the smallest rotation.
  Vec3 measured_side;
  UnionMemory unions;                   ///< empty where the scene has none
  std::vector<LoadedContact> contacts;  ///< of the last tick; with room for one of each part
  std::vector<TextureState> textures;   ///< of each part; empty where nothing is textured
  OwnedMotion motion;                   ///< empty where nothing moves
  EffectsState effects;                 ///< empty where the scene has none
};

/// What of a material may change while it is touched: not the depths and strengths of layers.
struct Feel {
  double stiffness = 0;         ///< N/m
  double damping = 0;           ///< N s/m
  double friction_static = 0;   ///< coefficient
  double friction_dynamic = 0;  ///< coefficient
  bool operator==(const Feel&) const = default;
};

/// Immutable except for set_feel; shared by the servo and the display.
class Scene {
 public:
  /// \param side_contact  false: leaves out the tree of edges, which only a segment needs
  /// \param tool          what the stylus carries; empty: the plain stylus
  /// \param motion        the moving objects, whose first place is given here; null: none
  explicit Scene(std::vector<SceneObject> objects, bool side_contact = true, Tool tool = {},
                 std::shared_ptr<const SceneMotion> motion = nullptr,
                 std::vector<SceneSurface> surfaces = {});

  /// At their place; moving parts at their first place.
  const std::vector<ScenePart>& parts() const { return parts_; }
  const std::vector<PlacedSurface>& surfaces() const { return surfaces_; }
  /// Of a contact's part; surfaces' materials follow those of the convex parts.
  const stimuli::Material& material_of(std::uint32_t part) const {
    return part < parts_.size() ? parts_[part].material : materials_[part - parts_.size()];
  }
  /// Number of materials: of convex parts, then of surfaces' shells.
  std::size_t materials() const { return parts_.size() + materials_.size(); }
  Feel feel_of(std::uint32_t part) const;
  /// In a scene without motion(). By the thread that renders it, between two ticks.
  void set_feel(std::uint32_t part, const Feel& feel) noexcept;
  /// Whether a tick of the other scene may continue a state of this one: nothing moves, and shapes,
  /// poses, layers, textures and tool are equal. Reads no number that set_feel writes.
  bool differs_in_feel_only(const Scene& other) const;
  /// Fields and knocks, before the first state is made; without any, nothing changes.
  void set_effects(SceneEffects effects);
  /// Null: none.
  const SceneEffects* effects() const { return effects_.get(); }
  const SceneMotion* motion() const { return motion_.get(); }
  TickFeatures features() const { return TickFeatures::of(features_index_); }
  /// Selects the tick that a renderer runs; from TickFeatures::kCount on, that of motion(); from
  /// kWithEffects on, the same with effects().
  static constexpr std::size_t kWithEffects = 2 * TickFeatures::kCount;
  std::size_t features_index() const { return features_index_; }
  /// Parts of one group are contiguous.
  const std::vector<PartGroup>& groups() const { return groups_; }
  const std::vector<BreakingParts>& breaking() const { return breaking_; }
  /// The tool on the stylus; null: the plain stylus.
  const Tool* tool() const { return tool_.segments.empty() ? nullptr : &tool_; }
  /// m, from the tip to the farthest point of the tool.
  double tool_reach() const { return tool_reach_; }
  static constexpr std::size_t kFewParts = 32;  ///< up to so many parts get no tree
  /// Over the parts' bounding spheres.
  const stimuli::BoundingTree& part_tree() const { return part_tree_; }
  struct Sphere {
    Vec3 centre;        ///< m
    double radius = 0;  ///< m
  };
  /// The bounding sphere of all parts below each node of the tree.
  const std::vector<Sphere>& node_spheres() const { return node_spheres_; }
  double mean_radius() const { return mean_radius_; }  ///< m, of the parts' bounding spheres
  /// Whether it is one closed surface, felt with the plain stylus, and nothing else.
  bool is_one_surface() const { return is_one_surface_; }
  std::size_t segments() const { return tool_.segments.empty() ? 1 : tool_.segments.size(); }
  RenderState initial_state() const;

 private:
  void group_parts();
  void prepare_for_law(PartGroup& group);
  void add_surfaces(std::vector<SceneSurface> surfaces, TickFeatures& features);
  void index_parts();
  void find_breaking_parts();

  std::vector<ScenePart> parts_;
  std::vector<PlacedSurface> surfaces_;
  std::vector<stimuli::Material> materials_;  ///< of the surfaces' shells
  std::vector<PartGroup> groups_;
  std::vector<BreakingParts> breaking_;
  std::size_t object_states_ = 0;
  double tool_reach_ = 0;
  Tool tool_;
  std::size_t features_index_ = 0;
  bool is_one_surface_ = false;
  std::shared_ptr<const SceneMotion> motion_;
  std::shared_ptr<const SceneEffects> effects_;
  stimuli::BoundingTree part_tree_;
  std::vector<Sphere> node_spheres_;
  double mean_radius_ = 0;
};

/// Share of a part's radius: room to move before the list of near parts must be rebuilt.
inline constexpr double kReachShare = 0.25;

/// Broad phase: whether the probe can touch the part soon, or may have passed it in this tick.
/// \param gap   m, between the probe and the part's bounding sphere
/// \param step  m, how far the probe moved in this tick
inline bool in_reach(const ScenePart& part, double gap, double step) {
  return gap - step <= kReachShare * part.sphere_radius;
}

/// The same for a tool, whose ideal tool may be up to UnionMemory::reach away.
/// \param tool  the virtual tool at this tick
void update_near_parts(const Scene& scene, RenderState& state, const LineProbe& probe,
                       const ToolPose& tool, bool sides);

/// Lists the parts that the probe can reach soon (bounding spheres). No allocation.
void rebuild_near_parts(const Scene& scene, RenderState& state, const LineProbe& probe);

/// The same, unless the last list is still valid.
/// \tparam kSegment  false: the tip alone touches, so its motion alone counts
template <bool kSegment = true>
inline void update_near_parts(const Scene& scene, RenderState& state, const LineProbe& probe) {
  if (state.clearance == std::numeric_limits<double>::infinity())
    return;  // all parts are always near
  const Vec3 tip = probe.tip - state.near_parts_pose.tip;
  double moved2 = glm::dot(tip, tip);
  if constexpr (kSegment) {
    const Vec3 tail = probe.tail - state.near_parts_pose.tail;
    moved2 = std::max(moved2, glm::dot(tail, tail));
  }
  if (moved2 >= state.clearance * state.clearance) rebuild_near_parts(scene, state, probe);
}

}  // namespace palpate::rendering
