#pragma once
// A solid cut into finite elements, and its surface. Frame of the object, m.

#include <array>
#include <cstdint>
#include <vector>

#include "stimuli/shapes.h"
#include "stimuli/vec.h"

namespace palpate::stimuli {

/// Corners 0 to 3 counter-clockwise seen from 4 to 7, which lie over them.
using Hexahedron = std::array<std::uint32_t, 8>;
/// Corners 0 to 3, then the middles of the edges 01, 12, 02, 03, 13, 23; seen from corner 3 the
/// corners 0, 1, 2 are counter-clockwise.
using QuadraticTetrahedron = std::array<std::uint32_t, 10>;
using SolidFace = std::array<std::uint32_t, 3>;  ///< nodes, counter-clockwise from outside

struct SolidMesh {
  std::vector<Vec3> nodes;
  std::vector<Hexahedron> hexahedra;
  std::vector<QuadraticTetrahedron> tetrahedra;
};

/// Elements along the longest side (of a ball or a disc: along the diameter).
inline constexpr int kLeastResolution = 2, kMostResolution = 24;

/// Hexahedra of a cube, box, sphere or cylinder; the number of elements along a side follows from
/// its length, at least two.
/// \param resolution  kLeastResolution to kMostResolution
/// \throws std::invalid_argument: another shape
SolidMesh mesh_of_primitive(const ObjectSpec& spec, int resolution);

/// A box of that many elements along each axis, centred.
SolidMesh mesh_of_box(const Vec3& size, const std::array<int, 3>& counts);

/// The triangles that bound the solid: two for each face of a hexahedron that no other shares, four
/// for a quadratic tetrahedron's.
std::vector<SolidFace> surface_of(const SolidMesh& mesh);

}  // namespace palpate::stimuli
