#pragma once
// Meshes for pictures: triangles with normals, m.

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "stimuli/shapes.h"
#include "stimuli/vec.h"

namespace palpate::stimuli {
class ConvexMesh;
}

namespace palpate::runner::display {

struct DrawnVertex {
  glm::vec3 position;  ///< m
  glm::vec3 normal;    ///< unit, outward
  float tint = 0;      ///< 0: the object's colour; 1: the colour of full deformation
};
using DrawnMesh = std::vector<DrawnVertex>;  ///< three corners a triangle

/// The triangles of an object in its own frame (its pose is left out, not those of its parts).
/// Edges flatter than 30 degrees are smoothed. \throws MeshError; std::runtime_error if a file is
/// not a mesh
DrawnMesh triangles_of(const stimuli::ObjectSpec& object);

/// The same triangles, cut finely enough to show a texture by the normals of its surface; their
/// places stay. At most half a million triangles: finer textures are drawn coarsely.
DrawnMesh with_texture(const DrawnMesh& mesh, const stimuli::Texture& texture);

/// A surface of triangles. \param tints  one for each place; empty: none
DrawnMesh surface_mesh(std::span<const Vec3> places,
                       std::span<const std::array<std::uint32_t, 3>> triangles,
                       std::span<const float> tints);

/// Adds the facets of a convex mesh, transformed by `pose`.
void add_facets(const stimuli::ConvexMesh& mesh, const Pose& pose, DrawnMesh& out);

/// Gives corners a common normal where facets meet at less than 30 degrees.
void smooth(DrawnMesh& mesh);

/// Distance along a line to where it first enters the mesh; none: it misses.
std::optional<float> distance_to(const DrawnMesh& mesh, const glm::vec3& from,
                                 const glm::vec3& along);

DrawnMesh unit_cylinder();  ///< radius 1, from z = 0 to z = 1, without ends
DrawnMesh unit_cone();      ///< radius 1 at z = 0, apex at z = 1
DrawnMesh unit_sphere();    ///< radius 1

}  // namespace palpate::runner::display
