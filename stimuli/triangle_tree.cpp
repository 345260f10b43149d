#include "stimuli/triangle_tree.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <utility>

#include "stimuli/exact_side.h"
#include "stimuli/nearest_on_triangle.h"

namespace palpate::stimuli {
namespace {

/// Square of the distance from a point to a box.
double squared_gap(const Box& box, const Vec3& from) {
  const Vec3 gap = glm::max(Vec3(0), glm::max(box.low - from, from - box.high));
  return glm::dot(gap, gap);
}

}  // namespace

TriangleTree::TriangleTree(const std::vector<CornerTriangle>& triangles) {
  std::vector<Box> boxes(triangles.size());
  std::vector<Vec3> middles;
  middles.reserve(triangles.size());
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    for (const Vec3& corner : triangles[i]) boxes[i].add(corner);
    middles.push_back(triangles[i][0] + triangles[i][1] + triangles[i][2]);
  }
  tree_ = BoundingTree(boxes, middles);
  triangles_.reserve(triangles.size());
  for (const std::uint32_t i : tree_.order()) triangles_.push_back(triangles[i]);
}

TriangleTree::Nearest TriangleTree::nearest(const Vec3& from, double within) const {
  Nearest best;
  double least = within * within;
  std::array<std::pair<double, std::uint32_t>, 64> stack{};
  std::size_t left = 0;
  const auto& nodes = tree_.nodes();
  if (!nodes.empty()) stack[left++] = {squared_gap(nodes[0].box, from), 0};
  while (left > 0) {
    const auto [gap, at] = stack[--left];
    if (gap > least) continue;
    const BoundingTree::Node& node = nodes[at];
    if (node.count == 0) {
      std::pair<double, std::uint32_t> near{squared_gap(nodes[at + 1].box, from), at + 1};
      std::pair<double, std::uint32_t> far{squared_gap(nodes[node.first].box, from), node.first};
      if (far.first < near.first) std::swap(near, far);
      if (far.first <= least) stack[left++] = far;
      if (near.first <= least) stack[left++] = near;
      continue;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      const Vec3 point = nearest_on_triangle(triangles_[i], from);
      const Vec3 apart = from - point;
      const double distance2 = glm::dot(apart, apart);
      if (distance2 > least || (distance2 == least && best.distance < HUGE_VAL)) continue;
      least = distance2;
      best = {std::sqrt(distance2), point, i};
    }
  }
  return best;
}

int TriangleTree::winding(const Vec3& q) const {
  int number = 0;
  for_each_near({q, Vec3(q.x, q.y, HUGE_VAL)}, [&](std::uint32_t i) {
    const auto& [a, b, c] = triangles_[i];
    const int side = side_of(a, b, q);
    if (side == 0 || side_of(b, c, q) != side || side_of(c, a, q) != side) return true;
    const double height = glm::dot(glm::cross(b - a, c - a), q - a);
    if ((height < 0) == (side > 0)) number += side;
    return true;
  });
  return number;
}

}  // namespace palpate::stimuli
