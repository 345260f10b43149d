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
    SceneObject object;
    object.mesh = std::make_shared<const ConvexMesh>(read_mesh_file(path));
    for (const Renderer* renderer : {&point_renderer(), &ray_renderer()}) {
      feel(Scene({object}, renderer->side_contact()), *renderer);
    }
  } catch (const MeshError&) {
  }
}

}  // namespace palpate::testing
