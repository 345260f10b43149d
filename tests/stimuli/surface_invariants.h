#pragma once
// All invariants of ClosedSurface, checked exhaustively.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <glm/geometric.hpp>
#include <set>
#include <tuple>
#include <vector>

#include "stimuli/closed_surface.h"

namespace palpate::stimuli::checks {

/// The guarantees of closed_surface.h for every surface.
inline void expect_closed(const ClosedSurface& surface) {
  std::vector<char> used(surface.vertices.size(), 0);
  ASSERT_EQ(surface.across.size(), surface.triangles.size());
  for (std::uint32_t t = 0; t < surface.triangles.size(); ++t) {
    const auto& corners = surface.triangles[t];
    const Vec3 area = glm::cross(surface.vertices[corners[1]] - surface.vertices[corners[0]],
                                 surface.vertices[corners[2]] - surface.vertices[corners[0]]);
    EXPECT_GT(glm::length(area), 0) << t;
    for (std::size_t k = 0; k < 3; ++k) {
      used.at(corners[k]) = 1;
      const std::uint32_t n = surface.across[t][k];
      const auto& other = surface.triangles.at(n);
      const std::uint32_t from = corners[(k + 1) % 3], to = corners[k];
      bool back = false;
      for (std::size_t j = 0; j < 3; ++j)
        back |= other[j] == from && other[(j + 1) % 3] == to && surface.across[n][j] == t;
      EXPECT_TRUE(back) << t << " over " << k;
    }
  }
  EXPECT_EQ(std::count(used.begin(), used.end(), 0), 0);
  const auto before = [](const Vec3& a, const Vec3& b) {
    return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
  };
  std::set<Vec3, decltype(before)> places(surface.vertices.begin(), surface.vertices.end(), before);
  EXPECT_EQ(places.size(), surface.vertices.size());
}

}  // namespace palpate::stimuli::checks
