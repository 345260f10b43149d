#pragma once
// Bounding-volume hierarchy for continuous collision detection. Mesh frame, m.

#include <cstdint>
#include <span>

#include "stimuli/large_array.h"
#include "stimuli/vec.h"

namespace palpate::rendering {

struct Box {
  Vec3 low, high;  ///< m
};

/// A binary tree of axis-aligned boxes over primitives (polygons or edges), split at the median of
/// the longest side. Gottschalk, Lin & Manocha 1996; Ho, Basdogan & Srinivasan 2000,
/// section 4(a).
class BoundingTree {
 public:
  struct Node {
    Box box;
    /// Leaf: first primitive in order(). Inner node: right child; the left one is the next node.
    std::uint32_t first;
    std::uint32_t count;  ///< leaf: number of primitives; inner node: 0
  };

  BoundingTree() = default;
  explicit BoundingTree(std::span<const Box> boxes);

  /// Root first; empty without primitives.
  const stimuli::LargeArray<Node>& nodes() const { return nodes_; }
  const stimuli::LargeArray<std::uint32_t>& order() const { return order_; }

 private:
  void build(std::span<const Box> boxes, std::uint32_t begin, std::uint32_t end);

  stimuli::LargeArray<Node> nodes_;
  stimuli::LargeArray<std::uint32_t> order_;
};

}  // namespace palpate::rendering
