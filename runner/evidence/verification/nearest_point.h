#pragma once
// By brute force, for the search for wrong ticks: the facet of M (facet_walk.h) through which a
// probe enters, over all facets and edges of the mesh, and the point above some planes that is
// nearest to a given one, over every vertex, edge and face that the planes can form. Not for the
// servo.

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "rendering/probe.h"
#include "runner/evidence/verification/reference.h"
#include "stimuli/vec.h"

namespace palpate::stimuli {
class ConvexMesh;
}

namespace palpate::runner::evidence {

/// Sizes of the object; depths that differ by less may be those of neighbouring facets of M.
inline constexpr double kNeighbouringDepths = 1e-4;

/// Whether some facet's plane has both poses on its outer side, hence all poses between them.
bool separated_by_facet_plane(const stimuli::ConvexMesh& mesh, const rendering::LineProbe& before,
                              const rendering::LineProbe& after);

/// Outward normal and depth of one facet of M (a facet of the mesh with the deeper end, or an edge)
/// for a probe; edges that are not silhouette edges have none. Mesh frame.
std::optional<ReferenceDepth> measure_feature(const stimuli::ConvexMesh& mesh, bool is_edge,
                                              std::uint32_t i, const rendering::LineProbe& probe);

/// The facet of M through which the probe enters, if it is unambiguous.
struct EntryFeature {
  bool is_edge = false;
  std::uint32_t index = 0;
};
std::optional<EntryFeature> entry_feature(const stimuli::ConvexMesh& mesh,
                                          const rendering::LineProbe& probe);

/// The points x with dot(normal, x) >= offset.
struct HalfSpace {
  Vec3 normal;  ///< unit
  double offset = 0;
};

struct NearestPoint {
  Vec3 point;
  /// m, one for each plane: point = from + sum of multiplier * normal; none is negative
  std::vector<double> multipliers;
};

/// \param tolerance  a point this far below a plane still counts as above it
/// \return empty when no point is above all of them, or rounding hides it
std::optional<NearestPoint> nearest_point(const Vec3& from, std::span<const HalfSpace> planes,
                                          double tolerance);

/// m, from a vector to the cone of non-negative sums of the normals. In 3 dimensions the nearest
/// sum has at most three terms; all such sums are tried.
/// \param normals        unit
/// \param most_multiple  of a normal, in lengths of the vector: beyond 1e5 opposite normals hold
///                       anything across them
double distance_to_cone(const Vec3& vector, std::span<const Vec3> normals,
                        double most_multiple = 1e5);

}  // namespace palpate::runner::evidence
