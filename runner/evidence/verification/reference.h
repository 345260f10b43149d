#pragma once
// Brute-force reference: penetration depth, distance and time of impact over all facets and edges.
// Deliberately independent of facet_walk: it shares only the mesh. For checks, not for the servo.
// Mesh frame, SI units.

#include <optional>

#include "rendering/contact.h"
#include "stimuli/vec.h"

namespace palpate::stimuli {
class ConvexMesh;
}

namespace palpate::runner::evidence {

/// Penetration depth of the segment in the mesh: the shortest translation that separates them, over
/// all facets of M = mesh (+) (-segment) (facet_walk.h). Negative when they do not touch; then only
/// the sign is meaningful. For a point, pass tip == tail.
struct ReferenceDepth {
  double depth = 0;  ///< m
  Vec3 normal;       ///< unit, of the facet of M that attains it
};
ReferenceDepth reference_depth(const stimuli::ConvexMesh& mesh, const rendering::LineProbe& probe);

/// Exact distance between the segment and the solid: positive outside, 0 when they touch or
/// overlap.
double reference_gap(const stimuli::ConvexMesh& mesh, const rendering::LineProbe& probe);

/// Time of impact: the first time in [0, 1] at which the probe, its ends moving linearly from
/// `before` to `after`, penetrates by more than 1e-12 of the mesh's size (touching is not
/// penetrating); found by stepping `steps` times and then bisecting to rounding. Empty when no step
/// ends inside.
std::optional<double> reference_first_contact(const stimuli::ConvexMesh& mesh,
                                              const rendering::LineProbe& before,
                                              const rendering::LineProbe& after, int steps);

}  // namespace palpate::runner::evidence
