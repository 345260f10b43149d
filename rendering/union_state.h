#pragma once
// The contact law of unions (union_contact.h): its view of a scene, and its state between ticks.
// World frame and SI units unless said otherwise.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <memory>
#include <span>
#include <vector>

#include "rendering/contact.h"
#include "rendering/contact_feature.h"
#include "rendering/separation.h"
#include "rendering/surface_patch.h"
#include "rendering/tool.h"
#include "stimuli/vec.h"

namespace palpate::rendering {

// The nearest point that several half-spaces allow: where an ideal tool rests on up to three planes
// at once, and each plane's share of the displacement. Any frame, m.

/// The half-space of points p with dot(normal, p) >= bound.
struct PlaneBound {
  Vec3 normal;       ///< unit, out of the obstacle
  double bound = 0;  ///< m
};

/// At most so many planes hold the ideal tool at once; at rest, at most three do.
inline constexpr std::size_t kMostPlanes = 8;

/// The point nearest to the origin, as the sum of multiplier * normal over the half-spaces, with
/// multipliers >= 0, at most three of them positive.
struct ConstrainedPoint {
  Vec3 point;
  std::array<double, kMostPlanes> multipliers{};  ///< m
  bool found = false;                             ///< the half-spaces have points in common
};

/// In closed form: tries a face, then an edge, then a vertex of the intersection, so that of planes
/// that agree within the tolerance the fewest carry.
/// \param half_spaces  up to kMostPlanes
/// \param tolerance    m; a half-space that is violated by no more than this is satisfied
ConstrainedPoint constrained_point(std::span<const PlaneBound> half_spaces, double tolerance);

// The law of surfaces (surface_contact.h): its view of a closed surface in a scene, and its state
// between ticks.

/// A closed surface as the tick uses it. World frame, m.
struct PlacedSurface {
  std::shared_ptr<const Surface> surface;
  Mat3 to_world;  ///< rotation from the surface's frame
  Vec3 position;  ///< of its origin
  Vec3 sphere_centre;
  double sphere_radius = 0;
  double tolerance = 0;              ///< shorter is rounding
  double skin = 0;                   ///< the ideal tool keeps this distance from what it rests on
  int object = 0;                    ///< the first one
  std::vector<int> of_shell;         ///< object of each shell
  std::uint32_t group = 0;           ///< index in Scene::groups()
  std::uint32_t first_material = 0;  ///< of the first shell, in Scene::material_of
  int layer = 0;                     ///< as of SceneObject
  static constexpr std::uint32_t kHolds = 0xffffffff;
  std::uint32_t breaking = kHolds;  ///< index in Scene::breaking(); kHolds: never breaks
  double break_force = 0;           ///< N, where it breaks

  Vec3 local_vector(const Vec3& world) const {
    return {glm::dot(to_world[0], world), glm::dot(to_world[1], world),
            glm::dot(to_world[2], world)};
  }
  Vec3 local_point(const Vec3& world) const { return local_vector(world - position); }
  Vec3 world_vector(const Vec3& local) const {
    return to_world[0] * local.x + to_world[1] * local.y + to_world[2] * local.z;
  }
};

/// A patch near the tool.
struct NearPatch {
  PatchPlane plane;  ///< for the tool where it was listed; without a normal: not known
  SurfacePatch patch;
};

/// A surface's state between ticks. Local frame, m.
struct SurfaceState {
  std::array<SurfacePatch, kMostPlanes> carrying;  ///< held the ideal tool at the last tick
  std::size_t carrying_count = 0;
  /// All that the tool can touch while it is less than `room`, m, off the straight way.
  std::vector<NearPatch> patches;
  PosedTool listed;  ///< where the way begins
  Vec3 listed_way;
  double room = 0;
  double stride = 0;  ///< m, how far the ideal tool is translated in a tick, about
  bool has_list = false;
  /// The tool touches nothing while no end of it is farther than `clear_room`, m, from `clear`.
  PosedTool clear;
  double clear_room = 0;
  double wanted_clear_room = 0;  ///< for the next one
  /// The contacts of the last tick; their friction is in UnionMemory::pairs.
  struct Rubbed {
    Vec3 normal;
    std::uint32_t segment = 0;
    bool used = false;
  };
  std::array<Rubbed, kMostPlanes> rubbed;
};

/// The longest list of patches; where there are more, each motion queries the tree.
inline constexpr std::size_t kMostPatches = 512;

// The planes that hold an ideal tool. Internal to the contact law of unions (union_contact.h).

/// Sine of half the opening of the narrowest groove that a tool turns into.
inline constexpr double kNarrowest = 5e-5;

/// In the narrowest groove, each of two planes bears this many times the force that pushes the tool
/// in. Where planes would bear more, the tool is clamped and the push is felt as one contact:
/// opposite forces 1e5 times the push would be mostly rounding, and so would their torque.
inline constexpr double kMostLeverage = 0.5 / kNarrowest;

/// A plane that holds an ideal tool. Translations are relative to the virtual tool's tip.
struct Plane {
  std::uint32_t near = 0;  ///< index of the pair in UnionMemory::near
  ContactFeature feature;
  Vec3 normal;            ///< world, out of the part
  double depth = 0;       ///< m, of the virtual tool below it: dot(normal, y) >= depth outside
  double multiplier = 0;  ///< m, of the normal in the way from the virtual to the ideal tool
  bool stays = false;     ///< returned where it had let go (rounding): do not let go there again
};

/// The planes in use, at most kMostPlanes.
/// \tparam Held  has the normal, depth and multiplier of Plane
template <class Held>
class PlanesOf {
 public:
  PlanesOf() {}  // NOLINT(modernize-use-equals-default): that would be deleted
  PlanesOf(const PlanesOf& other) { *this = other; }
  PlanesOf& operator=(const PlanesOf& other) {
    count_ = other.count_;
    std::copy_n(other.planes_.begin(), count_, planes_.begin());
    return *this;
  }
  std::span<Held> all() { return {planes_.data(), count_}; }
  std::span<const Held> all() const { return {planes_.data(), count_}; }
  /// Null if there is no plane.
  const Held* most_loaded() const {
    const Held* most = nullptr;
    for (const Held& plane : all()) {
      if (most == nullptr || plane.multiplier > most->multiplier) most = &plane;
    }
    return most;
  }
  /// Calls add(plane) for the planes that a tool at rest touches. One that is stuck, or clamped
  /// between planes that hold each other more than it, touches one plane across its way.
  /// \param shift  m, from the virtual to the ideal tool
  template <class Add>
  void for_each_contact(const Vec3& shift, bool stuck, const Add& add) const {
    const double length = glm::length(shift);
    const Held* const most = most_loaded();
    if (stuck || (most != nullptr && most->multiplier > kMostLeverage * length)) {
      if (most == nullptr || !(length > 0)) return;
      Held across = *most;
      across.normal = shift / length;
      across.multiplier = length;
      add(across);
      return;
    }
    for (const Held& plane : all()) {
      if (plane.multiplier > 0) add(plane);
    }
  }
  bool full() const { return count_ == planes_.size(); }
  bool empty() const { return count_ == 0; }
  void clear() { count_ = 0; }
  void add(const Held& plane) { planes_[count_++] = plane; }
  /// Keeps the order; `drop` may change the planes that it keeps.
  template <class Drop>
  void remove_if(const Drop& drop) {
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count_; ++i) {
      if (drop(planes_[i])) continue;
      if (kept != i) planes_[kept] = planes_[i];
      ++kept;
    }
    count_ = kept;
  }

  /// Whether the planes, all of which hold the tool, leave it room: false in a crack.
  bool leave_room() const {
    // Rounding hides the apex of a narrower groove; between abutting parts a tool would turn for
    // ever.
    if (count_ < 2) return true;
    if (count_ == 2) {
      const double cosine = glm::dot(planes_[0].normal, planes_[1].normal);
      return 1 + cosine > 2 * kNarrowest * kNarrowest;
    }
    std::array<PlaneBound, kMostPlanes> raised;
    for (std::size_t i = 0; i < count_; ++i) raised[i] = {planes_[i].normal, 1};
    const ConstrainedPoint out =
        constrained_point(std::span<const PlaneBound>(raised.data(), count_), 1e-6);
    return out.found && glm::dot(out.point, out.point) * (kNarrowest * kNarrowest) < 1;
  }

  /// Whether two planes face each other as the sides of a crack do.
  bool are_a_crack() const {
    for (std::size_t a = 0; a < count_; ++a) {
      for (std::size_t b = a + 1; b < count_; ++b) {
        if (1 + glm::dot(planes_[a].normal, planes_[b].normal) <= 2 * kNarrowest * kNarrowest)
          return true;
      }
    }
    return false;
  }

  /// The point nearest to `origin` at least `skin` above all planes; sets the multipliers.
  bool nearest(const Vec3& origin, double skin, double tolerance, Vec3& point) {
    std::array<PlaneBound, kMostPlanes> spaces;
    for (std::size_t i = 0; i < count_; ++i)
      spaces[i] = {planes_[i].normal,
                   planes_[i].depth + skin - glm::dot(planes_[i].normal, origin)};
    return solve(spaces, tolerance, origin, point);
  }

  /// The point nearest to the virtual tool (the origin), starting at `at`. Stays above each plane
  /// by `skin`, or by the height of `at` where that is less; crosses no plane that `at` is above,
  /// except by `rounding`.
  bool nearest_from(const Vec3& at, double skin, double tolerance, double rounding, Vec3& point) {
    std::array<PlaneBound, kMostPlanes> spaces;
    for (std::size_t i = 0; i < count_; ++i) {
      const double height = glm::dot(planes_[i].normal, at) - planes_[i].depth;
      spaces[i] = {planes_[i].normal, planes_[i].depth + std::min(skin, height)};
      if (height > 0) tolerance = std::clamp(0.5 * height, rounding, tolerance);
    }
    return solve(spaces, tolerance, Vec3(0), point);
  }

 private:
  bool solve(const std::array<PlaneBound, kMostPlanes>& spaces, double tolerance,
             const Vec3& origin, Vec3& point) {
    const ConstrainedPoint nearest =
        constrained_point(std::span<const PlaneBound>(spaces.data(), count_), tolerance);
    if (!nearest.found) return false;
    for (std::size_t i = 0; i < count_; ++i) planes_[i].multiplier = nearest.multipliers[i];
    point = origin + nearest.point;
    return true;
  }

  union {  // only those in use are initialised
    std::array<Held, kMostPlanes> planes_;
  };
  std::size_t count_ = 0;
};

using Planes = PlanesOf<Plane>;

/// Shares one ideal tool: the convex parts of an object's surface or of one of its layers,
/// contiguous in the scene, or a closed surface.
struct PartGroup {
  std::uint32_t first_part = 0, part_count = 0;  ///< in the scene, contiguous
  std::uint32_t first_pair = 0;  ///< of part k and segment j: first_pair + k * segments + j
  std::uint32_t object_state = 0;
  int solid = 0;        ///< as of ScenePart
  bool by_law = false;  ///< else a single part without a tool, which the walk alone renders
  bool felt = true;     ///< false: no force; it only bounds the inside of the object
  double skin = 0;      ///< m; the ideal tool keeps this distance from what it rests on
  static constexpr std::uint32_t kParts = 0xffffffff;
  std::uint32_t surface = kParts;  ///< index in Scene::surfaces(); kParts: convex parts
};

/// Parts of one group that break together: a layer, or in a compound the layer's parts of equal
/// break force.
struct BreakingParts {
  std::uint32_t object_state = 0;
  double force = 0;  ///< N; more breaks them
  std::uint32_t group = 0;
};

/// One part and one segment of the tool.
struct PairState {
  ContactFeature feature;  ///< facet of M that last separated the two, or carries the ideal tool
  SeparatingPlane plane;   ///< mesh frame; the part is behind it
  bool carries = false;    ///< the ideal tool rested on the feature at the last tick
  FrictionState friction;
};

/// One ideal tool.
struct GroupState {
  ToolPose ideal;  ///< where `touching`; else the ideal tool is the virtual one
  Vec3 grasp;      ///< m, mean contact place in the tool's frame; about it the tool turns
  bool touching = false;
  Vec3 shift;      ///< m, at the last tick, from the virtual to the ideal tool, without the skin
  double lag = 0;  ///< rad, between its orientation and the virtual tool's
  double strength = 1;      ///< 0 to 1, of the remaining parts' force after others broke
  double last_force = 0;    ///< N, of all contacts with the group when parts broke
  bool parts_went = false;  ///< at the last tick
};

/// The state of BreakingParts between ticks.
struct BreakState {
  bool giving_way = false;  ///< they broke: their force falls, until the object is left
  bool was_left = false;    ///< at the last tick: they are whole from now on
  double strength = 1;      ///< share of their force that is left; 0: they are gone
  Vec3 force;               ///< N, of this tick's contacts with them
};

/// State that the ideal tools of one object share.
struct ObjectState {
  bool off = false;             ///< no force until the object has been left once
  bool started_inside = false;  ///< the reason why it is off
  bool just_left = false;       ///< in this tick: its ideal tools begin at the virtual one
  bool releasing = false;       ///< hooked: its force falls
  double strength = 1;          ///< share of its force that is left
  double lag = 0;               ///< rad, the largest of its ideal tools at the last tick
  double lagging = 0;           ///< s, for how long that has been too much
};

/// A pair that the ideal tool can reach in this tick.
struct NearPair {
  std::uint32_t part = 0, pair = 0;  ///< indices in the scene and in RenderState::pairs
  std::uint32_t segment = 0;
  /// The segment of a tool whose tip is the virtual tip. Mesh frame, in which the part is larger by
  /// its margin (ScenePart::shrink), m.
  Vec3 tip, d;
  Vec3 true_tip, true_d;  ///< the same without the margin
  /// World frame: the plane of an earlier tick, if any. With the tool's tip at the virtual tip plus
  /// y, the segment is dot(normal, y) + height, m, above the plane; positive: apart.
  Vec3 normal;
  double offset = 0, height = 0;
  bool has_plane = false;
  bool was_apart = false;    ///< by that plane, at the pose that the tool comes from
  bool was_cast = false;     ///< the plane did not separate them: renew it
  Vec3 parted_at;            ///< m, where it last let go of the ideal tool in this tick
  bool parted = false;       ///< it let go in this tick
  bool carries = false;      ///< has a plane in use
  ContactFeature came_with;  ///< the pair's feature at the last tick
};

/// One of several contacts, with its place.
struct PlacedContact {
  LoadedContact loaded;
  Vec3 shift;   ///< m, from the virtual to the ideal tool, without friction
  Vec3 place;   ///< m, on the ideal tool, world frame
  Vec3 motion;  ///< m, of that place on the virtual tool since the last tick
  std::uint32_t group = 0;
  std::uint32_t pair = 0;  ///< by_law groups only
  int segment = 0;
  bool by_law = false;
  // On textured objects, as of SmoothContact (texture.h). World frame, m.
  Vec3 edge, along, window;
};

/// The places on textures that an ideal tool touched at the last tick.
struct CarvedGroup {
  struct Held {
    Vec3 place;  ///< m, as of TextureState; world frame
    int segment = 0;
    bool taken = false;  ///< by a contact of this tick
  };
  std::array<Held, kMostPlanes> held;
  std::size_t count = 0;
  bool seen = false;  ///< in this tick
};

/// A pair that friction acted on.
struct RubbedPair {
  std::uint32_t group = 0, pair = 0;
};

/// State of the law between ticks, beside that of single parts.
struct UnionMemory {
  std::vector<PairState> pairs;
  std::vector<GroupState> groups;
  std::vector<ObjectState> objects;
  std::vector<BreakState> breaking;
  std::vector<SurfaceState> surfaces;
  std::vector<NearPair> near;           ///< of the current group
  std::vector<PlacedContact> contacts;  ///< of the last tick
  std::vector<RubbedPair> rubbed;       ///< at the last tick
  std::vector<CarvedGroup> carved;      ///< of each group; empty where nothing is textured
  PlacedTool now;                       ///< the virtual tool at this tick
  PlacedTool before, turned;            ///< the current ideal tool, before and after its turn
  ToolPose last;                        ///< the virtual tool at the last tick
  ToolPose near_pose;                   ///< the same, when near_parts was rebuilt
  ToolPose nearby_pose;                 ///< the same, when nearby was listed
  bool exceptions = false;              ///< some object is off or lags, or a layer broke
  double reach = 0;                     ///< m, from the virtual tool to the farthest ideal tool
  double most_lag = 0;                  ///< rad, of the ideal tools of this tick
  std::uint32_t most_behind = 0;        ///< the group with that lag
  std::uint64_t full_scans = 0;         ///< scans of all facets of a part, due to rounding
};

}  // namespace palpate::rendering
