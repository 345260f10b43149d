#pragma once
// The contact law for unions: any tool of straight segments against an object of convex parts, by
// one god-object, the ideal tool.
//
// For a fixed orientation of the tool, the translations that bring segment S_j into touch with part
// C_i are the boundary of M_ij = C_i (+) (-S_j), and those of the whole tool with the object are
// the boundary of the union of all M_ij. So the ideal tool is one point, its translation, against a
// union of convex sets. Each tick it turns as the virtual tool did, moves as near to it as planes
// and straight casts allow, and is never inside of any part.
//
// Zilles & Salisbury 1995 (god-object, active planes), Ortega, Redon & Coquillart 2007 (6-DoF
// god-object). Departs: the constraints are facets of Minkowski sums, so no contact points are
// sampled, and casts against them are exact.
//
// World frame, SI units. Nothing here throws, allocates, locks or does I/O.

#include <cstddef>
#include <cstdint>

#include "rendering/renderer.h"

namespace palpate::rendering {

/// An ideal tool that lags behind the stylus by more than this angle (5 degrees, in rad) for longer
/// than this time (s) is hooked and is let go of. Below these limits it passes a wedge or rattles;
/// above them the tool would show another direction than the hand feels.
inline constexpr double kMostLag = 0.0872664625997165;
inline constexpr double kMostLagTime = 0.01;

/// The input of the law in one tick.
struct UnionTick {
  const Scene& scene;
  RenderState& state;
  const ToolPose& tool;  ///< the virtual tool
  bool sides;            ///< false: the tip alone touches
  double dt;             ///< s since the last tick
  std::uint32_t faults = 0;
};

/// The wrench of all placed contacts, its split on two devices, and the ideal tool of the deepest
/// contact.
Rendering sum_unions(const UnionTick& tick, const LineProbe& probe);

/// The force for the device at the tail, where contacts may be off the stylus's axis. With u the
/// unit vector from tip to tail and T the torque about the tip, L u x F2 must be T except for
/// torsion about u. So F2 across u is (T x u) / L. Along u, (4) and (5) hold with r_i, the
/// contact's lever along u, which may be negative or beyond L.
/// \param torque  N m, about the tip
/// \param along   N m, sum of each contact's lever along the stylus times its force along it
/// \param d       tail - tip, m
Vec3 tail_force(const Vec3& torque, double along, const Vec3& d);

/// Follows the ideal tool of one group and appends its contacts, with spring forces, to
/// state.unions.contacts.
void follow_ideal_tool(UnionTick& tick, std::uint32_t group);

/// Remembers an ideal tool for the next tick: its pose, how far its turn lags behind, and the mean
/// place of its contacts, about which it turns then.
/// \param pose   its orientation
/// \param shift  m, from the virtual tool
/// \param held   by a plane
/// \param first_contact  index of its first one in state.unions.contacts
void remember_ideal_tool(UnionTick& tick, std::uint32_t group, const ToolPose& pose,
                         const Vec3& shift, bool held, std::size_t first_contact);

/// Whether the virtual tool is inside of a part of the group.
bool inside_group(UnionTick& tick, std::uint32_t group);

/// s; an object lets go of the tool if the trial began inside it, the tool is hooked, or a layer
/// breaks. The released force fades instead of stepping, and takes this long to fall to zero: from
/// 6 N, 0.3 N a tick at 1 kHz, less than the force limiter allows.
inline constexpr double kFadeTime = 0.02;

/// Call before the ideal tools are followed. Switches off objects that contain the virtual tool at
/// the very first tick, and switches objects back on that have been left.
void update_objects(UnionTick& tick);

/// Whether the group gives no force now, or never does because it only bounds its object.
bool is_off(const UnionTick& tick, const PartGroup& group);

/// Call after material forces. Reduces the contact forces of hooked objects and broken layers.
void fade_forces(UnionTick& tick);

}  // namespace palpate::rendering
