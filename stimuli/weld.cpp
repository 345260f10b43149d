#include "stimuli/weld.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <glm/geometric.hpp>
#include <utility>
#include <vector>

namespace palpate::stimuli {
namespace {

using Index = std::uint32_t;
constexpr Index kFreeSlot = 0xffffffff;

std::uint64_t hash_of(const Vec3& point) {
  std::uint64_t hash = 0;
  for (int axis = 0; axis < 3; ++axis) {
    // Adding 0 turns -0 into 0: the two are equal.
    hash = (hash ^ std::bit_cast<std::uint64_t>(point[axis] + 0.0)) * 0x9e3779b97f4a7c15U;
    hash ^= hash >> 32U;
  }
  return hash;
}

Index kept_for(std::vector<Index>& kept, Index i) {
  while (kept[i] != i) i = kept[i] = kept[kept[i]];
  return i;
}

}  // namespace

std::vector<Index> weld_equal(const std::vector<Vec3>& points) {
  std::vector<Index> slots(std::bit_ceil(2 * points.size() + 16), kFreeSlot);
  std::vector<Index> kept(points.size());
  for (Index i = 0; i < points.size(); ++i) {
    std::size_t slot = hash_of(points[i]) & (slots.size() - 1);
    while (slots[slot] != kFreeSlot && points[slots[slot]] != points[i]) {
      slot = (slot + 1) & (slots.size() - 1);
    }
    if (slots[slot] == kFreeSlot) slots[slot] = i;
    kept[i] = slots[slot];
  }
  return kept;
}

std::vector<Index> weld(const std::vector<Vec3>& points, double tolerance) {
  // Equal coordinates first: in a triangle soup each corner occurs about six times.
  std::vector<Index> kept = weld_equal(points);
  // Close points are close in any projection. The direction is no axis and no diagonal, so that few
  // corners of a man-made object project onto one value.
  const Vec3 direction = glm::normalize(Vec3(0.5377, 0.3141, 0.7823));
  std::vector<std::pair<double, Index>> order;
  for (Index i = 0; i < points.size(); ++i) {
    if (kept[i] == i) order.emplace_back(glm::dot(direction, points[i] - points[0]), i);
  }
  std::sort(order.begin(), order.end());
  for (std::size_t i = 0; i < order.size(); ++i) {
    for (std::size_t j = i + 1; j < order.size(); ++j) {
      if (order[j].first - order[i].first > tolerance) break;
      const Vec3 apart = points[order[j].second] - points[order[i].second];
      if (glm::dot(apart, apart) > tolerance * tolerance) continue;
      const Index a = kept_for(kept, order[i].second), b = kept_for(kept, order[j].second);
      kept[std::max(a, b)] = std::min(a, b);
    }
  }
  for (Index i = 0; i < kept.size(); ++i) kept[i] = kept_for(kept, i);
  return kept;
}

}  // namespace palpate::stimuli
