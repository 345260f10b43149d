#pragma once
// The surface of a layer: the points of a solid that lie a given depth below its surface. One
// frame, SI units.

#include "stimuli/closed_surface.h"
#include "stimuli/layers/solid_depth.h"

namespace palpate::stimuli {

/// Of the depth; a hand tells depths apart that differ by a tenth. Triangles are divided until they
/// are so exact at their middles.
inline constexpr double kLayerError = 0.03;

struct LayerSurface {
  ClosedSurface surface;  ///< without triangles: nothing is left
  double error = 0;       ///< m; the most found by which its depth differs from the one asked for
};

/// All points of the solid at least `depth` (m, above 0) below its surface. Exact under plane faces
/// and convex edges; round under concave ones, where triangles approximate it, divided for
/// kLayerError until they are too many. What is less than that deeper than `depth` may be missing.
/// \param within  the part of the solid that has the layer; it ends kLayerError beyond that
/// \throws MeshError if what is left is no closed surface
LayerSurface layer_surface(const SolidDepth& solid, double depth,
                           const SolidDepth* within = nullptr);

/// m; at this depth a layer is left, at one that is a ninth deeper none is.
/// \param within  only in that part of the solid
double deepest_layer(const SolidDepth& solid, const SolidDepth* within = nullptr);

}  // namespace palpate::stimuli
