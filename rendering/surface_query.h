#pragma once
// Triangles of a closed surface near a segment. Included by the few that ask, as it is inlined.

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "rendering/surface.h"

namespace palpate::rendering {

template <class Visit>
void Surface::near_segment(const Vec3& start, const Vec3& along, double room,
                           const Visit& visit) const {
  // Separating axes of a box and a segment (Ericson 2005, 5.3.3), the box larger by the room.
  const Vec3 half = 0.5 * along, middle = start + half;

  const Vec3 size(std::abs(half.x), std::abs(half.y), std::abs(half.z));
  const auto is_near = [&](const Node& node) {
    const double x = middle.x - static_cast<double>(node.middle[0]),
                 y = middle.y - static_cast<double>(node.middle[1]),
                 z = middle.z - static_cast<double>(node.middle[2]);
    const double a = static_cast<double>(node.half[0]) + room,
                 b = static_cast<double>(node.half[1]) + room,
                 c = static_cast<double>(node.half[2]) + room;
    if (std::abs(x) > a + size.x || std::abs(y) > b + size.y || std::abs(z) > c + size.z)
      return false;
    const double slack = 1e-12 * (a + b + c) * (size.x + size.y + size.z);
    return std::abs(y * half.z - z * half.y) <= b * size.z + c * size.y + slack &&
           std::abs(z * half.x - x * half.z) <= a * size.z + c * size.x + slack &&
           std::abs(x * half.y - y * half.x) <= a * size.y + b * size.x + slack;
  };
  if (nodes_.empty()) return;
  std::array<std::uint32_t, 64> stack{};  // halves at each level
  std::size_t open = 0;
  stack[open++] = 0;
  while (open > 0) {
    const std::uint32_t at = stack[--open];
    const Node& node = nodes_[at];
    if (!is_near(node)) continue;
    if (node.count == 0) {
      __builtin_prefetch(&nodes_[node.first]);
      stack[open++] = node.first;
      stack[open++] = at + 1;
      continue;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      if (!visit(order_[i])) return;
    }
  }
}

}  // namespace palpate::rendering
