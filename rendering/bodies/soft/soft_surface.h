#pragma once
// The moving surface of a soft body, for contact with a tool: triangles, edges and corners. World
// frame, m.

#include <array>
#include <cstdint>
#include <vector>

#include "rendering/bodies/soft/soft_body.h"
#include "stimuli/bounding_tree.h"
#include "stimuli/vec.h"

namespace palpate::rendering {

/// The servo's view of a soft body between two of its steps, by surface node. Under the load of the
/// last step, a node moves from x to x + ahead within a step.
struct SoftView {
  std::vector<Vec3> x, ahead;
  std::vector<Vec3> by_load;  ///< the part of a node's place due to the load, by the compliance
  std::vector<Vec3> normals;  ///< of the triangles, outwards, unit; zero for a flat one
  std::vector<stimuli::Box> boxes;  ///< of the clusters, at x and two steps later
};

/// Immutable.
class SoftSurface {
 public:
  struct Edge {
    std::array<std::uint32_t, 2> nodes;      ///< surface nodes
    std::array<std::uint32_t, 2> triangles;  ///< on both sides
    std::array<bool, 2> owns;                ///< whether contacts at its ends count for this edge
  };
  /// Edges and triangles that are near each other.
  struct Cluster {
    std::uint32_t first_triangle = 0, triangles = 0, first_edge = 0, edges = 0;
  };

  explicit SoftSurface(const SoftBody& body);

  const std::vector<std::array<std::uint32_t, 3>>& triangles() const { return triangles_; }
  const std::vector<Edge>& edges() const { return edges_; }
  const std::vector<Cluster>& clusters() const { return clusters_; }

  SoftView first_view(const SoftBody& body, const SoftState& state) const;
  /// Does not allocate if the view is of this surface.
  void look(const SoftBody& body, const SoftState& state, SoftView& view) const noexcept;

 private:
  std::vector<std::array<std::uint32_t, 3>> triangles_;  ///< surface nodes; by cluster
  std::vector<Edge> edges_;                              ///< by cluster
  std::vector<Cluster> clusters_;
};

}  // namespace palpate::rendering
