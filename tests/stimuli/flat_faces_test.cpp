#include "stimuli/flat_faces.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <glm/geometric.hpp>
#include <map>
#include <set>
#include <utility>

#include "data/base/random.h"
#include "stimuli/orientation.h"
#include "stimuli/side_groups.h"
#include "stimuli/weld.h"
#include "tests/shared/random_polyhedron.h"
#include "tests/stimuli/concave_solids.h"
#include "tests/stimuli/single_precision.h"
#include "tests/stimuli/surface_invariants.h"

namespace palpate::stimuli {
namespace {

using solids::Cut;
using solids::notched_disk;

struct FlatFace {
  std::size_t triangles = 0;
  double area = 0;          // m^2
  double edges = 0;         // m, length of all edges inside
  std::size_t largest = 0;  // triangles at a corner
  std::set<std::pair<std::uint32_t, std::uint32_t>> outline;
};

std::map<std::uint32_t, FlatFace> faces_of(const ClosedSurface& surface) {
  std::map<std::uint32_t, FlatFace> faces;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::size_t> at;
  for (std::uint32_t t = 0; t < surface.flat_face.size(); ++t) {
    if (surface.flat_face[t] == kNoFlatFace) continue;
    FlatFace& face = faces[surface.flat_face[t]];
    const auto& c = surface.triangles[t];
    const auto place = [&](std::size_t k) { return surface.vertices[c[k % 3]]; };
    ++face.triangles;
    face.area += 0.5 * glm::length(glm::cross(place(1) - place(0), place(2) - place(0)));
    for (std::size_t k = 0; k < 3; ++k) {
      face.largest = std::max(face.largest, ++at[{surface.flat_face[t], c[k]}]);
      if (surface.flat_face[surface.across[t][k]] == surface.flat_face[t]) {
        face.edges += 0.5 * glm::distance(place(k), place(k + 1));
      } else {
        face.outline.insert({c[k], c[(k + 1) % 3]});
      }
    }
  }
  return faces;
}

class FlatFaces : public ::testing::TestWithParam<Cut> {};

TEST_P(FlatFaces, DiskIsCutIntoAHierarchy) {
  constexpr std::uint32_t kCorners = 1000;
  const ClosedSurface surface = closed_surface(notched_disk(kCorners, GetParam())).surface;
  checks::expect_closed(surface);
  const auto faces = faces_of(surface);
  ASSERT_EQ(faces.size(), 2U);
  for (const auto& [number, face] : faces) {
    EXPECT_EQ(face.triangles, GetParam() == Cut::from_middle ? kCorners : kCorners - 2);
    EXPECT_EQ(face.outline.size(), kCorners);
    double twice = 0;
    for (const auto& [from, to] : face.outline) {
      const Vec3 &a = surface.vertices[from], &b = surface.vertices[to];
      twice += a.x * b.y - a.y * b.x;
    }
    EXPECT_NEAR(face.area, 0.5 * std::abs(twice), 1e-12);
    // A level of chords of a circle is as long as the circle; ten levels lead to the rim. A fan has
    // 1000 triangles at a corner, and 30 m of edges.
    EXPECT_LT(face.edges, 20 * 0.19);
    EXPECT_LT(face.largest, 30U);
  }
}

TEST_P(FlatFaces, RoundedDiskTurnedAnywhereIsFound) {
  Random random(3);
  for (int i = 0; i < 20; ++i) {
    PolygonSoup soup = testing::placed(notched_disk(200, GetParam()), uniform_rotation(random), 1,
                                       Vec3(0.01, 0, 0));
    for (Vec3& v : soup.vertices) v = checks::single_precision(v);
    soup.coordinate_error = 0.04 * 0x1p-24;
    const ClosedSurface surface = closed_surface(soup).surface;
    const auto faces = faces_of(surface);
    checks::expect_closed(surface);
    ASSERT_EQ(faces.size(), 2U) << i;
    for (const auto& [number, face] : faces) EXPECT_EQ(face.outline.size(), 200U);
  }
}

INSTANTIATE_TEST_SUITE_P(Cuts, FlatFaces,
                         ::testing::Values(Cut::from_notch, Cut::from_middle, Cut::zigzag));

TEST(FlatFaces, FewOrBentTrianglesStayAsTheyAre) {
  const ClosedSurface block = closed_surface(box(Vec3(0.1))).surface;
  EXPECT_TRUE(block.flat_face.empty());
  const ClosedSurface ball = closed_surface(icosphere(0.03, 4)).surface;
  EXPECT_TRUE(ball.flat_face.empty());
}

// A cube, its faces grids of right triangles.
TEST(FlatFaces, TidyTrianglesStayAsTheFileHasThem) {
  constexpr std::uint32_t kSide = 12;
  constexpr double kUnit = 0.05 / kSide;  // m
  PolygonSoup soup;
  for (int axis = 0; axis < 3; ++axis) {
    for (const double side : {-1.0, 1.0}) {
      const auto first = static_cast<std::uint32_t>(soup.vertices.size());
      for (std::uint32_t i = 0; i <= kSide; ++i) {
        for (std::uint32_t k = 0; k <= kSide; ++k) {
          Vec3 corner;
          corner[axis] = side * kSide * kUnit;
          corner[(axis + 1) % 3] = (2.0 * i - kSide) * kUnit;
          corner[(axis + 2) % 3] = side * (2.0 * k - kSide) * kUnit;
          soup.vertices.push_back(corner);
        }
      }
      for (std::uint32_t i = 0; i < kSide; ++i) {
        for (std::uint32_t k = 0; k < kSide; ++k) {
          const std::uint32_t at = first + i * (kSide + 1) + k, beyond = at + kSide + 1;
          soup.faces.push_back({at, beyond, beyond + 1});
          soup.faces.push_back({at, beyond + 1, at + 1});
        }
      }
    }
  }
  const ClosedSurface surface = closed_surface(soup).surface;
  ASSERT_EQ(faces_of(surface).size(), 6U);
  std::set<std::set<std::uint32_t>> before, after;
  const std::vector<std::uint32_t> kept = weld_equal(soup.vertices);
  std::map<std::uint32_t, std::uint32_t> number;
  for (const auto& face : soup.faces) {
    for (const std::uint32_t v : face)
      number.emplace(kept[v], static_cast<std::uint32_t>(number.size()));
    before.insert({number[kept[face[0]]], number[kept[face[1]]], number[kept[face[2]]]});
  }
  for (const auto& t : surface.triangles) after.insert({t[0], t[1], t[2]});
  EXPECT_EQ(after, before);
}

TEST(FlatFaces, TrianglesAtPocketsStay) {
  const PolygonSoup soup = notched_disk(100, Cut::from_middle);
  ClosedSurface surface;
  surface.vertices = soup.vertices;
  for (const auto& face : soup.faces) surface.triangles.push_back({face[0], face[1], face[2]});
  link_triangles(surface.vertices, surface.triangles,
                 SideGroups(surface.vertices.size(), surface.triangles), surface.across);
  surface.flat_face = find_flat_faces(surface, 1e-12);
  const auto before = surface.triangles;
  ClosedSurface pockets = surface;
  for (std::uint32_t t = 0; t < before.size(); ++t) pockets.at_pockets.push_back(t);
  cut_flat_faces_anew(pockets);
  EXPECT_EQ(pockets.triangles, before);
  cut_flat_faces_anew(surface);
  EXPECT_NE(surface.triangles, before);
}

}  // namespace
}  // namespace palpate::stimuli
