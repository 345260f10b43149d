#pragma once
// Equation (2) of Ho, Basdogan & Srinivasan 2000 where a segment lies along several faces at once:
// faces of one part that meet at less than twice the blend angle, and faces of parts that abut.

#include <cstddef>
#include <span>

#include "rendering/contact.h"
#include "rendering/facet_walk.h"
#include "rendering/scene.h"

namespace palpate::rendering {

/// A part and a segment in contact with it. Mesh frame, m.
struct FacedPart {
  const ScenePart* part = nullptr;
  ContactFeature feature;  ///< any near the segment; kind none is slower
  Vec3 ideal, d;           ///< the ideal segment from ideal to ideal + d
};

/// Further parts are ignored.
inline constexpr std::size_t kMostFacedParts = 32;

/// Places the contact of a segment on the faces that it lies along. For each face the point of (2)
/// moves from the beginning of its touching portion to the end while the segment turns through the
/// face's plane; the shifts of all faces add up, from the point where no face has moved it. One
/// face gives (2), coplanar faces give (2) over their union, and the point never jumps from face to
/// face.
/// \param parts      of the same object; the first carries the contact
/// \param hit        the contact's feature, measured
/// \param tolerance  m, between faces that abut
/// \param c          as by (2) over one face; changed if two or more faces are within the blend
///                   angle
void spread_over_faces(std::span<const FacedPart> parts, const WalkResult& hit, double tolerance,
                       LoadedContact& c);

/// Equation (2) where a segment lies along the border of a face, within rounding. The portion over
/// the face may then be empty, and the contact would be at an end of the segment far from the face.
/// \param hit    the contact's feature, measured
/// \param tip    of the ideal segment, from tip to tip + d, of that length
/// \param slack  m, by which the face's polygon is enlarged
/// \param c      changed if the segment is within the blend angle of the face
void place_along_border(const stimuli::ConvexMesh& mesh, const WalkResult& hit, const Vec3& tip,
                        const Vec3& d, double length, double slack, LoadedContact& c);

}  // namespace palpate::rendering
