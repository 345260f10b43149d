#include "stimuli/parts/convex_parts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <string>

#include "stimuli/convex_mesh.h"
#include "stimuli/orientation.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"
#include "tests/stimuli/concave_solids.h"
#include "tests/stimuli/part_checks.h"

namespace palpate::stimuli {
namespace {

using checks::out_of;
using checks::refusal;
using checks::volume;

// Points of the bounding box that lie in a wrong number of parts: it must be 1 inside the solid, 0
// outside.
int wrong_points(const solids::Solid& solid, const std::vector<ConvexMesh>& parts, double near) {
  Vec3 low(1e300), high(-1e300);
  for (const Vec3& vertex : solid.soup.vertices) {
    low = glm::min(low, vertex);
    high = glm::max(high, vertex);
  }
  constexpr std::uint64_t kSeed = 5;
  Random random(kSeed);
  int wrong = 0;
  for (int i = 0; i < 300; ++i) {
    Vec3 point;
    for (int axis = 0; axis < 3; ++axis)
      point[axis] = low[axis] + (high[axis] - low[axis]) * random.unit();
    int in = 0;
    bool doubtful = false;
    for (const ConvexMesh& part : parts) {
      const double out = out_of(part, point);
      doubtful |= std::abs(out) < near * glm::length(high - low);
      in += out < 0 ? 1 : 0;
    }
    if (!doubtful && in != (solid.holds(point) ? 1 : 0)) ++wrong;
  }
  return wrong;
}

void expect_cover(const solids::Solid& solid, const std::string& name, double error = 1e-9) {
  SCOPED_TRACE(name);
  std::vector<ConvexMesh> parts;
  try {
    parts = cut_into_convex_parts(solid.soup);
  } catch (const MeshError& refused) {
    ADD_FAILURE() << refused.what();
    return;
  }
  EXPECT_NEAR(volume(parts), solid.volume, error * solid.volume);
  if (solid.holds) {
    EXPECT_EQ(wrong_points(solid, parts, error), 0);
  }
}

solids::Solid in_single_precision(solids::Solid solid) {
  double largest = 0;
  for (Vec3& vertex : solid.soup.vertices) {
    vertex = checks::single_precision(vertex);
    largest = std::max({largest, std::abs(vertex.x), std::abs(vertex.y), std::abs(vertex.z)});
  }
  solid.soup.coordinate_error = largest * 0x1p-24;
  return solid;
}

solids::Solid anywhere(const solids::Solid& solid, Random& random) {
  const double scale = std::pow(10, 6 * random.unit() - 3);
  const Vec3 by = 0.1 * scale * Vec3(random.normal(), random.normal(), random.normal());
  return solids::moved(solid, uniform_rotation(random), scale, by);
}

TEST(ConvexParts, KnownSolidsHaveTheirKnownParts) {
  const auto parts = [](const solids::Solid& solid) {
    const std::vector<ConvexMesh> found = cut_into_convex_parts(solid.soup);
    EXPECT_NEAR(volume(found), solid.volume, 1e-12 * solid.volume);
    for (const ConvexMesh& part : found) checks::expect_convex_mesh(part, 1e-9 * part.size());
    return found.size();
  };
  EXPECT_EQ(parts(solids::l_shape()), 2U);
  EXPECT_EQ(parts(solids::u_shape()), 3U);
  EXPECT_EQ(parts(solids::plus_shape()), 3U);
  EXPECT_EQ(parts(solids::stair(8)), 8U);
  EXPECT_EQ(parts(solids::torus(0.04, 0.015, 16, 8)), 16U);
  EXPECT_LE(parts(solids::bored_block(4, 16, 0.01, 0.015, 0.04)), 48U);
}

TEST(ConvexParts, CornersOfTheSolidStayWhereTheyAre) {
  const solids::Solid solid = solids::l_shape();
  for (const ConvexMesh& part : cut_into_convex_parts(solid.soup)) {
    for (const Vec3& vertex : part.vertices()) {
      // All corners of this L are on a grid of 0.02 and 0.03 m, cuts included.
      EXPECT_TRUE(vertex.z == 0 || vertex.z == 0.03);
      for (const double x : {vertex.x, vertex.y})
        EXPECT_TRUE(x == 0 || x == 0.02 || x == 0.06) << x;
    }
  }
}

TEST(ConvexParts, CoverRandomSolidsAnywhereAtAnyScale) {
  constexpr std::uint64_t kSeed = 11;
  Random random(kSeed);
  for (int seed = 0; seed < 1000; ++seed) {
    const auto corners = 5 + static_cast<int>(random.below(20));
    const double height = 0.01 + 0.05 * random.unit();
    expect_cover(anywhere(solids::prism(solids::random_outline(random, corners), height), random),
                 "prism " + std::to_string(seed));
    const auto cells = 3 + static_cast<int>(random.below(25));
    expect_cover(anywhere(solids::random_blocks(random, cells), random),
                 "blocks " + std::to_string(seed));
    if (seed % 20 != 0) continue;
    const auto bores = 1 + static_cast<int>(random.below(4));
    const auto sides = 8 * (1 + static_cast<int>(random.below(3)));
    const double half = 0.0101 + 0.02 * random.unit();
    expect_cover(anywhere(solids::bored_block(bores, sides, 0.01, half, 0.04), random),
                 "bores " + std::to_string(seed));
  }
}

TEST(ConvexParts, CoverSinglePrecisionSolids) {
  constexpr std::uint64_t kSeed = 12;
  Random random(kSeed);
  for (int seed = 0; seed < 200; ++seed) {
    solids::Solid blocks = anywhere(solids::random_blocks(random, 12), random);
    solids::split_polygons(blocks.soup);
    expect_cover(in_single_precision(blocks), "blocks " + std::to_string(seed), 2e-5);
  }
  solids::Solid ring = solids::torus(0.04, 0.015, 24, 12);
  expect_cover(in_single_precision(ring), "torus", 1e-5);
  EXPECT_EQ(cut_into_convex_parts(in_single_precision(ring).soup).size(), 24U);
}

/// As files hold them: turned, so that no face is parallel to an axis, with some decimals.
TEST(ConvexParts, CoverRoundedSolids) {
  constexpr std::uint64_t kSeed = 23;
  Random random(kSeed);
  for (int i = 0; i < 200; ++i) {
    const int kind = static_cast<int>(random.below(4));
    solids::Solid solid =
        kind == 0   ? solids::random_blocks(random, 4 + static_cast<int>(random.below(12)))
        : kind == 1 ? solids::torus(0.03, 0.009, 8 + static_cast<int>(random.below(24)), 10)
        : kind == 2
            ? solids::prism(solids::random_outline(random, 6 + static_cast<int>(random.below(12))),
                            0.03)
            : solids::stair(2 + static_cast<int>(random.below(8)));
    if (kind < 2) solids::split_polygons(solid.soup);
    solid = solids::moved(solid, uniform_rotation(random), 1, Vec3(0));
    const double grain = std::array{0x1p-29, 1e-6, 1e-7, 1e-8}[random.below(4)];  // m
    for (Vec3& v : solid.soup.vertices) v = glm::round(v / grain) * grain;
    // A file may show more digits than it has: 0.012344999999999999.
    solid.soup.coordinate_error = random.below(2) == 0 ? 0.5 * grain : 0;
    try {
      const std::vector<ConvexMesh> parts = cut_into_convex_parts(solid.soup);
      EXPECT_NEAR(volume(parts) / solid.volume, 1, 1e-3) << i;
      if (solid.holds) {
        EXPECT_EQ(wrong_points(solid, parts, 1e-4), 0) << i;
      }
    } catch (const MeshError& error) {
      ADD_FAILURE() << i << " kind " << kind << " grain " << grain << ": " << error.faults()[0];
    }
  }
}

TEST(ConvexParts, ADentOfAnyDepth) {
  constexpr std::uint64_t kSeed = 13;
  Random random(kSeed);
  for (double depth = 0.02; depth > 1e-15; depth /= 3) {
    for (int turn = 0; turn < 4; ++turn) {
      const solids::Solid solid = solids::prism(
          {{0, 0}, {0.05, depth}, {0.1, 0}, {0.1, 0.05}, {0.05, 0.05 - depth}, {0, 0.05}}, 0.03);
      const solids::Solid placed = anywhere(solid, random);
      const std::vector<ConvexMesh> parts = convex_parts(placed.soup);
      EXPECT_NEAR(volume(parts), placed.volume, 1e-9 * placed.volume) << depth;
      EXPECT_LE(parts.size(), 4U) << depth;
    }
  }
}

TEST(ConvexParts, ConvexMeshIsExactlyItsOnlyPart) {
  for (const PolygonSoup& soup : {cube(0.06), cone(0.03, 0.06, 32), icosphere(0.03, 2)}) {
    const ConvexMesh plain(soup);
    const std::vector<ConvexMesh> parts = convex_parts(soup);
    ASSERT_EQ(parts.size(), 1U);
    ASSERT_EQ(parts[0].facets().size(), plain.facets().size());
    for (std::size_t f = 0; f < plain.facets().size(); ++f) {
      EXPECT_EQ(parts[0].facets()[f].normal, plain.facets()[f].normal);
      EXPECT_EQ(parts[0].facets()[f].offset, plain.facets()[f].offset);
    }
    ASSERT_EQ(parts[0].vertices().size(), plain.vertices().size());
    for (std::size_t v = 0; v < plain.vertices().size(); ++v)
      EXPECT_EQ(parts[0].vertices()[v], plain.vertices()[v]);
  }
}

PolygonSoup together(PolygonSoup one, const PolygonSoup& other, const Vec3& by, bool turned) {
  const auto first = static_cast<std::uint32_t>(one.vertices.size());
  for (const Vec3& vertex : other.vertices) one.vertices.push_back(vertex + by);
  for (std::vector<std::uint32_t> face : other.faces) {
    for (std::uint32_t& corner : face) corner += first;
    if (turned) std::reverse(face.begin(), face.end());
    one.faces.push_back(face);
  }
  return one;
}

TEST(ConvexParts, AVoidInsideIsLeftOut) {
  const PolygonSoup hollow = together(cube(0.06), cube(0.02), Vec3(0.01, 0, -0.005), true);
  const std::vector<ConvexMesh> parts = convex_parts(hollow);
  EXPECT_NEAR(volume(parts), 0.06 * 0.06 * 0.06 - 0.02 * 0.02 * 0.02, 1e-15);
  for (const ConvexMesh& part : parts) EXPECT_GT(out_of(part, Vec3(0.01, 0, -0.005)), 0.005);
}

TEST(ConvexParts, SeveralPiecesThatDoNotTouch) {
  const PolygonSoup two = together(cube(0.06), solids::l_shape().soup, Vec3(0.1, 0, 0), false);
  const std::vector<ConvexMesh> parts = convex_parts(two);
  EXPECT_EQ(parts.size(), 3U);
  EXPECT_NEAR(volume(parts), 0.06 * 0.06 * 0.06 + solids::l_shape().volume, 1e-15);
}

TEST(ConvexParts, ABrokenSolidIsRefusedWithTheReason) {
  PolygonSoup open = solids::l_shape().soup;
  open.faces.pop_back();
  EXPECT_EQ(refusal(open).rfind("open: edge", 0), 0U) << refusal(open);

  PolygonSoup turned = solids::l_shape().soup;
  std::reverse(turned.faces[3].begin(), turned.faces[3].end());
  EXPECT_EQ(refusal(turned).rfind("turned face: ", 0), 0U) << refusal(turned);

  PolygonSoup inside_out = solids::l_shape().soup;
  for (auto& face : inside_out.faces) std::reverse(face.begin(), face.end());
  EXPECT_EQ(refusal(inside_out).rfind("inside out: ", 0), 0U) << refusal(inside_out);

  // Two cubes through each other, one surface.
  const std::string crossed =
      refusal(together(cube(0.06), cube(0.06), Vec3(0.02, 0.01, 0.03), false));
  EXPECT_NE(crossed.find("winds round 2.00 times"), std::string::npos) << crossed;

  // A star drawn in one stroke winds twice around its middle.
  solids::Outline star;
  for (int k = 0; k < 5; ++k) {
    const double angle = 4 * std::numbers::pi * k / 5;
    star.push_back({0.03 * std::cos(angle), 0.03 * std::sin(angle)});
  }
  const std::string wound = refusal(solids::prism(star, 0.02).soup);
  EXPECT_EQ(wound.find("taken"), std::string::npos) << wound;
}

TEST(ConvexParts, ARoughSurfaceIsRefusedWithTheLimit) {
  solids::Blocks blocks;
  for (auto& lines : blocks.lines) {
    for (int k = 0; k <= 60; ++k) lines.push_back(0.001 * k);
  }
  for (int x = 0; x < 60; ++x) {
    for (int y = 0; y < 60; ++y) {
      for (int z = 0; z <= (x % 2 == 0 && y % 2 == 0 ? 1 : 0); ++z) blocks.filled.insert({x, y, z});
    }
  }
  const std::string rough = refusal(blocks.solid().soup);
  EXPECT_NE(rough.find("too many"), std::string::npos) << rough;
  EXPECT_NE(rough.find("expected"), std::string::npos) << rough;
}

}  // namespace
}  // namespace palpate::stimuli
