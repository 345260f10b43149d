#pragma once

#include <algorithm>
#include <cstdlib>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "stimuli/closed_surface.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/mesh_file.h"
#include "stimuli/parts/convex_parts.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/surfaces/surface.h"
#include "tests/fuzz/feel.h"
#include "tests/fuzz/input_file.h"

namespace palpate::testing {

/// Whatever polygons there are: they are refused with the reason, or every side has a neighbour.
/// \return nullopt: refused
inline std::optional<stimuli::ClosedSurface> close_surface(const stimuli::PolygonSoup& soup) {
  try {
    stimuli::ClosedSurface surface = stimuli::closed_surface(soup).surface;
    for (std::size_t t = 0; t < surface.triangles.size(); ++t) {
      for (std::size_t k = 0; k < 3; ++k) {
        const auto& other = surface.triangles.at(surface.across[t][k]);
        const auto at = std::find(other.begin(), other.end(), surface.triangles[t][(k + 1) % 3]);
        if (at == other.end()) std::abort();
        if (other[static_cast<std::size_t>(at - other.begin() + 1) % 3] != surface.triangles[t][k])
          std::abort();
      }
    }
    return surface;
  } catch (const stimuli::MeshError&) {
    return std::nullopt;
  }
}

/// Whatever a mesh file holds: it is refused with the reason, or it can be felt.
inline void feel_mesh_file(const std::string& path) {
  try {
    const stimuli::PolygonSoup soup = stimuli::read_mesh_file(path);
    std::optional<stimuli::ClosedSurface> closed = close_surface(soup);
    std::vector<rendering::SceneObject> parts;
    std::vector<rendering::SceneSurface> surfaces;
    if (auto convex = stimuli::convex_as_it_is(soup)) {
      for (stimuli::ConvexMesh& part : *convex) {
        rendering::SceneObject object;
        object.mesh = std::make_shared<const stimuli::ConvexMesh>(std::move(part));
        parts.push_back(std::move(object));
      }
    } else if (closed) {
      stimuli::Material material;
      material.stiffness = 1000;
      const std::vector<stimuli::SurfaceShell> shells = {
          {std::make_shared<const stimuli::ClosedSurface>(std::move(*closed)), Pose{}, material,
           0}};
      surfaces.push_back({std::make_shared<const stimuli::Surface>(shells), Pose{}, 0, {}});
    }
    for (const rendering::Renderer* renderer :
         {&rendering::point_renderer(), &rendering::ray_renderer()}) {
      feel(rendering::Scene(parts, renderer->side_contact(), {}, nullptr, surfaces), *renderer);
    }
  } catch (const stimuli::MeshError&) {
  }
}

}  // namespace palpate::testing
