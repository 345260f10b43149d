#include "stimuli/layers/triangle_tree.h"

#include <algorithm>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <numeric>
#include <utility>

#include "stimuli/exact_side.h"
#include "stimuli/nearest_on_triangle.h"

namespace palpate::stimuli {
namespace {

constexpr std::uint32_t kOfLeaf = 4;  // triangles; two to eight take the same time

/// Square of the distance from a point to a box.
double squared_gap(const Vec3& low, const Vec3& high, const Vec3& from) {
  const Vec3 gap = glm::max(Vec3(0), glm::max(low - from, from - high));
  return glm::dot(gap, gap);
}

}  // namespace

TriangleTree::TriangleTree(std::vector<CornerTriangle> triangles) {
  given_.resize(triangles.size());
  std::iota(given_.begin(), given_.end(), 0U);
  nodes_.reserve(triangles.size());
  if (!triangles.empty()) build(0, static_cast<std::uint32_t>(triangles.size()), triangles);
  triangles_.reserve(triangles.size());
  for (const std::uint32_t i : given_) triangles_.push_back(triangles[i]);
}

void TriangleTree::build(std::uint32_t first, std::uint32_t count,
                         const std::vector<CornerTriangle>& given) {
  const std::size_t self = nodes_.size();
  Node node{Vec3(HUGE_VAL), Vec3(-HUGE_VAL), first, count};
  Vec3 low = node.low, high = node.high;  // of the middles, three times
  const auto middle = [&](std::uint32_t i) { return given[i][0] + given[i][1] + given[i][2]; };
  for (std::uint32_t i = first; i < first + count; ++i) {
    for (const Vec3& corner : given[given_[i]]) {
      node.low = glm::min(node.low, corner);
      node.high = glm::max(node.high, corner);
    }
    low = glm::min(low, middle(given_[i]));
    high = glm::max(high, middle(given_[i]));
  }
  nodes_.push_back(node);
  if (count <= kOfLeaf) return;
  const Vec3 size = high - low;
  const int axis = size.x >= size.y && size.x >= size.z ? 0 : size.y >= size.z ? 1 : 2;
  const std::uint32_t half = count / 2;
  const auto begin = given_.begin() + first;
  std::nth_element(begin, begin + half, begin + count, [&](std::uint32_t a, std::uint32_t b) {
    const double of_a = middle(a)[axis], of_b = middle(b)[axis];
    return of_a != of_b ? of_a < of_b : a < b;
  });
  nodes_[self].count = 0;
  build(first, half, given);
  nodes_[self].first = static_cast<std::uint32_t>(nodes_.size());
  build(first + half, count - half, given);
}

TriangleTree::Nearest TriangleTree::nearest(const Vec3& from, double within) const {
  Nearest best;
  double least = within * within;
  std::array<std::pair<double, std::uint32_t>, 64> stack{};
  std::size_t left = 0;
  if (!nodes_.empty()) stack[left++] = {squared_gap(low(), high(), from), 0};
  while (left > 0) {
    const auto [gap, at] = stack[--left];
    if (gap > least) continue;
    const Node& node = nodes_[at];
    if (node.count == 0) {
      std::pair<double, std::uint32_t> near{
          squared_gap(nodes_[at + 1].low, nodes_[at + 1].high, from), at + 1};
      std::pair<double, std::uint32_t> far{
          squared_gap(nodes_[node.first].low, nodes_[node.first].high, from), node.first};
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
  const Vec3 top(q.x, q.y, HUGE_VAL);
  for_each_near(q, top, [&](std::uint32_t i) {
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
