#include "stimuli/convex_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/common.hpp>
#include <glm/geometric.hpp>

#include "stimuli/primitives.h"
#include "tests/shared/random_polyhedron.h"
#include "tests/stimuli/mesh_invariants.h"
#include "tests/stimuli/single_precision.h"

namespace palpate::stimuli {
namespace {

using checks::expect_convex_mesh;
using testing::placed;
using testing::triangulated;

struct Counts {
  std::size_t vertices, edges, facets;
  bool operator==(const Counts&) const = default;
};

Counts counts_of(const ConvexMesh& mesh) {
  return {mesh.vertices().size(), mesh.edges().size(), mesh.facets().size()};
}

void expect_counts(const PolygonSoup& soup, const Counts& expected) {
  const ConvexMesh mesh(soup);
  expect_convex_mesh(mesh, 1e-12 * mesh.size());
  EXPECT_EQ(mesh.vertices().size(), expected.vertices);
  EXPECT_EQ(mesh.edges().size(), expected.edges);
  EXPECT_EQ(mesh.facets().size(), expected.facets);
}

// Every face cut into four at the middles of its sides, n times.
PolygonSoup cut(PolygonSoup soup, int times) {
  for (; times > 0; --times) {
    PolygonSoup finer;
    for (const auto& face : triangulated(soup).faces) {
      const Vec3 a = soup.vertices[face[0]], b = soup.vertices[face[1]], c = soup.vertices[face[2]];
      const Vec3 ab = (a + b) / 2.0, bc = (b + c) / 2.0, ca = (c + a) / 2.0;
      for (const auto& corners : {std::array{a, ab, ca}, std::array{b, bc, ab},
                                  std::array{c, ca, bc}, std::array{ab, bc, ca}}) {
        const auto first = static_cast<std::uint32_t>(finer.vertices.size());
        finer.vertices.insert(finer.vertices.end(), corners.begin(), corners.end());
        finer.faces.push_back({first, first + 1, first + 2});
      }
    }
    soup = std::move(finer);
  }
  return soup;
}

TEST(ConvexMesh, PrimitivesHaveTheirFacets) {
  expect_counts(cube(0.06), {8, 12, 6});
  expect_counts(cone(0.03, 0.06, 64), {65, 128, 65});
  expect_counts(cylinder(0.03, 0.06, 64), {128, 192, 66});
  expect_counts(icosphere(0.03, 0), {12, 30, 20});
  expect_counts(icosphere(0.03, 3), {642, 1920, 1280});
}

TEST(ConvexMesh, CoplanarTrianglesBecomeOneFacet) {
  constexpr std::uint64_t kSeed = 1;
  Random random(kSeed);
  for (int i = 0; i < 20; ++i) {
    const Quat turn = uniform_rotation(random);
    const Vec3 to(random.normal(), random.normal(), random.normal());
    expect_counts(placed(triangulated(cube(0.06)), turn, 1, to), {8, 12, 6});
    expect_counts(placed(triangulated(cylinder(0.03, 0.06, 64)), turn, 1, to), {128, 192, 66});
    expect_counts(placed(triangulated(cone(0.03, 0.06, 64)), turn, 1, to), {65, 128, 65});
  }
}

TEST(ConvexMesh, VerticesWithinFacetsAndAlongEdgesAreDropped) {
  constexpr std::uint64_t kSeed = 2;
  Random random(kSeed);
  for (int i = 0; i < 5; ++i) {
    const Quat turn = uniform_rotation(random);
    expect_counts(placed(cut(cube(0.06), 4), turn, 1, Vec3(0.1)), {8, 12, 6});
    expect_counts(placed(cut(cone(0.03, 0.06, 7), 3), turn, 1, Vec3(0.1)), {8, 14, 8});
    expect_counts(placed(cut(icosphere(0.03, 0), 3), turn, 1, Vec3(0.1)), {12, 30, 20});
    expect_counts(placed(cut(testing::needle(1, 1e-3), 3), turn, 1, Vec3(0.1)), {8, 12, 6});
  }
}

TEST(ConvexMesh, DuplicateVerticesAreWelded) {
  constexpr std::uint64_t kSeed = 3;
  Random random(kSeed);
  const PolygonSoup whole = triangulated(cube(0.06));
  PolygonSoup soup;
  for (const auto& face : whole.faces) {
    soup.faces.push_back({});
    for (const std::uint32_t v : face) {
      soup.faces.back().push_back(static_cast<std::uint32_t>(soup.vertices.size()));
      // Apart by rounding of arithmetic.
      const double jitter = 1e-16 * (random.unit() - 0.5);
      soup.vertices.push_back(whole.vertices[v] + Vec3(jitter, -jitter, jitter));
    }
  }
  expect_counts(soup, {8, 12, 6});
}

TEST(ConvexMesh, UnusedVerticesDoNotCount) {
  PolygonSoup soup = cube(0.06);
  soup.vertices.emplace_back(1e12, 0, 0);
  expect_counts(soup, {8, 12, 6});
}

TEST(ConvexMesh, CollapsedFacesAreDropped) {
  PolygonSoup soup = triangulated(cube(0.06));
  // A second copy of corner 0, used by one face, and the sliver between the copies.
  soup.vertices.push_back(soup.vertices[0]);
  soup.faces[0][0] = 8;
  soup.faces.push_back({0, 8, soup.faces[0][1]});
  expect_counts(soup, {8, 12, 6});
}

// A vertex in the middle of an edge that only one of the two faces has is often bridged by a
// triangle without area.
TEST(ConvexMesh, TrianglesWithoutAreaJoinTheirNeighbour) {
  PolygonSoup soup = cube(2);
  ASSERT_EQ(soup.faces[0], (std::vector<std::uint32_t>{0, 3, 2, 1}));
  soup.vertices.emplace_back(0, -1, -1);  // between 0 and 1
  soup.faces[0] = {0, 3, 2, 1, 8};
  soup.faces.push_back({1, 0, 8});
  constexpr std::uint64_t kSeed = 4;
  Random random(kSeed);
  for (int i = 0; i < 20; ++i) {
    expect_counts(placed(soup, uniform_rotation(random), 0.05, Vec3(0.02)), {8, 12, 6});
  }
}

TEST(ConvexMesh, RandomPolyhedraSatisfyEveryInvariant) {
  constexpr std::uint64_t kSeed = 5;
  Random random(kSeed);
  for (int i = 0; i < 200; ++i) {
    const int points = 4 + i % 40;
    const Vec3 axes(1, 0.01 + random.unit(), 0.01 + random.unit());
    const double scale = 1e-4 * std::pow(1e6, random.unit());  // 0.1 mm to 100 m
    const PolygonSoup soup =
        placed(testing::random_polyhedron(random, points, axes), uniform_rotation(random), scale,
               scale * Vec3(random.normal(), random.normal(), random.normal()));
    const ConvexMesh mesh(soup);
    expect_convex_mesh(mesh, 1e-12 * mesh.size());
    ASSERT_EQ(mesh.vertices().size(), static_cast<std::size_t>(points));
    ASSERT_EQ(mesh.facets().size(), 2 * mesh.vertices().size() - 4);
  }
}

TEST(ConvexMesh, NeedlesAndPlatesSurvive) {
  constexpr std::uint64_t kSeed = 6;
  Random random(kSeed);
  for (const double aspect : {1e2, 1e4, 1e6}) {
    for (const double length : {2e-4, 0.05, 20.0}) {
      const Quat turn = uniform_rotation(random);
      const auto at = [&](const PolygonSoup& soup) {
        return placed(triangulated(soup), turn, length, Vec3(0.3 * length));
      };
      expect_counts(at(testing::needle(1, 1 / aspect)), {8, 12, 6});
      expect_counts(at(testing::plate(1, 1 / aspect)), {8, 12, 6});
      expect_counts(at(testing::prism(3, 1 / aspect, 1)), {6, 9, 5});
      expect_counts(at(testing::prism(12, 1 / aspect, 1)), {24, 36, 14});
      expect_counts(at(testing::prism(64, 1, 1 / aspect)), {128, 192, 66});
      expect_counts(at(cone(1 / aspect, 1, 12)), {13, 24, 13});
      expect_counts(at(cone(1, 1 / aspect, 12)), {13, 24, 13});
    }
  }
}

TEST(ConvexMesh, WorksAKilometreFromTheOrigin) {
  constexpr std::uint64_t kSeed = 7;
  Random random(kSeed);
  for (const double scale : {1e-4, 1e-3, 0.05, 100.0}) {
    for (int i = 0; i < 10; ++i) {
      const auto far = [&](const PolygonSoup& soup) {
        const ConvexMesh mesh(
            placed(triangulated(soup), uniform_rotation(random), scale, Vec3(1000, -1000, 1000)));
        // The coordinates themselves are 1.1e-13 m apart there.
        expect_convex_mesh(mesh, 1e-12 * mesh.size() + 5e-12);
        return counts_of(mesh);
      };
      EXPECT_EQ(far(cube(1)), (Counts{8, 12, 6}));
      EXPECT_EQ(far(cylinder(0.5, 1, 16)), (Counts{32, 48, 18}));
      EXPECT_EQ(far(icosphere(0.5, 2)), (Counts{162, 480, 320}));
    }
  }
}

TEST(ConvexMesh, SinglePrecisionCoordinatesKeepTheFacets) {
  constexpr std::uint64_t kSeed = 8;
  Random random(kSeed);
  for (int i = 0; i < 50; ++i) {
    const auto rounded = [&](PolygonSoup soup) {
      soup = placed(triangulated(soup), uniform_rotation(random), 0.06, Vec3(0.1));
      for (Vec3& vertex : soup.vertices) vertex = checks::single_precision(vertex);
      soup.coordinate_error = 0.2 * 0x1p-24;
      const ConvexMesh mesh(soup);
      expect_convex_mesh(mesh, 4e-7 * mesh.size());
      return counts_of(mesh);
    };
    EXPECT_EQ(rounded(cut(cube(1), 2)), (Counts{8, 12, 6}));
    EXPECT_EQ(rounded(cylinder(0.5, 1, 64)), (Counts{128, 192, 66}));
    EXPECT_EQ(rounded(icosphere(0.5, 3)), (Counts{642, 1920, 1280}));
  }
}

TEST(ConvexMesh, CutHullsInSinglePrecisionAreNotRefused) {
  constexpr std::uint64_t kSeed = 10;
  Random random(kSeed);
  for (int i = 0; i < 300; ++i) {
    // In separate statements: compilers differ in the order of arguments.
    const double thin = 0.03 + 0.97 * random.unit(), flat = 0.03 + 0.97 * random.unit();
    const Quat turn = uniform_rotation(random);
    const PolygonSoup hull = testing::random_polyhedron(random, 5 + i % 30, Vec3(1, flat, thin));
    PolygonSoup soup = placed(cut(hull, i % 4), turn, 0.06, Vec3(0.1));
    for (Vec3& vertex : soup.vertices) vertex = checks::single_precision(vertex);
    soup.coordinate_error = 0.2 * 0x1p-24;
    const ConvexMesh mesh(soup);
    ASSERT_LE(mesh.facets().size(), static_cast<std::size_t>(2 * (5 + i % 30) - 4));
  }
}

// Where neighbours are coplanar within their error but the whole is round, merging must end: facets
// stay within a few errors of the surface.
TEST(ConvexMesh, SurfacesFinerThanTheirErrorStayRound) {
  PolygonSoup soup = cylinder(1, 1, 2000);
  soup.coordinate_error = 2e-6;
  const ConvexMesh mesh(soup);
  EXPECT_LT(mesh.facets().size(), 1500U);
  EXPECT_GT(mesh.facets().size(), 300U);
  for (const Facet& facet : mesh.facets()) {
    if (std::abs(facet.normal.z) < 0.5) {
      EXPECT_NEAR(facet.offset, 1, 5e-5);
    }
  }
}

// Where corners crowd together, the error of their coordinates hides the folds between some faces
// but not others. The merged region may not be a polygon, but the faces form a solid.
TEST(ConvexMesh, HullsOfCrowdedPointsAreNotRefused) {
  for (const double spread : {0.03, 0.01, 3e-3, 1e-3, 3e-4, 1e-4, 1e-5}) {
    for (std::uint64_t seed = 1; seed < 4; ++seed) {
      Random random(seed, {77});
      const Vec3 crowd = uniform_rotation(random) * Vec3(0, 0, 1);
      std::vector<Vec3> points;
      for (int i = 0; i < 1200; ++i) {
        const Vec3 anywhere = uniform_rotation(random) * Vec3(0, 0, 1);
        const double away = spread * random.unit();
        points.push_back(0.03 * (i % 10 == 0 ? anywhere : glm::normalize(crowd + away * anywhere)));
      }
      const ConvexMesh mesh(testing::hull_of(points));
      for (const Vec3& point : points) {
        for (const Facet& facet : mesh.facets()) {
          ASSERT_LE(glm::dot(facet.normal, point) - facet.offset, 1e-9 * mesh.size())
              << "spread " << spread << " seed " << seed;
        }
      }
    }
  }
}

// A file's digits round the corners of a crowd. Some faces then are dents, indistinguishable from
// flat, and the hull of the corners is meant.
TEST(ConvexMesh, AcceptsHullsOfCrowdedAndRoundedPoints) {
  for (const double spread : {0.1, 0.03, 0.01, 3e-3, 1e-3}) {
    for (std::uint64_t seed = 1; seed < 6; ++seed) {
      Random random(seed, {78});
      const Vec3 crowd = uniform_rotation(random) * Vec3(0, 0, 1);
      std::vector<Vec3> points;
      for (int i = 0; i < 1500; ++i) {
        const Vec3 anywhere = uniform_rotation(random) * Vec3(0, 0, 1);
        const double away = spread * random.unit();
        points.push_back(0.03 * (i % 10 == 0 ? anywhere : glm::normalize(crowd + away * anywhere)));
      }
      PolygonSoup soup = testing::hull_of(points);
      // The corners' distances shrink with the spread, and the folds with their square.
      const double step = 3e-6 * spread * spread;
      for (Vec3& vertex : soup.vertices) vertex = step * glm::round(vertex / step);
      soup.coordinate_error = step / 2;
      const ConvexMesh mesh(soup);
      double above = 0, below = 0;
      for (const Vec3& vertex : soup.vertices) {
        double highest = -1;
        for (const Facet& facet : mesh.facets()) {
          highest = std::max(highest, glm::dot(facet.normal, vertex) - facet.offset);
        }
        above = std::max(above, highest);
        below = std::max(below, -highest);
      }
      EXPECT_LE(above, 64 * step) << "spread " << spread << " seed " << seed;
      EXPECT_LE(below, 64 * step) << "spread " << spread << " seed " << seed;
    }
  }
}

// Facets that are consecutive in memory are close in space: most neighbours of a facet of a large
// sphere lie within the same small part of the array.
TEST(ConvexMesh, NeighboursInSpaceAreNeighboursInMemory) {
  PolygonSoup soup = icosphere(0.03, 5);
  constexpr std::uint64_t kSeed = 9;
  Random(kSeed).shuffle(soup.faces);
  const ConvexMesh mesh(soup);
  std::size_t near = 0;
  for (const Edge& edge : mesh.edges()) {
    const auto gap = std::abs(static_cast<long>(edge.left) - static_cast<long>(edge.right));
    if (gap <= 64) ++near;
  }
  EXPECT_GT(near, mesh.edges().size() * 3 / 4);
  // From a facet to the next one in memory: in random order that would be as far as the radius.
  double step = 0, side = 0;  // m, sums
  for (std::size_t f = 1; f < mesh.facets().size(); ++f) {
    const auto place = [&](std::size_t facet) {
      return mesh.vertices()[checks::corner_of(mesh, static_cast<std::uint32_t>(facet), 0)];
    };
    step += glm::distance(place(f), place(f - 1));
  }
  for (const Edge& edge : mesh.edges()) side += glm::distance(edge.from, edge.to);
  EXPECT_LT(step / static_cast<double>(mesh.facets().size()),
            4 * side / static_cast<double>(mesh.edges().size()));
  for (std::uint32_t f = 0, seen = 0; f < mesh.facets().size(); ++f) {
    for (std::uint32_t k = 0; k < 3; ++k) {
      const std::uint32_t corner = checks::corner_of(mesh, f, k);
      EXPECT_LE(corner, seen) << "vertices are numbered as facets first use them";
      seen = std::max(seen, corner + 1);
    }
  }
}

TEST(ConvexMesh, BoundingSphereIsTightForSymmetricShapes) {
  const ConvexMesh sphere(placed(icosphere(0.03, 2), Quat(1, 0, 0, 0), 1, Vec3(1, 2, 3)));
  EXPECT_NEAR(sphere.radius(), 0.03, 1e-12);
  EXPECT_NEAR(glm::distance(sphere.centre(), Vec3(1, 2, 3)), 0, 1e-12);
  EXPECT_NEAR(ConvexMesh(cube(2)).radius(), std::sqrt(3), 1e-15);
  EXPECT_EQ(ConvexMesh(cube(2)).size(), 2 * ConvexMesh(cube(2)).radius());
}

TEST(ConvexMesh, BuildsLargeSpheres) {
#ifdef NDEBUG
  constexpr int kSubdivisions = 8;
#else
  constexpr int kSubdivisions = 6;
#endif
  const ConvexMesh mesh(icosphere(0.03, kSubdivisions));
  const std::size_t triangles = std::size_t{20} << (2U * kSubdivisions);
  EXPECT_EQ(counts_of(mesh), (Counts{triangles / 2 + 2, 3 * triangles / 2, triangles}));
}

}  // namespace
}  // namespace palpate::stimuli
