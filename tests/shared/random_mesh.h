#pragma once
// Meshes of every kind and size that renderers must cope with.

#include <cmath>
#include <memory>

#include "data/base/random.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/primitives.h"
#include "tests/shared/probe_paths.h"
#include "tests/shared/random_polyhedron.h"

namespace palpate::testing {

/// Round, long or flat hulls, prisms, needles, plates and the four stimuli, turned at random, from
/// 0.2 mm to 20 m across, and up to a size away from the mesh frame's origin.
inline stimuli::ConvexMesh random_convex_mesh(Random& random) {
  const auto turned = [&](const stimuli::PolygonSoup& soup) {
    const double scale = 2e-4 * std::pow(1e5, random.unit());
    return stimuli::ConvexMesh(placed(soup, stimuli::uniform_rotation(random), scale,
                                      scale * random.unit() * random_direction(random)));
  };
  const auto count = [&](int low, int high) {
    return low + static_cast<int>(random.below(static_cast<std::uint64_t>(high - low + 1)));
  };
  switch (random.below(10)) {
    case 0:
      return turned(random_polyhedron(random, count(4, 8), Vec3(0.5, 0.5, 0.5)));
    case 1:
      return turned(random_polyhedron(random, count(10, 60), Vec3(0.5, 0.5, 0.5)));
    case 2:
      return turned(random_polyhedron(random, count(6, 40), Vec3(0.5, 0.3, 0.02)));
    case 3:
      return turned(random_polyhedron(random, count(6, 40), Vec3(0.5, 0.02, 0.03)));
    case 4:
      return turned(prism(count(3, 24), 0.5, uniform(random, 0.05, 2)));
    case 5:
      return turned(needle(1, uniform(random, 0.003, 0.1)));
    case 6:
      return turned(plate(1, uniform(random, 0.001, 0.05)));
    case 7:
      return turned(stimuli::cone(0.5, uniform(random, 0.1, 2), count(3, 64)));
    case 8:
      return turned(stimuli::icosphere(0.5, count(0, 2)));
    default:
      return turned(stimuli::cube(1));
  }
}

}  // namespace palpate::testing
