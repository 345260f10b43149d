#include "runner/sharp_edges.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <limits>

#include "stimuli/convex_mesh.h"

namespace palpate::runner {
namespace {

bool turns(const Vec3& normal, const Vec3& other) {
  // A mesh's facets at exactly the least turn differ from it by roundings.
  static const double most = std::cos(SharpEdges::kLeastTurn) + 1e-9;
  return glm::dot(normal, other) <= most;
}

}  // namespace

SharpEdges::SharpEdges(const rendering::Scene& scene) {
  int surface = std::numeric_limits<int>::max();
  for (const rendering::ScenePart& part : scene.parts()) {
    if (part.layer != rendering::kNotFelt) surface = std::min(surface, part.layer);
  }
  for (const rendering::PlacedSurface& placed : scene.surfaces()) {
    if (placed.layer != rendering::kNotFelt) surface = std::min(surface, placed.layer);
  }
  for (const rendering::ScenePart& part : scene.parts()) {
    if (part.layer == surface) add_part(part);
  }
  for (const rendering::PlacedSurface& placed : scene.surfaces()) {
    if (placed.layer == surface) add_surface(placed);
  }
  too_many_ = lines_.size() > kMost;
  if (too_many_) lines_.clear();
}

void SharpEdges::add_part(const rendering::ScenePart& part) {
  const stimuli::ConvexMesh& mesh = *part.mesh;
  const auto world = [&part](const Vec3& local) {
    return part.world_vector(local) + part.position;
  };
  std::vector<bool> on_edge(mesh.vertices().size());
  for (const stimuli::Edge& edge : mesh.edges()) {
    if (!turns(mesh.facets()[edge.left].normal, mesh.facets()[edge.right].normal)) continue;
    const Vec3 along = part.world_vector(edge.to - edge.from);
    lines_.push_back({world(edge.from), along, 1 / glm::dot(along, along)});
    on_edge[edge.v0] = on_edge[edge.v1] = true;
  }
  for (std::uint32_t v = 0; v < on_edge.size(); ++v) {
    if (on_edge[v]) continue;
    const auto fan = [&mesh, v](std::uint32_t i) -> const Vec3& {
      return mesh.facets()[mesh.edges()[mesh.fan_edges()[i]].left].normal;
    };
    const std::uint32_t first = mesh.fan_first()[v], end = mesh.fan_first()[v + 1];
    bool sharp = false;
    for (std::uint32_t i = first; i < end && !sharp; ++i) {
      for (std::uint32_t j = first; j < i && !sharp; ++j) sharp = turns(fan(i), fan(j));
    }
    if (sharp) lines_.push_back({world(mesh.vertices()[v]), Vec3(0), 0});
  }
}

void SharpEdges::add_surface(const rendering::PlacedSurface& placed) {
  const stimuli::Surface& surface = *placed.surface;
  const auto& triangles = surface.triangles();
  std::vector<bool> on_edge(surface.vertices().size());
  const auto world = [&](std::uint32_t vertex) {
    return placed.world_vector(surface.vertices()[vertex]) + placed.position;
  };
  for (const std::uint32_t i : surface.file_order()) {
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t beyond = triangles[i].across[k];
      if (!triangles[i].owns(k)) continue;
      const Vec3& other = triangles[stimuli::SurfaceTriangle::triangle_of(beyond)].normal;
      if (!turns(triangles[i].normal, other)) continue;
      const std::uint32_t v0 = triangles[i].corners[k], v1 = triangles[i].corners[(k + 1) % 3];
      const Vec3 along = world(v1) - world(v0);
      lines_.push_back({world(v0), along, 1 / glm::dot(along, along)});
      on_edge[v0] = on_edge[v1] = true;
      if (lines_.size() > kMost) return;
    }
  }
  // Vertices that no sharp edge ends in, but whose triangles differ.
  std::vector<std::vector<std::uint32_t>> fans(surface.vertices().size());
  for (const std::uint32_t i : surface.file_order()) {
    for (const std::uint32_t corner : triangles[i].corners) {
      if (!on_edge[corner]) fans[corner].push_back(i);
    }
  }
  for (std::uint32_t v = 0; v < fans.size(); ++v) {
    bool sharp = false;
    for (std::size_t i = 0; i < fans[v].size() && !sharp; ++i) {
      for (std::size_t j = 0; j < i && !sharp; ++j)
        sharp = turns(triangles[fans[v][i]].normal, triangles[fans[v][j]].normal);
    }
    if (sharp) lines_.push_back({world(v), Vec3(0), 0});
  }
}

std::vector<std::array<Vec3, 2>> SharpEdges::lines() const {
  std::vector<std::array<Vec3, 2>> all;
  all.reserve(lines_.size());
  for (const Line& line : lines_) all.push_back({line.from, line.from + line.along});
  return all;
}

double SharpEdges::distance(const Vec3& point) const {
  double least2 = std::numeric_limits<double>::infinity();
  for (const Line& line : lines_) {
    const Vec3 to = point - line.from;
    const double t = std::clamp(glm::dot(to, line.along) * line.inverse_square, 0.0, 1.0);
    const Vec3 off = to - t * line.along;
    least2 = std::min(least2, glm::dot(off, off));
  }
  return std::sqrt(least2);
}

}  // namespace palpate::runner
