#pragma once
// A tree over triangles: the nearest point, a winding number, all triangles in a box. One frame, m.

#include <array>
#include <cstdint>
#include <limits>
#include <vector>

#include "stimuli/nearest_on_triangle.h"
#include "stimuli/vec.h"

namespace palpate::stimuli {

class TriangleTree {
 public:
  explicit TriangleTree(std::vector<CornerTriangle> triangles);

  struct Nearest {
    double distance = std::numeric_limits<double>::infinity();  ///< m
    Vec3 point;                                                 ///< m, on the triangle
    std::uint32_t triangle = 0;
  };
  /// \param within  m; farther triangles are not found
  Nearest nearest(const Vec3& from, double within = std::numeric_limits<double>::infinity()) const;

  /// How often the triangles, which must bound something, wind round a point: crossings of a ray
  /// along +z, with exact signs.
  int winding(const Vec3& point) const;

  /// Calls visit(triangle), as long as it returns true, for those whose boxes meet the box.
  template <class Visit>
  bool for_each_near(const Vec3& low, const Vec3& high, const Visit& visit) const {
    std::array<std::uint32_t, 64> stack{};
    std::size_t left = 0;
    if (!nodes_.empty()) stack[left++] = 0;
    while (left > 0) {
      const std::uint32_t at = stack[--left];
      const Node& node = nodes_[at];
      bool meets = true;
      for (int k = 0; k < 3; ++k) meets &= node.low[k] <= high[k] && low[k] <= node.high[k];
      if (!meets) continue;
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

  /// In the order of the tree, not the one given.
  const std::vector<CornerTriangle>& triangles() const { return triangles_; }
  /// The index, in the order given, of each.
  const std::vector<std::uint32_t>& given() const { return given_; }
  bool empty() const { return triangles_.empty(); }
  Vec3 low() const { return nodes_.front().low; }    ///< m, of the box about all
  Vec3 high() const { return nodes_.front().high; }  ///< m

 private:
  struct Node {
    Vec3 low, high;           ///< m
    std::uint32_t first = 0;  ///< of a leaf: its triangles; else the right child (left: next node)
    std::uint32_t count = 0;  ///< 0: no leaf
  };
  void build(std::uint32_t first, std::uint32_t count, const std::vector<CornerTriangle>& given);

  std::vector<Node> nodes_;
  std::vector<CornerTriangle> triangles_;
  std::vector<std::uint32_t> given_;
};

}  // namespace palpate::stimuli
