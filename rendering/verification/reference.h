#pragma once
// The exact yardstick of rendering: every facet is visited. Independent of facet_walk on purpose;
// it shares the mesh and nothing else. For checks, not for the servo.

#include <optional>

#include "rendering/contact.h"
#include "stimuli/convex_mesh.h"

namespace palpate::rendering {

/// Penetration of the segment into the mesh: the smallest translation that separates them, over all
/// facets of M = mesh (+) (-segment) (its faces: facets of the mesh with the deeper end, silhouette
/// edges with the probe's direction). Negative when they do not touch: then only the sign counts.
/// Mesh frame. For a point, pass tip == tail.
struct ReferenceDepth {
  double depth = 0;  ///< m
  Vec3 normal;       ///< unit, of the facet of M that attains it
};
ReferenceDepth reference_depth(const stimuli::ConvexMesh& mesh, const LineProbe& probe);

/// Exact distance between the segment and the solid: positive outside, 0 when they touch or
/// overlap.
double reference_gap(const stimuli::ConvexMesh& mesh, const LineProbe& probe);

/// First time in [0, 1] at which the probe, its ends moving linearly from `before` to `after`,
/// penetrates by more than 1e-12 of the mesh's size (touching is not penetrating); found by
/// stepping `steps` times and then bisecting to rounding. Empty when no step ends inside.
std::optional<double> reference_first_contact(const stimuli::ConvexMesh& mesh,
                                              const LineProbe& before, const LineProbe& after,
                                              int steps);

}  // namespace palpate::rendering
