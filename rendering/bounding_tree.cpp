#include "rendering/bounding_tree.h"

#include <algorithm>
#include <glm/common.hpp>
#include <numeric>

namespace palpate::rendering {
namespace {

constexpr std::uint32_t kLeaf = 4;  // primitives; smaller leaves add nodes and save few tests

}  // namespace

BoundingTree::BoundingTree(std::span<const Box> boxes) : order_(boxes.size()) {
  std::iota(order_.begin(), order_.end(), 0u);
  if (boxes.empty()) return;
  nodes_.reserve(boxes.size());
  build(boxes, 0, static_cast<std::uint32_t>(boxes.size()));
}

void BoundingTree::build(std::span<const Box> boxes, std::uint32_t begin, std::uint32_t end) {
  const std::size_t index = nodes_.size();
  Box all = boxes[order_[begin]];
  for (std::uint32_t i = begin + 1; i < end; ++i) {
    all.low = glm::min(all.low, boxes[order_[i]].low);
    all.high = glm::max(all.high, boxes[order_[i]].high);
  }
  nodes_.push_back({all, begin, end - begin});
  if (end - begin <= kLeaf) return;
  const Vec3 extent = all.high - all.low;
  int axis = 0;
  if (extent[1] > extent[axis]) axis = 1;
  if (extent[2] > extent[axis]) axis = 2;
  const std::uint32_t middle = (begin + end) / 2;
  std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                   [&](std::uint32_t a, std::uint32_t b) {
                     const double centre_a = boxes[a].low[axis] + boxes[a].high[axis];
                     const double centre_b = boxes[b].low[axis] + boxes[b].high[axis];
                     return centre_a != centre_b ? centre_a < centre_b : a < b;
                   });
  build(boxes, begin, middle);
  nodes_[index].first = static_cast<std::uint32_t>(nodes_.size());
  nodes_[index].count = 0;
  build(boxes, middle, end);
}

}  // namespace palpate::rendering
