#pragma once
// The contact law of unions (union_contact.h): its view of a scene, and its state between ticks.
// World frame and SI units unless said otherwise.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "rendering/active_planes.h"
#include "rendering/contact.h"
#include "rendering/contact_feature.h"
#include "rendering/separation.h"
#include "rendering/surface_state.h"
#include "rendering/tool.h"
#include "stimuli/vec.h"

namespace palpate::rendering {

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
