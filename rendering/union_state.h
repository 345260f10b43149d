#pragma once
// What the contact law of unions (union_contact.h) knows of a scene, and what it remembers between
// ticks. World frame and SI units unless said otherwise.

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "rendering/active_planes.h"
#include "rendering/facet_walk.h"
#include "rendering/force.h"
#include "rendering/separation.h"
#include "rendering/surface_state.h"
#include "rendering/tool_pose.h"

namespace palpate::rendering {

/// What has one ideal tool: the convex parts of an object's surface or of one of its layers, side
/// by side, or a closed surface.
struct PartGroup {
  std::uint32_t first_part = 0, part_count = 0;  ///< in the scene, side by side
  std::uint32_t first_pair = 0;  ///< of part k and segment j: first_pair + k * segments + j
  std::uint32_t object_state = 0;
  int object = 0;
  bool by_law = false;  ///< else a single part without a tool, which the walk alone renders
  bool felt = true;     ///< false: it has no force and only says what is inside of the object
  double skin = 0;      ///< m; the ideal tool keeps this distance from what it rests on
  static constexpr std::uint32_t kParts = 0xffffffff;
  std::uint32_t surface = kParts;  ///< index in Scene::surfaces(); kParts: it is of convex parts
};

/// Parts of one group that give way together: a layer, or in a compound what has equal bounds of
/// it.
struct BreakingParts {
  std::uint32_t object_state = 0;
  double force = 0;  ///< N; what they bear
  std::uint32_t group = 0;
};

/// One part and one segment of the tool.
struct PairState {
  ContactFeature feature;  ///< facet of M that separated the two at last, or carries the ideal tool
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
  double lag = 0;  ///< rad, by which it is behind the virtual tool in turning
  double strength = 1;      ///< of what is left to hold it since parts that gave way have gone
  double last_force = 0;    ///< N, of all contacts with the group when they went
  bool parts_went = false;  ///< at the last tick
};

/// What is remembered of BreakingParts.
struct BreakState {
  bool giving_way = false;  ///< they broke: their force falls, until the object is left
  bool was_left = false;    ///< at the last tick: they are whole from now on
  double strength = 1;      ///< what is left of their force; 0: they are not there
  Vec3 force;               ///< N, of this tick's contacts with them
};

/// What the ideal tools of one object share.
struct ObjectState {
  bool off = false;             ///< no force until the object has been left once
  bool started_inside = false;  ///< that is why it is off
  bool just_left = false;       ///< in this tick: its ideal tools begin at the virtual one
  bool releasing = false;       ///< hooked: its force falls
  double strength = 1;          ///< what is left of its force
  double lag = 0;               ///< rad, of its ideal tools at the last tick, the largest
  double lagging = 0;           ///< s, since when that is too far
};

/// A pair that the ideal tool can reach in this tick.
struct NearPair {
  std::uint32_t part = 0, pair = 0;  ///< indices in the scene and in RenderState::pairs
  std::uint32_t segment = 0;
  /// The segment where the tip of the tool is the virtual tip. Mesh frame, in which the part is
  /// larger by its margin (ScenePart::shrink), m.
  Vec3 tip, d;
  Vec3 true_tip, true_d;  ///< the same without the margin
  /// World frame: the plane of an earlier tick, where there is one. With its tip at the virtual one
  /// plus y, the segment is dot(normal, y) + height above it, m, and apart where that is positive.
  Vec3 normal;
  double offset = 0, height = 0;
  bool has_plane = false;
  bool was_apart = false;    ///< by that plane, at the pose that the tool comes from
  bool was_cast = false;     ///< the plane did not do: it is renewed
  Vec3 parted_at;            ///< m, where it last let go of the ideal tool in this tick
  bool parted = false;       ///< it did
  bool carries = false;      ///< has a plane in use
  ContactFeature came_with;  ///< the pair's feature at the last tick
};

/// A contact of several, with where it is.
struct PlacedContact {
  LoadedContact loaded;
  Vec3 shift;   ///< m, from the virtual to the ideal tool, without friction
  Vec3 place;   ///< m, on the ideal tool, world frame
  Vec3 motion;  ///< m, of that place of the virtual tool since the last tick
  std::uint32_t group = 0;
  std::uint32_t pair = 0;  ///< by_law groups only
  int segment = 0;
  bool by_law = false;
};

/// A pair that friction acted on.
struct RubbedPair {
  std::uint32_t group = 0, pair = 0;
};

/// Memory of the law beside that of single parts.
struct UnionMemory {
  std::vector<PairState> pairs;
  std::vector<GroupState> groups;
  std::vector<ObjectState> objects;
  std::vector<BreakState> breaking;
  std::vector<SurfaceState> surfaces;
  std::vector<NearPair> near;           ///< of the group in hand
  std::vector<PlacedContact> contacts;  ///< of the last tick
  std::vector<RubbedPair> rubbed;       ///< at the last tick
  PlacedTool now;                       ///< the virtual tool at this tick
  PlacedTool before, turned;            ///< the ideal tool in hand, before it turns and turned
  ToolPose last;                        ///< the virtual tool at the last tick
  ToolPose near_pose;                   ///< the same when the list of near parts was rebuilt
  ToolPose nearby_pose;                 ///< the same of the nearby parts
  bool exceptions = false;              ///< some object is off or behind, or some layer broken
  double reach = 0;                     ///< m, from the virtual tool to the farthest ideal tool
  double most_lag = 0;                  ///< rad, of the ideal tools of this tick
  std::uint32_t most_behind = 0;        ///< the group whose lag that is
  std::uint64_t full_scans = 0;         ///< looks at all facets of a part, for rounding
};

}  // namespace palpate::rendering
