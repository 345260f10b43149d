#pragma once
// Exact penetration depths of a segment in the analytic shapes and in polyhedra: all local minima
// over directions. For checks, not for the servo. Frame of the object, SI units.
//
// The depth of the segment a..b along a unit vector n is phi(n) = h(n) - min(n.a, n.b), with h the
// object's support function: moving the segment by phi(n) n just separates it, by the plane with
// normal n. The least phi over all n is the penetration depth. A god-object holds the local minimum
// on the side by which it entered, which is not always the least. So a method's result is compared
// with the local minimum nearest to it in direction; whether that is the least is counted
// separately.

#include <vector>

#include "rendering/probe.h"
#include "stimuli/shapes.h"
#include "stimuli/vec.h"

namespace palpate::stimuli {
class ConvexMesh;
}

namespace palpate::runner::evidence {

/// A local minimum of phi.
struct LocalDepth {
  Vec3 normal;                ///< unit, out of the object
  double depth = 0;           ///< m
  double probe_fraction = 0;  ///< of the contact point on the probe: 0 tip to 1 tail
  /// rad; the least angle between the probe and a flat of the object (plane or straight line of its
  /// surface) next to the contact. At 0 the probe lies on the flat, and the contact point is
  /// undefined along it: compare points only well above 0. Pi/2 if nothing is flat, and for a
  /// point.
  double flat_angle = 0;
};

/// All local minima in the analytic sphere, cone, cylinder, cube or box (pose and tessellation are
/// not used), least first; empty when the probe is not inside. If a whole ring of directions is
/// equal by symmetry, one of them is given. tip == tail is a point.
/// \throws std::invalid_argument for a mesh or compound.
std::vector<LocalDepth> local_depths(const stimuli::ObjectSpec& primitive,
                                     const rendering::LineProbe& probe);

/// The same for a polyhedron, by visiting all facets and edges; only those with a normal within
/// `angle` (rad) of `towards`.
std::vector<LocalDepth> local_depths(const stimuli::ConvexMesh& mesh,
                                     const rendering::LineProbe& probe, const Vec3& towards,
                                     double angle);

/// m; support function of the analytic shape: its greatest extent along n. |n| need not be 1.
double support(const stimuli::ObjectSpec& primitive, const Vec3& n);

/// phi of the analytic shape, m; n unit.
double depth_along(const stimuli::ObjectSpec& primitive, const rendering::LineProbe& probe,
                   const Vec3& n);

}  // namespace palpate::runner::evidence
