#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <numbers>
#include <sstream>

#include "stimuli/convex_mesh.h"
#include "stimuli/primitives.h"
#include "tests/shared/random_polyhedron.h"

namespace palpate::stimuli {
namespace {

using testing::placed;
using testing::triangulated;

std::vector<std::string> faults_of(const PolygonSoup& soup) {
  try {
    const ConvexMesh mesh(soup);
  } catch (const MeshError& error) {
    return error.faults();
  }
  return {};
}

bool mentions(const std::vector<std::string>& faults, const std::string& text) {
  return std::any_of(faults.begin(), faults.end(), [&](const std::string& fault) {
    return fault.find(text) != std::string::npos;
  });
}

/// The corners, sorted, of the two facets on either side of a dent.
std::vector<std::vector<std::uint32_t>> facets_of_the_dent(const std::vector<std::string>& faults) {
  std::vector<std::vector<std::uint32_t>> named(1);
  for (const std::string& fault : faults) {
    if (fault.find("form a dent") == std::string::npos) continue;
    std::istringstream words(fault.substr(fault.find("vertices ") + 9));
    for (std::string word; words >> word && word != "form";) {
      if (word == "and") {
        named.emplace_back();
      } else if (word != "...") {
        named.back().push_back(static_cast<std::uint32_t>(std::stoul(word)));
      }
    }
    break;
  }
  for (auto& corners : named) std::sort(corners.begin(), corners.end());
  return named;
}

#define EXPECT_FAULT(soup, text)                                           \
  do {                                                                     \
    const std::vector<std::string> found = faults_of(soup);                \
    EXPECT_TRUE(mentions(found, text)) << ::testing::PrintToString(found); \
  } while (false)

void append(PolygonSoup& soup, const PolygonSoup& other) {
  const auto first = static_cast<std::uint32_t>(soup.vertices.size());
  soup.vertices.insert(soup.vertices.end(), other.vertices.begin(), other.vertices.end());
  for (auto face : other.faces) {
    for (std::uint32_t& v : face) v += first;
    soup.faces.push_back(face);
  }
}

// A solid over the star polygon {5/2}: all its edges are convex, but it winds twice.
std::vector<Vec3> pentagram_corners(double z) {
  std::vector<Vec3> corners;
  for (int k = 0; k < 5; ++k) {
    const double angle = 4 * std::numbers::pi * k / 5;
    corners.emplace_back(std::cos(angle), std::sin(angle), z);
  }
  return corners;
}

PolygonSoup double_star_pyramids() {
  PolygonSoup soup;
  soup.vertices = pentagram_corners(0);
  soup.vertices.emplace_back(0, 0, 1);
  soup.vertices.emplace_back(0, 0, -1);
  for (std::uint32_t k = 0; k < 5; ++k) {
    soup.faces.push_back({k, (k + 1) % 5, 5});
    soup.faces.push_back({(k + 1) % 5, k, 6});
  }
  return soup;
}

PolygonSoup star_prism() {
  PolygonSoup soup;
  soup.vertices = pentagram_corners(-1);
  const std::vector<Vec3> top = pentagram_corners(1);
  soup.vertices.insert(soup.vertices.end(), top.begin(), top.end());
  for (std::uint32_t k = 0; k < 5; ++k) {
    const std::uint32_t next = (k + 1) % 5;
    soup.faces.push_back({k, next, 5 + next, 5 + k});
  }
  soup.faces.push_back({4, 3, 2, 1, 0});
  soup.faces.push_back({5, 6, 7, 8, 9});
  return soup;
}

TEST(ConvexMeshFaults, NamesAnOpenSurface) {
  PolygonSoup soup = cube(0.06);
  soup.faces.pop_back();
  EXPECT_FAULT(soup, "open: edge");
  EXPECT_FAULT(soup, "open: 1 more");
}

TEST(ConvexMeshFaults, NamesATurnedFace) {
  PolygonSoup soup = cube(0.06);
  std::reverse(soup.faces[3].begin(), soup.faces[3].end());
  EXPECT_FAULT(soup, "turned face: edge");
  EXPECT_FAULT(soup, "face 3 (vertices");
}

TEST(ConvexMeshFaults, NamesAnObjectInsideOut) {
  PolygonSoup soup = cube(0.06);
  for (auto& face : soup.faces) std::reverse(face.begin(), face.end());
  const std::vector<std::string> faults = faults_of(soup);
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_NE(faults[0].find("inside out"), std::string::npos);
}

TEST(ConvexMeshFaults, NamesADent) {
  PolygonSoup soup = icosphere(0.03, 2);
  soup.vertices[20] *= 0.9;
  EXPECT_FAULT(soup, "not convex: edge");
}

TEST(ConvexMeshFaults, FindsDentsOfAMillionthOfTheSize) {
  PolygonSoup soup = triangulated(cube(1));
  ASSERT_TRUE(faults_of(soup).empty());
  const auto centre = static_cast<std::uint32_t>(soup.vertices.size());
  soup.vertices.emplace_back(0, 0, 0.5 - 1e-6);
  std::erase_if(soup.faces, [&](const std::vector<std::uint32_t>& face) {
    return std::all_of(face.begin(), face.end(),
                       [&](std::uint32_t v) { return soup.vertices[v].z == 0.5; });
  });
  for (std::uint32_t k = 0; k < 4; ++k) soup.faces.push_back({4 + k, 4 + (k + 1) % 4, centre});
  EXPECT_FAULT(soup, "not convex: edge");
  soup.vertices[centre].z = 0.5 + 1e-6;
  EXPECT_TRUE(faults_of(soup).empty());
}

TEST(ConvexMeshFaults, NamesSeparatePieces) {
  PolygonSoup soup = cube(0.06);
  append(soup, placed(cube(0.02), Quat(1, 0, 0, 0), 1, Vec3(0.2, 0, 0)));
  EXPECT_FAULT(soup, "separate pieces: face 6");
}

TEST(ConvexMeshFaults, NamesBodiesThatTouchInACorner) {
  PolygonSoup soup = cube(1);
  append(soup, placed(cube(1), Quat(1, 0, 0, 0), 1, Vec3(1, 1, 1)));
  EXPECT_FAULT(soup, "separate pieces");
}

TEST(ConvexMeshFaults, NamesVerticesTooNearToDistinguish) {
  // An octahedron with two opposite corners 1 mm apart.
  PolygonSoup soup{
      {{5e-4, 0, 0}, {0, 0.03, 0}, {-5e-4, 0, 0}, {0, -0.03, 0}, {0, 0, 0.03}, {0, 0, -0.03}},
      {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}, {1, 0, 5}, {2, 1, 5}, {3, 2, 5}, {0, 3, 5}}};
  EXPECT_EQ(faults_of(soup), std::vector<std::string>());
  soup.coordinate_error = 5e-4;
  EXPECT_TRUE(mentions(faults_of(soup), "shared edge"));
  EXPECT_TRUE(
      mentions(faults_of(soup),
               "1 vertices are indistinguishable from others near them, with coordinates known to "
               "0.0005 m"));
}

TEST(ConvexMeshFaults, NamesAnEdgeOfFourFaces) {
  PolygonSoup soup = cube(1);
  append(soup, placed(cube(1), Quat(1, 0, 0, 0), 1, Vec3(1, 1, 0)));
  EXPECT_FAULT(soup, "shared edge: edge");
}

TEST(ConvexMeshFaults, NamesAVertexWhereTheSurfaceMeetsItself) {
  PolygonSoup soup = icosphere(0.03, 2);
  soup.vertices[7] = soup.vertices[3];
  EXPECT_FAULT(soup, "shared vertex: vertex 3");
}

// A hollow of so many strips that each fold between them is within the error of the corners.
TEST(ConvexMeshFaults, FindsAHollowWithFoldsWithinTheError) {
  constexpr std::uint32_t kStrips = 200;
  PolygonSoup soup;
  soup.coordinate_error = 1e-6;
  std::vector<std::uint32_t> front{0, 1}, back;
  soup.vertices = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1}};
  for (std::uint32_t k = 0; k <= kStrips; ++k) {
    const double x = 1 - 2.0 * k / kStrips;
    const double z = -0.02 * (1 - x * x);
    soup.vertices.emplace_back(x, -1, z);
    soup.vertices.emplace_back(x, 1, z);
    front.push_back(4 + 2 * k);
    back.push_back(5 + 2 * (kStrips - k));
    if (k > 0) soup.faces.push_back({2 + 2 * k, 3 + 2 * k, 5 + 2 * k, 4 + 2 * k});
  }
  back.insert(back.end(), {2, 3});
  soup.faces.push_back(front);
  soup.faces.push_back(back);
  soup.faces.push_back({3, 2, 1, 0});
  soup.faces.push_back({1, 2, 5, 4});
  soup.faces.push_back({0, 4 + 2 * kStrips, 5 + 2 * kStrips, 3});
  EXPECT_FAULT(soup, "form a dent");
  EXPECT_FALSE(mentions(faults_of(soup), "not convex: edge"));
  // The named facets meet in an edge.
  const auto named = facets_of_the_dent(faults_of(soup));
  ASSERT_EQ(named.size(), 2U);
  EXPECT_EQ(named[0].size(), 4U);
  EXPECT_EQ(named[1].size(), 4U);
  std::vector<std::uint32_t> shared;
  std::set_intersection(named[0].begin(), named[0].end(), named[1].begin(), named[1].end(),
                        std::back_inserter(shared));
  EXPECT_EQ(shared.size(), 2U) << ::testing::PrintToString(named);
}

TEST(ConvexMeshFaults, FindsConvexEdgesThatWindTwice) {
  EXPECT_FAULT(double_star_pyramids(), "wound vertex");
  EXPECT_FAULT(star_prism(), "wound facet");
  constexpr std::uint64_t kSeed = 1;
  Random random(kSeed);
  for (int i = 0; i < 20; ++i) {
    const Quat turn = uniform_rotation(random);
    EXPECT_FAULT(placed(double_star_pyramids(), turn, 0.05, Vec3(0.2)), "wound vertex");
    EXPECT_FAULT(placed(star_prism(), turn, 0.05, Vec3(0.2)), "wound facet");
  }
}

// Faults of faces and corners are found in any order.
TEST(ConvexMeshFaults, ChecksEveryFacetAndVertex) {
  PolygonSoup prism = star_prism();
  for (std::size_t i = 0; i < prism.faces.size(); ++i) {
    std::rotate(prism.faces.begin(), prism.faces.begin() + 1, prism.faces.end());
    EXPECT_EQ(faults_of(prism).size(), 2U);  // stars
  }
  PolygonSoup pyramids = double_star_pyramids();
  for (std::size_t i = 0; i < pyramids.faces.size(); ++i) {
    std::rotate(pyramids.faces.begin(), pyramids.faces.begin() + 1, pyramids.faces.end());
    EXPECT_EQ(faults_of(pyramids).size(), 2U);  // tips
  }
}

TEST(ConvexMeshFaults, NamesCoordinatesThatAreNotFinite) {
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e200}) {
    PolygonSoup soup = cube(0.06);
    soup.vertices[5].y = bad;
    EXPECT_FAULT(soup, "not finite: vertex 5");
  }
}

TEST(ConvexMeshFaults, NamesVerticesThatDoNotExist) {
  PolygonSoup soup = cube(0.06);
  soup.faces[2][1] = 8;
  EXPECT_FAULT(soup, "no such vertex: face 2");
  soup.faces[2][1] = 0xffffffff;
  EXPECT_FAULT(soup, "found 4294967295");
}

TEST(ConvexMeshFaults, NamesFacesWithTooFewOrCrossedCorners) {
  PolygonSoup soup = cube(0.06);
  soup.faces[4] = {1, 2};
  EXPECT_FAULT(soup, "too few corners: face 4");
  soup = cube(0.06);
  soup.faces[0] = {0, 3, 2, 1, 3};
  EXPECT_FAULT(soup, "crossed face: face 0");
  EXPECT_FAULT(soup, "open: edge 1-2 of face 3");  // a crossed face closes nothing
}

TEST(ConvexMeshFaults, NamesAFaceThatIsNotPlane) {
  PolygonSoup soup = cube(0.06);
  soup.vertices[6] *= 1.001;
  EXPECT_FAULT(soup, "bent face: face 1");
}

TEST(ConvexMeshFaults, NamesAFlatObject) {
  PolygonSoup soup;
  soup.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  soup.faces = {{0, 1, 2}, {0, 2, 1}};
  EXPECT_FAULT(soup, "flat");
  soup.vertices = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}};
  soup.faces = {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}};
  EXPECT_FAULT(soup, "flat");
  soup.vertices.assign(4, Vec3(1, 1, 1));
  EXPECT_FALSE(faults_of(soup).empty());
}

TEST(ConvexMeshFaults, NamesAnEmptySoup) {
  EXPECT_FAULT(PolygonSoup{}, "empty");
  PolygonSoup soup;
  soup.vertices = cube(1).vertices;
  EXPECT_FAULT(soup, "empty");
}

TEST(ConvexMeshFaults, ListsOnlyTheFirstOfEveryKind) {
  PolygonSoup soup = icosphere(0.03, 3);
  std::reverse(soup.faces[100].begin(), soup.faces[100].end());
  soup.faces.resize(soup.faces.size() - 50);
  const std::vector<std::string> faults = faults_of(soup);
  EXPECT_TRUE(mentions(faults, "turned face: edge"));
  EXPECT_TRUE(mentions(faults, "open: edge"));
  EXPECT_TRUE(mentions(faults, " more"));
  EXPECT_LE(faults.size(), 20U);
}

// Any soup either becomes a mesh or is refused; nothing else may happen.
TEST(ConvexMeshFaults, RandomSoupsNeverCrash) {
  constexpr std::uint64_t kSeed = 2;
  Random random(kSeed);
  for (int i = 0; i < 3000; ++i) {
    PolygonSoup soup = random.below(2) == 0 ? triangulated(cube(1)) : icosphere(1, 1);
    for (std::uint64_t damage = 1 + random.below(4); damage > 0; --damage) {
      auto& face = soup.faces[random.below(soup.faces.size())];
      switch (random.below(6)) {
        case 0:
          face[random.below(face.size())] =
              static_cast<std::uint32_t>(random.below(soup.vertices.size() + 1));
          break;
        case 1:
          std::swap(face[0], face[1]);
          break;
        case 2:
          face.push_back(static_cast<std::uint32_t>(random.below(soup.vertices.size())));
          break;
        case 3:
          soup.vertices[random.below(soup.vertices.size())] =
              soup.vertices[random.below(soup.vertices.size())];
          break;
        case 4:
          soup.vertices[random.below(soup.vertices.size())] *= random.normal();
          break;
        default:
          soup.faces.push_back(face);
      }
    }
    faults_of(soup);
  }
}

}  // namespace
}  // namespace palpate::stimuli
