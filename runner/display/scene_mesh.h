#pragma once
// Meshes for the console's view: triangles with normals, virtual frame, m.

#include <glm/vec3.hpp>
#include <memory>
#include <vector>

#include "stimuli/object_spec.h"

namespace palpate::runner {

struct DrawnVertex {
  glm::vec3 position;  ///< m
  glm::vec3 normal;    ///< unit, outward
};
using DrawnMesh = std::vector<DrawnVertex>;  ///< three corners a triangle

/// The triangles of all objects, compounds included. \throws MeshError, std::runtime_error where a
/// file is no mesh
DrawnMesh triangles_of(const std::vector<stimuli::ObjectSpec>& objects);

DrawnMesh unit_cylinder();  ///< radius 1, from z = 0 to z = 1, without ends
DrawnMesh unit_cone();      ///< radius 1 at z = 0, apex at z = 1
DrawnMesh unit_sphere();    ///< radius 1

}  // namespace palpate::runner
