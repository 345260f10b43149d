#pragma once
// Boxes, and a bounding-volume hierarchy of them. Mesh frame, m.

#include <array>
#include <cstdint>
#include <glm/common.hpp>
#include <limits>
#include <span>

#include "stimuli/large_array.h"
#include "stimuli/vec.h"

namespace palpate::stimuli {

/// Axis-aligned; at first empty.
struct Box {
  Vec3 low{std::numeric_limits<double>::infinity()}, high{-low};  ///< m

  void add(const Vec3& p) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  void add(const Box& box) {
    low = glm::min(low, box.low);
    high = glm::max(high, box.high);
  }
  bool meets(const Box& box) const {
    return low.x <= box.high.x && box.low.x <= high.x && low.y <= box.high.y &&
           box.low.y <= high.y && low.z <= box.high.z && box.low.z <= high.z;
  }
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
  /// \param middles  by which the primitives are divided; empty: by their boxes
  explicit BoundingTree(std::span<const Box> boxes, std::span<const Vec3> middles = {});

  /// Root first; empty without primitives.
  const LargeArray<Node>& nodes() const { return nodes_; }
  const LargeArray<std::uint32_t>& order() const { return order_; }

  /// Calls visit(i), i an index in order(), as long as it returns true, for the primitives of all
  /// leaves whose boxes meet the box. Returns whether all were visited.
  template <class Visit>
  bool visit_meeting(const Box& box, const Visit& visit) const {
    std::array<std::uint32_t, 64> stack{};
    std::size_t left = 0;
    if (!nodes_.empty()) stack[left++] = 0;
    while (left > 0) {
      const std::uint32_t at = stack[--left];
      const Node& node = nodes_[at];
      if (!node.box.meets(box)) continue;
      if (node.count == 0) {
        stack[left++] = node.first;
        stack[left++] = at + 1;
        continue;
      }
      for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
        if (!visit(i)) return false;
      }
    }
    return true;
  }

 private:
  struct Primitives {
    std::span<const Box> boxes;
    std::span<const Vec3> middles;
  };
  void build(const Primitives& of, std::uint32_t begin, std::uint32_t end);

  LargeArray<Node> nodes_;
  LargeArray<std::uint32_t> order_;
};

}  // namespace palpate::stimuli
