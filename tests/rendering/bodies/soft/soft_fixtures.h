#pragma once
// Nodes of soft bodies: which to fix, and how far they have moved.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <vector>

#include "rendering/bodies/soft/soft_body.h"

namespace palpate::rendering {

/// Nodes no higher than z, m.
inline std::vector<std::uint32_t> nodes_below(const stimuli::SolidMesh& mesh, double z) {
  std::vector<std::uint32_t> below;
  for (std::uint32_t i = 0; i < mesh.nodes.size(); ++i) {
    if (mesh.nodes[i].z <= z) below.push_back(i);
  }
  return below;
}

/// m, the greatest distance between nodes of equal number.
inline double farthest(const std::vector<Vec3>& a, const std::vector<Vec3>& b) {
  double most = 0;
  for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, glm::distance(a[i], b[i]));
  return most;
}

}  // namespace palpate::rendering
