#pragma once

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <utility>
#include <vector>

#include "stimuli/closed_surface.h"
#include "stimuli/mesh_file.h"
#include "stimuli/parts/convex_parts.h"
#include "stimuli/polygon_soup.h"
#include "tests/fuzz/feel.h"
#include "tests/fuzz/input_file.h"

namespace palpate::testing {

/// Whatever polygons there are: they are refused with the reason, or every side has a neighbour.
inline void close_surface(const stimuli::PolygonSoup& soup) {
  try {
    const stimuli::ClosedSurface surface = stimuli::closed_surface(soup).surface;
    for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
      for (std::size_t k = 0; k < 3; ++k) {
        const auto& other = surface.triangles.at(surface.across[t][k]);
        const auto at = std::find(other.begin(), other.end(), surface.triangles[t][(k + 1) % 3]);
        if (at == other.end()) std::abort();
        if (other[static_cast<std::size_t>(at - other.begin() + 1) % 3] != surface.triangles[t][k])
          std::abort();
      }
    }
  } catch (const stimuli::MeshError&) {
  }
}

/// Whatever a mesh file holds: it is refused with the reason, or it can be felt.
inline void feel_mesh_file(const std::string& path) {
  try {
    const stimuli::PolygonSoup soup = stimuli::read_mesh_file(path);
    close_surface(soup);
    std::vector<rendering::SceneObject> parts;
    for (stimuli::ConvexMesh& part : stimuli::convex_parts(soup)) {
      rendering::SceneObject object;
      object.mesh = std::make_shared<const stimuli::ConvexMesh>(std::move(part));
      parts.push_back(std::move(object));
    }
    for (const rendering::Renderer* renderer :
         {&rendering::point_renderer(), &rendering::ray_renderer()}) {
      feel(rendering::Scene(parts, renderer->side_contact()), *renderer);
    }
  } catch (const stimuli::MeshError&) {
  }
}

}  // namespace palpate::testing
