#pragma once
// The sides of triangles, grouped by the edge that they run along.

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "stimuli/vec.h"

namespace palpate::stimuli {

/// Takes 12 bytes of memory for each side, and time in proportion to their number.
class SideGroups {
 public:
  /// A side of a triangle, from its corner k to the next.
  struct Side {
    std::uint32_t other;  ///< the higher end
    std::uint32_t code;   ///< 6 * triangle + 2 * k + (1: from the lower end to the higher)
    std::uint32_t triangle() const { return code / 6; }
    std::uint32_t k() const { return code % 6 / 2; }
    bool up() const { return code % 2 == 1; }
  };
  /// All sides between two vertices, by number of triangle.
  struct Edge {
    std::uint32_t low, high;
    std::span<const Side> sides;
  };

  SideGroups(std::size_t vertex_count, const std::vector<std::array<std::uint32_t, 3>>& triangles);

  /// Calls visit(Edge) for each edge, by number of its ends.
  template <class Visit>
  void for_each_edge(Visit visit) const {
    for (std::uint32_t v = 0; v + 1 < first_.size(); ++v) {
      for (std::uint32_t i = first_[v]; i < first_[v + 1];) {
        std::uint32_t end = i + 1;
        while (end < first_[v + 1] && sides_[end].other == sides_[i].other) ++end;
        visit(Edge{v, sides_[i].other, {sides_.data() + i, sides_.data() + end}});
        i = end;
      }
    }
  }

 private:
  std::vector<std::uint32_t> first_;
  std::vector<Side> sides_;
};

/// The neighbour over each side. Along every edge as many triangles must run one way as the other.
/// Where there are more than two, each two neighbours have solid between them.
/// \param sides  of the same triangles
void link_triangles(const std::vector<Vec3>& vertices,
                    const std::vector<std::array<std::uint32_t, 3>>& triangles,
                    const SideGroups& sides, std::vector<std::array<std::uint32_t, 3>>& across);

}  // namespace palpate::stimuli
