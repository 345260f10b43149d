#pragma once
// Equation (2) of Ho, Basdogan & Srinivasan 2000 where a segment lies along several faces at once:
// faces of one part that meet at less than twice the blend angle, and faces of parts that abut.

#include <cstddef>
#include <span>

#include "rendering/contact.h"
#include "rendering/facet_walk.h"
#include "rendering/scene.h"

namespace palpate::rendering {

/// A part as a segment in contact has it. Mesh frame, m.
struct FacedPart {
  const ScenePart* part = nullptr;
  ContactFeature feature;  ///< any near the segment; none is slower
  Vec3 ideal, d;           ///< the ideal segment from ideal to ideal + d
};

/// More parts than these have no say.
inline constexpr std::size_t kMostFacedParts = 32;

/// Places the contact of a segment on the faces that it lies along. For each face the point of (2)
/// moves from the beginning of its touching portion to the end while the segment turns through the
/// face's plane; the ways of all faces add up, from the place that no face changes. One face gives
/// (2), coplanar ones give (2) over all of them, and nothing jumps from face to face.
/// \param parts      of the same object; the first carries the contact
/// \param hit        the contact's feature, measured
/// \param tolerance  m, between faces that abut
/// \param c          as (2) over one face has it; changed where two or more are within the blend
///                   angle
void spread_over_faces(std::span<const FacedPart> parts, const WalkResult& hit, double tolerance,
                       LoadedContact& c);

/// Equation (2) where a segment lies along the border of a face, within rounding: the face's
/// portion of it may be empty then, and the contact at an end of the segment that is far from the
/// face.
/// \param hit    the contact's feature, measured
/// \param tip    of the ideal segment, from tip to tip + d, of that length
/// \param slack  m, by which the face's polygon is larger
/// \param c      changed where the segment is within the blend angle of the face
void place_along_border(const stimuli::ConvexMesh& mesh, const WalkResult& hit, const Vec3& tip,
                        const Vec3& d, double length, double slack, LoadedContact& c);

}  // namespace palpate::rendering
