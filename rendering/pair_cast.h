#pragma once
// One convex part C and one segment S of a tool, whose orientation stays as it is: where the
// segment lies to M = C (+) (-S), and where a translation of it first meets M. The same steps from
// facet to neighbouring facet of M as the walk (facet_walk.h). Mesh frame, m.

#include <cstdint>

#include "rendering/facet_walk.h"
#include "rendering/first_contact.h"

namespace palpate::rendering {

/// A part with what finds its way on it.
struct CastMesh {
  const stimuli::ConvexMesh& mesh;
  const ContactTrees& trees;
  Vec3 inside;  ///< m, a point well inside of it
  /// Counts the looks at every facet of M, which rounding asks for now and then.
  std::uint64_t& full_scans;
};

/// The facet of M that holds the segment, or whose plane separates it (WalkResult::depth < 0).
/// \param start  any feature, at best near the one in question; none: begins under the segment
/// \param d      the segment from tip to tip + d; zero or below rounding: a point
WalkResult locate(const CastMesh& part, ContactFeature start, const Vec3& tip, const Vec3& d);

/// The first meeting of a straight motion with M.
struct PairCast {
  bool hit = false;
  double time = 1;         ///< hit: of the motion, 0 to 1, never too late
  ContactFeature feature;  ///< hit: the facet of M that is entered; else one that separates at last
};

/// The line is clipped by planes of facets of M: that of a facet seen from the line's beginning is
/// met no later than M itself, and past a side of the facet that of its neighbour is met later. So
/// wherever the steps end, the segment has not entered M before. Exact, whatever the length of the
/// motion.
/// \param start  as above
/// \param motion of the segment; it is outside of M at first (else it is hit at time 0)
PairCast cast(const CastMesh& part, ContactFeature start, const Vec3& tip, const Vec3& d,
              const Vec3& motion);

/// m; how far the segment, moved along the feature's normal onto it, is off the feature itself.
double distance_off(const stimuli::ConvexMesh& mesh, ContactFeature feature, const Vec3& tip,
                    const Vec3& d);

/// The facet of M past the side of the feature that the segment, moved along the feature's normal
/// onto it, is past. Of kind none where it is past none.
ContactFeature feature_beyond(const stimuli::ConvexMesh& mesh, ContactFeature feature,
                              const Vec3& tip, const Vec3& d);

/// The same feature, measured wherever the segment is; one that is no facet of M any more since the
/// segment has turned gives way to the facet that its normal has become.
WalkResult measure(const stimuli::ConvexMesh& mesh, ContactFeature feature, const Vec3& tip,
                   const Vec3& d);

}  // namespace palpate::rendering
