#pragma once
// What the console's view draws: triangles with flat normals, virtual frame, m.

#include <glm/vec3.hpp>
#include <memory>
#include <vector>

#include "stimuli/object_spec.h"

namespace palpate::runner {

struct DrawnCorner {
  glm::vec3 position;  ///< m
  glm::vec3 normal;    ///< unit, outward
};
using DrawnMesh = std::vector<DrawnCorner>;  ///< three corners a triangle

/// Compounds with all their parts. \throws MeshError, std::runtime_error where a file is no mesh
DrawnMesh drawn(const std::vector<stimuli::ObjectSpec>& objects);

DrawnMesh unit_cylinder();  ///< radius 1, from z = 0 to z = 1, without ends
DrawnMesh unit_cone();      ///< radius 1 at z = 0, apex at z = 1
DrawnMesh unit_ball();      ///< radius 1

}  // namespace palpate::runner
