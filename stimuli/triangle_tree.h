#pragma once
// A tree over triangles: the nearest point, a winding number, all triangles in a box. One frame, m.

#include <cstdint>
#include <limits>
#include <vector>

#include "stimuli/bounding_tree.h"
#include "stimuli/large_array.h"
#include "stimuli/nearest_on_triangle.h"
#include "stimuli/vec.h"

namespace palpate::stimuli {

class TriangleTree {
 public:
  explicit TriangleTree(const std::vector<CornerTriangle>& triangles);

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

  /// Calls visit(triangle), as long as it returns true, for those whose leaves meet the box.
  template <class Visit>
  bool for_each_near(const Box& box, const Visit& visit) const {
    return tree_.visit_meeting(box, visit);
  }

  /// In the order of the tree, not the one given.
  const std::vector<CornerTriangle>& triangles() const { return triangles_; }
  /// The index, in the order given, of each.
  const LargeArray<std::uint32_t>& given() const { return tree_.order(); }
  bool empty() const { return triangles_.empty(); }
  const Box& box() const {
    return tree_.nodes().front().box;
  }  ///< about all, of which there are some

 private:
  BoundingTree tree_;
  std::vector<CornerTriangle> triangles_;
};

}  // namespace palpate::stimuli
