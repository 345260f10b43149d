// Clipping by the sides of a facet with many corners: the same bits as side by side.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <numbers>
#include <vector>

#include "data/base/random.h"
#include "rendering/probes.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/orientation.h"
#include "stimuli/polygon_soup.h"

namespace palpate::rendering::tick {
namespace {

/// A prism whose caps have corners on an ellipse at uneven angles.
stimuli::PolygonSoup prism(int corners, Random& random) {
  stimuli::PolygonSoup out;
  std::vector<double> angles;
  for (int i = 0; i < corners; ++i)
    angles.push_back((i + 0.8 * random.unit()) * 2 * std::numbers::pi / corners);
  for (const double z : {0.0, 0.01}) {
    for (const double angle : angles)
      out.vertices.push_back({0.03 * std::cos(angle), 0.02 * std::sin(angle), z});
  }
  std::vector<std::uint32_t> top, bottom;
  const auto n = static_cast<std::uint32_t>(corners);
  for (std::uint32_t i = 0; i < n; ++i) {
    top.push_back(n + i);
    bottom.push_back(n - 1 - i);
    out.faces.push_back({i, (i + 1) % n, n + (i + 1) % n, n + i});
  }
  out.faces.push_back(top);
  out.faces.push_back(bottom);
  return out;
}

Portion side_by_side(const stimuli::ConvexMesh& mesh, std::uint32_t index, const Vec3& tip,
                     const Vec3& d, double slack) {
  const stimuli::Facet& facet = mesh.facets()[index];
  Portion portion;
  for (std::uint32_t i = facet.first_side; i < facet.first_side + facet.side_count; ++i) {
    const stimuli::Side& side = mesh.sides()[i];
    portion.clip(glm::dot(side.inward, tip) - side.offset + slack, glm::dot(side.inward, d));
  }
  return portion;
}

TEST(Portion, BisectionGivesTheBitsOfAllSides) {
  for (const std::uint64_t seed : {1U, 2U}) {
    Random random(seed);
    for (const int corners : {13, 14, 31, 64, 257, 1000, 4096}) {
      const stimuli::ConvexMesh mesh(prism(corners, random));
      for (std::uint32_t index = 0; index < mesh.facets().size(); ++index) {
        const stimuli::Facet& facet = mesh.facets()[index];
        if (facet.side_count < 13) continue;
        for (int round = 0; round < 3000; ++round) {
          const double turn = 2 * std::numbers::pi * random.unit();
          const double length = 0.001 + 0.15 * random.unit();
          // Lying, or nearly; over the facet, across its rim, or beside it.
          const Vec3 d = length * Vec3(std::cos(turn), std::sin(turn), 0.01 * random.normal());
          const Vec3 tip(0.05 * random.normal(), 0.03 * random.normal(),
                         facet.offset * facet.normal.z);
          const double slack = round % 3 == 0 ? 1e-9 : 0;
          const Portion expected = side_by_side(mesh, index, tip, d, slack);
          Portion found;
          found.clip_by_many(mesh, index, tip, d, slack);
          if (expected.enter <= expected.leave) {
            ASSERT_EQ(found.enter, expected.enter) << corners << " " << round;
            ASSERT_EQ(found.leave, expected.leave) << corners << " " << round;
          } else {
            ASSERT_GT(found.enter, found.leave) << corners << " " << round;
          }
        }
      }
    }
  }
}

/// Along a side, through a corner, and along the axis between corners.
TEST(Portion, AlignedLinesGiveTheBitsOfAllSides) {
  Random random(3);
  const stimuli::ConvexMesh mesh(prism(64, random));
  for (std::uint32_t index = 0; index < mesh.facets().size(); ++index) {
    const stimuli::Facet& facet = mesh.facets()[index];
    if (facet.side_count < 13) continue;
    const auto corner = [&](std::uint32_t i) {
      return minkowski::corner(mesh, index, mesh.sides()[facet.first_side + i % facet.side_count]);
    };
    for (std::uint32_t i = 0; i < facet.side_count; ++i) {
      for (std::uint32_t k = i + 1; k < facet.side_count; ++k) {
        for (const double beyond : {-0.2, 0.0, 0.3}) {
          const Vec3 d = corner(k) - corner(i), tip = corner(i) + beyond * d;
          const Portion expected = side_by_side(mesh, index, tip, d, 1e-9);
          Portion found;
          found.clip_by_many(mesh, index, tip, d, 1e-9);
          ASSERT_EQ(found.enter, expected.enter) << i << " " << k << " " << beyond;
          ASSERT_EQ(found.leave, expected.leave) << i << " " << k << " " << beyond;
        }
      }
    }
  }
}

}  // namespace
}  // namespace palpate::rendering::tick
