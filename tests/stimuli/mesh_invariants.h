#pragma once
// All invariants of ConvexMesh, checked exhaustively.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <limits>
#include <utility>
#include <vector>

#include "stimuli/convex_mesh.h"

namespace palpate::stimuli::checks {

/// Where side `k` of a facet begins.
inline std::uint32_t corner_of(const ConvexMesh& mesh, std::uint32_t facet, std::uint32_t k) {
  const Facet& f = mesh.facets()[facet];
  const Edge& edge = mesh.edges()[mesh.sides()[f.first_side + k % f.side_count].edge];
  return edge.left == facet ? edge.v0 : edge.v1;
}

/// \param stands_out m, how far a vertex may be in front of a facet's plane.
inline void expect_convex_mesh(const ConvexMesh& mesh, double stands_out) {
  const auto& vertices = mesh.vertices();
  const auto& facets = mesh.facets();
  const auto& sides = mesh.sides();
  const auto& edges = mesh.edges();
  ASSERT_EQ(vertices.size() + facets.size(), edges.size() + 2) << "Euler";
  ASSERT_EQ(sides.size(), 2 * edges.size());

  // Facets: unit normals, contiguous sides, convex polygons in their planes, counter-clockwise.
  std::set<std::pair<std::uint32_t, std::uint32_t>> side_keys;
  std::uint32_t next_side = 0;
  for (std::uint32_t f = 0; f < facets.size(); ++f) {
    const Facet& facet = facets[f];
    ASSERT_NEAR(glm::length(facet.normal), 1, 1e-14);
    ASSERT_EQ(facet.first_side, next_side);
    ASSERT_GE(facet.side_count, 3U);
    next_side += facet.side_count;
    double highest = -std::numeric_limits<double>::max(), lowest = -highest;
    for (std::uint32_t k = 0; k < facet.side_count; ++k) {
      const Side& side = sides[facet.first_side + k];
      const Edge& edge = edges[side.edge];
      ASSERT_TRUE(edge.left == f || edge.right == f);
      ASSERT_EQ(edge.from, vertices[edge.v0]);
      ASSERT_EQ(edge.to, vertices[edge.v1]);
      ASSERT_EQ(side.across, edge.left == f ? edge.right : edge.left);
      ASSERT_NE(side.across, f);
      const std::uint32_t here = corner_of(mesh, f, k), next = corner_of(mesh, f, k + 1);
      ASSERT_EQ(next, edge.left == f ? edge.v1 : edge.v0) << "sides follow each other";
      ASSERT_TRUE(side_keys.emplace(here, next).second);
      const Vec3 along = glm::normalize(vertices[next] - vertices[here]);
      ASSERT_NEAR(glm::length(side.inward), 1, 1e-14);
      ASSERT_NEAR(glm::dot(side.inward, facet.normal), 0, 1e-14);
      ASSERT_NEAR(glm::dot(side.inward, along), 0, 1e-14);
      ASSERT_GT(glm::dot(glm::cross(facet.normal, along), side.inward), 0.5);
      ASSERT_NEAR(glm::dot(side.inward, vertices[here]), side.offset, stands_out);
      for (std::uint32_t j = 0; j < facet.side_count; ++j) {
        ASSERT_GE(glm::dot(side.inward, vertices[corner_of(mesh, f, j)]), side.offset - stands_out);
      }
      const double height = glm::dot(facet.normal, vertices[here]) - facet.offset;
      highest = std::max(highest, height);
      lowest = std::min(lowest, height);
    }
    ASSERT_NEAR(highest + lowest, 0, stands_out) << "centred on its own polygon";
  }
  ASSERT_EQ(next_side, sides.size());

  // Edges: two different facets, each facing the other's side, bent outwards.
  for (const Edge& edge : edges) {
    ASSERT_NE(edge.left, edge.right);
    ASSERT_TRUE(side_keys.contains({edge.v0, edge.v1}));
    ASSERT_TRUE(side_keys.contains({edge.v1, edge.v0}));
    const Vec3 bend = glm::cross(facets[edge.left].normal, facets[edge.right].normal);
    ASSERT_GT(glm::dot(bend, vertices[edge.v1] - vertices[edge.v0]), 0);
  }

  // Fans: each edge once at either end, consecutive edges share the facet between them,
  // counter-clockwise.
  ASSERT_EQ(mesh.fan_first().size(), vertices.size() + 1);
  ASSERT_EQ(mesh.fan_edges().size(), 2 * edges.size());
  for (std::uint32_t v = 0; v < vertices.size(); ++v) {
    const std::uint32_t first = mesh.fan_first()[v], count = mesh.fan_first()[v + 1] - first;
    ASSERT_GE(count, 3U);
    std::set<std::uint32_t> seen;
    for (std::uint32_t k = 0; k < count; ++k) {
      const std::uint32_t here = mesh.fan_edges()[first + k];
      const std::uint32_t next = mesh.fan_edges()[first + (k + 1) % count];
      ASSERT_TRUE(seen.insert(here).second);
      const Edge &a = edges[here], &b = edges[next];
      ASSERT_TRUE(a.v0 == v || a.v1 == v);
      const std::uint32_t facet_after = a.v0 == v ? a.left : a.right;
      const std::uint32_t facet_before = b.v0 == v ? b.right : b.left;
      ASSERT_EQ(facet_after, facet_before);
    }
  }

  // The whole: no vertex in front of any facet, all within the bounding sphere.
  for (const Facet& facet : facets) {
    for (const Vec3& vertex : vertices) {
      ASSERT_LE(glm::dot(facet.normal, vertex) - facet.offset, stands_out);
    }
  }
  double farthest = 0;
  for (const Vec3& vertex : vertices) {
    farthest = std::max(farthest, glm::distance(vertex, mesh.centre()));
  }
  ASSERT_LE(farthest, mesh.radius());
  ASSERT_GE(farthest, mesh.radius() * (1 - 1e-12));
}

}  // namespace palpate::stimuli::checks
