#pragma once
// The exact answer to a renderer's question, for the analytic shapes and for polyhedra: every way
// out of the object that is locally the shortest. For checks, not for the servo.
//
// The depth of the segment a..b along a unit vector n is phi(n) = h(n) - min(n.a, n.b), with h the
// object's support function: moving the segment by phi(n) n just takes it out past the plane with
// normal n. A way out is a local minimum of phi over all n; the least of them is the penetration
// depth. A god-object holds one of them, not always the least: the one it came in by. So an answer
// is compared with the way out that is nearest to it in direction, and whether that is the least
// one is told beside.

#include <vector>

#include "rendering/probe.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/object_spec.h"

namespace palpate::rendering {

/// Frame of the object.
struct WayOut {
  Vec3 normal;       ///< unit, out of the object
  double depth = 0;  ///< m
  double place = 0;  ///< of the contact on the probe: 0 tip to 1 tail
  /// rad; the least angle between the probe and a flat of the object (plane or straight line of its
  /// surface) next to the contact. Where it is 0 the probe lies on the flat and every place on it
  /// is as good: only well above it is the contact point a quantity to compare. Pi/2 where nothing
  /// is flat, and for a point.
  double flat_angle = 0;
};

/// All ways out of the analytic sphere, cone, cylinder or cube (local frame; pose and tessellation
/// are not used), least first; empty when the probe is not inside. Where an axis or centre leaves a
/// whole ring of ways out equal, one of them. tip == tail is a point.
/// \throws std::invalid_argument for a mesh or compound.
std::vector<WayOut> ways_out(const stimuli::ObjectSpec& primitive, const LineProbe& probe);

/// The same of a polyhedron, by visiting all facets and edges; only those with a normal within
/// `angle` (rad) of `towards`.
std::vector<WayOut> ways_out(const stimuli::ConvexMesh& mesh, const LineProbe& probe,
                             const Vec3& towards, double angle);

/// Support function of the analytic shape: the farthest it reaches along n, m; |n| need not be 1.
double support(const stimuli::ObjectSpec& primitive, const Vec3& n);

/// phi of the analytic shape, m; n unit.
double depth_along(const stimuli::ObjectSpec& primitive, const LineProbe& probe, const Vec3& n);

}  // namespace palpate::rendering
