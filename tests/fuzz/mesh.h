#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "stimuli/mesh_file.h"
#include "stimuli/parts/convex_parts.h"
#include "tests/fuzz/feel.h"
#include "tests/fuzz/input_file.h"

namespace palpate::testing {

/// Whatever a mesh file holds: it is refused with the reason, or it can be felt.
inline void feel_mesh_file(const std::string& path) {
  try {
    std::vector<rendering::SceneObject> parts;
    for (stimuli::ConvexMesh& part : stimuli::convex_parts(stimuli::read_mesh_file(path))) {
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
