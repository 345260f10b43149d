#pragma once
// Random paths of a probe over one convex mesh, meant to be hard for a renderer. For searches and
// extreme cases. Mesh frame, m.

#include <cstddef>
#include <vector>

#include "data/base/random.h"
#include "rendering/probe.h"
#include "stimuli/convex_mesh.h"

namespace palpate::runner::evidence {

enum class PathKind {
  smooth,   ///< a hand that wanders in and out, 1e-4 to 0.03 sizes a tick
  sliding,  ///< always near the surface, from just outside to beyond the middle
  fast,     ///< straight past and through, 5 m/s or 0.01 to 3 sizes a tick, turning
  plunges,  ///< from outside, by 1e-16 to 1 sizes, straight in and out again
  jumps,    ///< an unrelated pose at every tick
  aligned,  ///< along edges, in planes of facets, through corners: exactly or nearly
};
inline constexpr int kPathKinds = 6;
const char* to_string(PathKind kind);

/// The first pose is far outside; 1 kHz.
/// \param length  m, of the probe
/// \param side    false: the tip moves over the surface, not the side
std::vector<rendering::LineProbe> random_path(Random& random, PathKind kind,
                                              const stimuli::ConvexMesh& mesh, double length,
                                              bool side, std::size_t ticks);

}  // namespace palpate::runner::evidence
