#pragma once
// Stimuli without a formula, as the simulated participant models them.

#include <memory>
#include <utility>
#include <vector>

#include "runner/participants/distance_field.h"
#include "stimuli/closed_surface.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/parts/convex_parts.h"
#include "stimuli/polygon_soup.h"
#include "tests/stimuli/concave_solids.h"

namespace palpate::runner::participants::test {

inline std::vector<PlacedPart> placed(const stimuli::PolygonSoup& soup, const Vec3& shift = {}) {
  const Pose pose{shift, Quat(1, 0, 0, 0)};
  std::vector<PlacedPart> placed;
  if (auto parts = stimuli::convex_as_it_is(soup)) {
    for (stimuli::ConvexMesh& part : *parts)
      placed.push_back({std::make_shared<const stimuli::ConvexMesh>(std::move(part)), pose});
  } else {
    placed.push_back(
        {nullptr, pose,
         std::make_shared<const stimuli::ClosedSurface>(stimuli::closed_surface(soup).surface)});
  }
  return placed;
}

inline double distance_at(const DistanceField& field, const Vec3& p) {
  return field.distance(static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z));
}

/// Exact, of a prism on an outline from z = 0 to height.
inline double distance_to_prism(const stimuli::solids::Outline& outline, double height,
                                const Vec3& p) {
  double across = 1e300;
  for (std::size_t k = 0; k < outline.size(); ++k) {
    const auto& a = outline[k];
    const auto& b = outline[(k + 1) % outline.size()];
    const double ux = b[0] - a[0], uy = b[1] - a[1];
    const double t =
        std::min(1.0, std::max(0.0, ((p.x - a[0]) * ux + (p.y - a[1]) * uy) / (ux * ux + uy * uy)));
    across = std::min(across, std::hypot(p.x - a[0] - t * ux, p.y - a[1] - t * uy));
  }
  if (stimuli::solids::in_outline(outline, p.x, p.y)) across = -across;
  const double along = std::abs(p.z - height / 2) - height / 2;
  return std::hypot(std::max(across, 0.0), std::max(along, 0.0)) +
         std::min(std::max(across, along), 0.0);
}

}  // namespace palpate::runner::participants::test
