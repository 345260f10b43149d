#include "stimuli/bounding_tree.h"

#include <algorithm>
#include <numeric>

namespace palpate::stimuli {
namespace {

constexpr std::uint32_t kLeaf = 4;  // primitives; smaller leaves add nodes and save few tests

}  // namespace

BoundingTree::BoundingTree(std::span<const Box> boxes, std::span<const Vec3> middles)
    : order_(boxes.size()) {
  std::iota(order_.begin(), order_.end(), 0u);
  if (boxes.empty()) return;
  nodes_.reserve(boxes.size());
  build({boxes, middles}, 0, static_cast<std::uint32_t>(boxes.size()));
}

void BoundingTree::build(const Primitives& of, std::uint32_t begin, std::uint32_t end) {
  const std::size_t index = nodes_.size();
  const auto middle_of = [&of](std::uint32_t i) {
    return of.middles.empty() ? of.boxes[i].low + of.boxes[i].high : of.middles[i];
  };
  Box all, middles;
  for (std::uint32_t i = begin; i < end; ++i) {
    all.add(of.boxes[order_[i]]);
    middles.add(middle_of(order_[i]));
  }
  nodes_.push_back({all, begin, end - begin});
  if (end - begin <= kLeaf) return;
  const Box& spread = of.middles.empty() ? all : middles;
  const Vec3 extent = spread.high - spread.low;
  int axis = 0;
  if (extent[1] > extent[axis]) axis = 1;
  if (extent[2] > extent[axis]) axis = 2;
  const std::uint32_t half = begin + (end - begin) / 2;
  std::nth_element(order_.begin() + begin, order_.begin() + half, order_.begin() + end,
                   [&](std::uint32_t a, std::uint32_t b) {
                     const double of_a = middle_of(a)[axis], of_b = middle_of(b)[axis];
                     return of_a != of_b ? of_a < of_b : a < b;
                   });
  build(of, begin, half);
  nodes_[index].first = static_cast<std::uint32_t>(nodes_.size());
  nodes_[index].count = 0;
  build(of, half, end);
}

}  // namespace palpate::stimuli
