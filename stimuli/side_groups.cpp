#include "stimuli/side_groups.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <vector>

namespace palpate::stimuli {
namespace {

using Index = std::uint32_t;

/// A side of one of several triangles at an edge.
struct Turned {
  double angle;  // about the edge
  bool opens;    // solid begins here as the angle grows
  SideGroups::Side side;
};

// Sorted by angle. Solid that begins is paired with the solid that ends, first with first: each
// pair bounds a wedge of solid, and the wedges are all of the solid at the edge.
void link_fan(const std::vector<Vec3>& vertices, const std::vector<std::array<Index, 3>>& triangles,
              const SideGroups::Edge& edge, std::vector<std::array<Index, 3>>& across) {
  const Vec3& from = vertices[edge.low];
  const Vec3 along = glm::normalize(vertices[edge.high] - from);
  Vec3 x(0);
  std::vector<Turned> fan;
  for (const SideGroups::Side& side : edge.sides) {
    Vec3 away = vertices[triangles[side.triangle()][(side.k() + 2) % 3]] - from;
    away -= glm::dot(away, along) * along;
    if (x == Vec3(0)) x = away;
    const double angle = std::atan2(glm::dot(glm::cross(along, x), away), glm::dot(x, away));
    fan.push_back({angle, !side.up(), side});
  }
  std::sort(fan.begin(), fan.end(), [](const Turned& a, const Turned& b) {
    if (a.angle != b.angle) return a.angle < b.angle;
    return a.opens != b.opens ? a.opens : a.side.code < b.side.code;
  });
  // Begin where fewest are open.
  int open = 0, fewest = 0;
  std::size_t begin = 0;
  for (std::size_t i = 0; i < fan.size(); ++i) {
    open += fan[i].opens ? 1 : -1;
    if (open < fewest) {
      fewest = open;
      begin = i + 1;
    }
  }
  std::rotate(fan.begin(), fan.begin() + static_cast<std::ptrdiff_t>(begin % fan.size()),
              fan.end());
  std::vector<SideGroups::Side> opened;
  std::size_t next = 0;
  for (const Turned& turned : fan) {
    if (turned.opens) {
      opened.push_back(turned.side);
      continue;
    }
    const SideGroups::Side a = opened[next++], b = turned.side;
    across[a.triangle()][a.k()] = b.triangle();
    across[b.triangle()][b.k()] = a.triangle();
  }
}

}  // namespace

SideGroups::SideGroups(std::size_t vertex_count, const std::vector<std::array<Index, 3>>& triangles)
    : first_(vertex_count + 1, 0), sides_(3 * triangles.size()) {
  for (const auto& t : triangles) {
    for (std::size_t k = 0; k < 3; ++k) ++first_[std::min(t[k], t[(k + 1) % 3])];
  }
  Index sum = 0;
  for (Index& first : first_) {
    sum += first;
    first = sum;
  }
  for (auto i = static_cast<Index>(triangles.size()); i-- > 0;) {
    const auto& t = triangles[i];
    for (Index k = 3; k-- > 0;) {
      const Index a = t[k], b = t[(k + 1) % 3];
      sides_[--first_[std::min(a, b)]] = {std::max(a, b), 6 * i + 2 * k + (a < b ? 1U : 0U)};
    }
  }
  for (std::size_t v = 0; v < vertex_count; ++v) {
    std::sort(sides_.begin() + first_[v], sides_.begin() + first_[v + 1],
              [](const Side& a, const Side& b) {
                return a.other != b.other ? a.other < b.other : a.code < b.code;
              });
  }
}

void link_triangles(const std::vector<Vec3>& vertices,
                    const std::vector<std::array<Index, 3>>& triangles, const SideGroups& sides,
                    std::vector<std::array<Index, 3>>& across) {
  across.assign(triangles.size(), {});
  sides.for_each_edge([&](const SideGroups::Edge& edge) {
    if (edge.sides.size() > 2) {
      link_fan(vertices, triangles, edge, across);
      return;
    }
    const SideGroups::Side a = edge.sides[0], b = edge.sides[1];
    across[a.triangle()][a.k()] = b.triangle();
    across[b.triangle()][b.k()] = a.triangle();
  });
}

}  // namespace palpate::stimuli
