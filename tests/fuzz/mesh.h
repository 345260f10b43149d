#pragma once

#include <memory>

#include "stimuli/convex_mesh.h"
#include "stimuli/mesh_file.h"
#include "tests/fuzz/feel.h"
#include "tests/fuzz/input_file.h"

namespace palpate::testing {

/// Whatever a mesh file holds: it is refused with the reason, or it can be felt.
inline void feel_mesh_file(const std::string& path) {
  try {
    rendering::SceneObject object;
    object.mesh = std::make_shared<const stimuli::ConvexMesh>(stimuli::read_mesh_file(path));
    for (const rendering::Renderer* renderer :
         {&rendering::point_renderer(), &rendering::ray_renderer()}) {
      feel(rendering::Scene({object}, renderer->side_contact()), *renderer);
    }
  } catch (const stimuli::MeshError&) {
  }
}

}  // namespace palpate::testing
