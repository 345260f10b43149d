#pragma once
// The point of a simplex nearest to the origin, for GJK. Internal to convex_gap.cpp.

#include <array>
#include <cstddef>
#include <cstdint>

#include "stimuli/vec.h"

namespace palpate::rendering {

/// Corners of the difference of two parts, with the points that they are differences of.
struct GapSimplex {
  struct Corner {
    Vec3 point;  ///< on_b - on_a
    Vec3 on_a, on_b;
    std::uint32_t vertex_a = 0, vertex_b = 0;
  };
  std::array<Corner, 4> corners;
  std::array<double, 4> weights{};
  std::size_t count = 0;

  Vec3 nearest() const {
    Vec3 sum(0);
    for (std::size_t i = 0; i < count; ++i) sum += weights[i] * corners[i].point;
    return sum;
  }
};

/// Leaves the corners that hold the nearest point, with their weights. False: the origin is inside.
bool reduce_to_nearest(GapSimplex& simplex);

}  // namespace palpate::rendering
