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
#include "rendering/facet_walk.h"
#include "rendering/first_contact.h"
#include "rendering/probe.h"
#include "rendering/separation.h"
#include "rendering/tool.h"
#include "rendering/union_state.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/shapes.h"

namespace palpate::rendering {

/// The layer of what is nowhere felt itself, but bounds an object that has layers: who is inside of
/// it has not left the object.
inline constexpr int kNotFelt = -1;

/// One convex part to be put into a scene.
struct SceneObject {
  std::shared_ptr<const stimuli::ConvexMesh> mesh;
  Pose pose;
  stimuli::Material material;
  int object =
      0;  ///< index of the object in the scene; the parts of a compound share it, side by side
  std::shared_ptr<const ContactTrees> trees;  ///< built by the scene when empty
  /// 0: the object's surface; 1 and on: its layers, each felt on its own.
  int layer = 0;
  /// N; of a layer. Parts of equal bounds that bear more together give way until the object has
  /// been left.
  double break_force = std::numeric_limits<double>::infinity();
};

/// A closed surface to be put into a scene: all shells of an object.
struct SceneSurface {
  std::shared_ptr<const Surface> surface;
  Pose pose;
  int object = 0;  ///< index of the object in the scene
};

/// One convex part as the tick uses it.
struct ScenePart {
  std::shared_ptr<const stimuli::ConvexMesh> mesh;
  std::shared_ptr<const ContactTrees> trees;
  Mat3 to_world;             ///< rotation from the mesh frame
  Vec3 position;             ///< m, of the mesh frame's origin
  Vec3 sphere_centre;        ///< m
  double sphere_radius = 0;  ///< m
  double tolerance = 0;      ///< m; shorter is rounding, at this size and distance from the origin
  stimuli::Material material;
  int object = 0;
  bool shallow_ridges = false;  ///< equation (2) goes over several faces (equivalent_point.h)

  int layer = 0;
  double break_force = std::numeric_limits<double>::infinity();  ///< N; of its layer
  std::uint32_t group = 0;                                       ///< index in Scene::groups()
  static constexpr std::uint32_t kHolds = std::numeric_limits<std::uint32_t>::max();
  std::uint32_t breaking = kHolds;  ///< index in Scene::breaking(); kHolds: it never gives way

  // For unions and tools (union_contact.h): the law sees the part larger by a margin, far above
  // rounding and far below what is felt, so that parts that abut leave no crack. Instead of the
  // part the probe is scaled, about a point inside.
  Vec3 inside;        ///< mesh frame, m
  double shrink = 1;  ///< of the probe; 1 / (1 + margin)
  double margin = 0;  ///< m, of the vertex that it moves most

  // Inlined: a tick turns three to five vectors, at ten instructions each.
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

/// What a tick over a scene does beyond one convex part that is a plain spring. A tick is compiled
/// for each combination, so that what is not needed costs nothing.
struct TickFeatures {
  bool several_parts = false;  ///< broad phase, a list of contacts, sums over it
  bool damping = false;        ///< some material has it; so the others
  bool friction = false;
  /// Objects of several parts, layers, or a tool: the law of union_contact.h; or closed surfaces.
  bool unions = false;

  static constexpr std::size_t kCount = 16;  ///< combinations
  static constexpr TickFeatures of(std::size_t index) {
    return {(index & 1) != 0, (index & 2) != 0, (index & 4) != 0, (index & 8) != 0};
  }
  constexpr std::size_t index() const {
    return std::size_t{several_parts} | std::size_t{damping} << 1 | std::size_t{friction} << 2 |
           std::size_t{unions} << 3;
  }
  constexpr bool plain_springs() const { return !damping && !friction; }
};

/// What is remembered of one part from tick to tick.
struct PartState {
  ContactFeature feature;     ///< in contact: that the ideal probe is on; kind none: no contact
  SeparatingPlane plane;      ///< mesh frame; where valid, the last pose was beyond it
  ContactFeature nearby;      ///< not in contact: the feature of a recent separating plane, if any
  std::uint32_t support = 0;  ///< vertex that the last search for a separating plane ended on
  bool started_inside = false;  ///< the trial began inside: no force until the probe has left once
  FrictionState friction;       ///< where the material has friction
};

/// Of many parts, those around the probe, from which the near ones are chosen; in any order.
struct NearbyParts {
  std::vector<std::uint32_t> parts;
  LineProbe pose;   ///< the probe when they were listed; of a tool see UnionMemory
  double room = 0;  ///< m; the others are out of reach until the probe has moved so far
};

/// A renderer's whole memory between ticks. Copy it to replay from here.
struct RenderState {
  std::vector<PartState> parts;
  std::vector<std::uint32_t> near_parts;  ///< in order; the others are out of reach for now
  LineProbe near_parts_pose;              ///< the probe when near_parts was last rebuilt
  double clearance = 0;  ///< m; within it of near_parts_pose the other parts are out of reach
  NearbyParts nearby;    ///< empty where the scene has no tree of parts
  LineProbe last;        ///< last valid pose
  bool has_last = false;
  /// Of the tool, world frame, where the caller senses it: written before a tick. Its part at right
  /// angles to the stylus is +x. Zero: +x is carried along by the smallest rotation.
  Vec3 measured_side;
  UnionMemory unions;                   ///< empty where the scene has none
  std::vector<LoadedContact> contacts;  ///< of the last tick; with room for one of each part
  OwnedMotion motion;                   ///< empty where nothing moves
};

/// Immutable; shared by the servo and the display.
class Scene {
 public:
  /// \param side_contact  false leaves out what only a segment needs (the tree of edges)
  /// \param tool          what the stylus carries; empty: nothing but itself
  /// \param motion        what moves, of objects that stand at first where they are here; null:
  /// nothing
  explicit Scene(std::vector<SceneObject> objects, bool side_contact = true, Tool tool = {},
                 std::shared_ptr<const SceneMotion> motion = nullptr,
                 std::vector<SceneSurface> surfaces = {});

  /// Where they stand, at first where they move.
  const std::vector<ScenePart>& parts() const { return parts_; }
  const std::vector<PlacedSurface>& surfaces() const { return surfaces_; }
  /// Of a contact's part; those of surfaces follow after the convex parts.
  const stimuli::Material& material_of(std::uint32_t part) const {
    return part < parts_.size() ? parts_[part].material : materials_[part - parts_.size()];
  }
  const SceneMotion* motion() const { return motion_.get(); }
  /// Selects the tick that a renderer runs; beyond TickFeatures::kCount it is that of motion().
  TickFeatures features() const { return TickFeatures::of(features_index_); }
  std::size_t features_index() const { return features_index_; }
  /// Parts of one group stand side by side.
  const std::vector<PartGroup>& groups() const { return groups_; }
  const std::vector<BreakingParts>& breaking() const { return breaking_; }
  /// What the stylus carries; null: nothing but itself.
  const Tool* tool() const { return tool_.segments.empty() ? nullptr : &tool_; }
  /// m, from the tip to the farthest point of the tool.
  double tool_reach() const { return tool_reach_; }
  static constexpr std::size_t kFewParts = 32;  ///< up to so many have no tree
  /// Of the parts' bounding spheres.
  const BoundingTree& part_tree() const { return part_tree_; }
  struct Sphere {
    Vec3 centre;        ///< m
    double radius = 0;  ///< m
  };
  /// About all parts of each node of the tree.
  const std::vector<Sphere>& node_spheres() const { return node_spheres_; }
  double mean_radius() const { return mean_radius_; }  ///< m, of the parts' spheres
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
  std::shared_ptr<const SceneMotion> motion_;
  BoundingTree part_tree_;
  std::vector<Sphere> node_spheres_;
  double mean_radius_ = 0;
};

/// Of the radius: room to move before the list of near parts must be rebuilt.
inline constexpr double kReachShare = 0.25;

/// Broad phase: whether the probe can touch the part soon, or may have passed it in this tick.
/// \param gap   m, between the probe and the part's bounding sphere
/// \param step  m, how far the probe moved in this tick
inline bool in_reach(const ScenePart& part, double gap, double step) {
  return gap - step <= kReachShare * part.sphere_radius;
}

/// The same for a tool, whose ideal one may be up to `reach` away from it.
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
