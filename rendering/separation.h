#pragma once
// Separating planes between probe and object: while one is valid, no other computation is needed
// for that object. Mesh frame, SI units.

#include <cstdint>
#include <glm/geometric.hpp>

#include "stimuli/vec.h"

namespace palpate::stimuli {
class ConvexMesh;
class SupportMap;
}  // namespace palpate::stimuli

namespace palpate::rendering {

/// The object lies within dot(normal, p) <= offset.
struct SeparatingPlane {
  Vec3 normal;        ///< unit, from the object to the probe
  double offset = 0;  ///< m
  bool valid = false;

  /// Both ends, hence the whole probe, are beyond the plane (and so all poses between two such).
  bool separates(const Vec3& tip, const Vec3& tail) const {
    return valid && glm::dot(normal, tip) > offset && glm::dot(normal, tail) > offset;
  }
};

/// Searches for a separating plane between the mesh and the segment, starting from `plane.normal`
/// (any direction if there is none) and the vertex `support`; updates both and sets plane.valid.
/// Gilbert, Johnson & Keerthi 1988 (GJK), stopped at the first direction that gives at least half
/// of the distance.
/// \param tolerance  m; a probe no deeper than this is at the surface: the plane that it touches
/// counts, although it does not separate strictly
/// \param map  of the mesh, the start of hill climbing; or null
void find_separating_plane(const stimuli::ConvexMesh& mesh, const Vec3& tip, const Vec3& tail,
                           double tolerance, SeparatingPlane& plane, std::uint32_t& support,
                           const stimuli::SupportMap* map = nullptr);

}  // namespace palpate::rendering
