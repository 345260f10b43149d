#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <vector>

#include "stimuli/surfaces/surface.h"

namespace palpate::stimuli {
namespace {

// Of the coordinates' error. Rounding moves each of two planes by up to its root of three times.
constexpr double kWidest = 4;
constexpr double kEnough = 0.75;    // of the widest: the search for a wider one ends
constexpr double kParallel = 0.99;  // cosine

using Corners = std::array<Vec3, 3>;

/// m, the greatest distance of two triangles where one lies over the other, within `limit` of its
/// border; 0: they do not, or are farther apart.
double gap(const Corners& under, const Vec3& normal, const Corners& over, double limit) {
  std::array<Vec3, 9> polygon{over[0], over[1], over[2]}, kept;
  std::size_t count = 3;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec3 side = under[(k + 1) % 3] - under[k];
    const double slack = limit * glm::length(side);
    const Vec3 inward = glm::cross(normal, side);
    const auto depth = [&](const Vec3& p) { return glm::dot(inward, p - under[k]) + slack; };
    std::size_t left = 0;
    for (std::size_t i = 0; i < count; ++i) {
      const Vec3 &from = polygon[i], &to = polygon[(i + 1) % count];
      const double a = depth(from), b = depth(to);
      if (a >= 0) kept[left++] = from;
      if ((a >= 0) != (b >= 0)) kept[left++] = from + a / (a - b) * (to - from);
    }
    polygon = kept;
    count = left;
  }
  double most = 0;
  for (std::size_t i = 0; i < count; ++i)
    most = std::max(most, std::abs(glm::dot(normal, polygon[i] - under[0])));
  return most <= limit ? most : 0;
}

/// For each triangle the first one of those that are connected with it.
std::vector<std::uint32_t> pieces_of(const LargeArray<SurfaceTriangle>& triangles) {
  constexpr std::uint32_t kNone = ~0U;
  std::vector<std::uint32_t> piece(triangles.size(), kNone), todo;
  for (std::uint32_t first = 0; first < piece.size(); ++first) {
    if (piece[first] != kNone) continue;
    piece[first] = first;
    todo.push_back(first);
    while (!todo.empty()) {
      const SurfaceTriangle& t = triangles[todo.back()];
      todo.pop_back();
      for (const std::uint32_t across : t.across) {
        const std::uint32_t next = SurfaceTriangle::triangle_of(across);
        if (piece[next] != kNone) continue;
        piece[next] = first;
        todo.push_back(next);
      }
    }
  }
  return piece;
}

}  // namespace

template <class Visit>
void Surface::near_box(const Vec3& low, const Vec3& high, const Visit& visit) const {
  const Vec3 a = low - centre_, b = high - centre_;
  const auto search = [&](const auto& self, std::uint32_t name) -> void {
    const Node& node = nodes_[index_of(name)];
    for (std::size_t k = 0; k < kWidth; ++k) {
      bool meets = node.low[0][k] <= node.high[0][k];
      for (std::size_t c = 0; c < 3 && meets; ++c) {
        const auto axis = static_cast<glm::length_t>(c);
        meets = node.low[c][k] <= b[axis] && node.high[c][k] >= a[axis];
      }
      if (!meets) continue;
      if (is_leaf(name)) {
        visit(node.children[k]);
      } else {
        self(self, node.children[k]);
      }
    }
  };
  search(search, root_);
}

double Surface::widest_seam() const {
  const double limit = kWidest * coordinate_error_;
  if (!(limit > 0)) return 0;
  const std::vector<std::uint32_t> piece = pieces_of(triangles_);
  if (std::all_of(piece.begin(), piece.end(), [](std::uint32_t p) { return p == 0; })) return 0;
  const auto corners_of = [&](const SurfaceTriangle& t) {
    return Corners{vertices_[t.corners[0]], vertices_[t.corners[1]], vertices_[t.corners[2]]};
  };
  const auto area2 = [](const Corners& c) {
    const Vec3 twice = glm::cross(c[1] - c[0], c[2] - c[0]);
    return glm::dot(twice, twice);
  };
  double widest = 0;
  for (std::uint32_t i = 0; i < piece.size() && widest < kEnough * limit; ++i) {
    const SurfaceTriangle& s = triangles_[i];
    const Corners own = corners_of(s);
    const Vec3 low = glm::min(glm::min(own[0], own[1]), own[2]) - limit,
               high = glm::max(glm::max(own[0], own[1]), own[2]) + limit;
    near_box(low, high, [&](std::uint32_t k) {
      const SurfaceTriangle& t = triangles_[k];
      if (piece[k] <= piece[i] || std::abs(glm::dot(s.normal, t.normal)) < kParallel) return;
      const Corners other = corners_of(t);
      const bool larger = area2(own) > area2(other);
      widest = std::max(
          widest, larger ? gap(own, s.normal, other, limit) : gap(other, t.normal, own, limit));
    });
  }
  return widest;
}

}  // namespace palpate::stimuli
