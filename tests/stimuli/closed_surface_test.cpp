#include "stimuli/closed_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <set>
#include <tuple>
#include <utility>

#include "data/base/random.h"
#include "stimuli/mesh_file.h"
#include "stimuli/orientation.h"
#include "stimuli/parts/triangle_surface.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"
#include "tests/shared/random_polyhedron.h"
#include "tests/stimuli/concave_solids.h"
#include "tests/stimuli/surface_invariants.h"

namespace palpate::stimuli {
namespace {

using checks::expect_closed;
using testing::placed;
using testing::triangulated;

TriangleSurface places_of(const ClosedSurface& surface) {
  TriangleSurface triangles;
  for (const auto& t : surface.triangles)
    triangles.push_back({surface.vertices[t[0]], surface.vertices[t[1]], surface.vertices[t[2]]});
  return triangles;
}

double volume_in(const ClosedSurface& surface) { return bulk_of(places_of(surface)).volume; }

std::string notes_of(const CleanedSurface& cleaned) {
  std::string text;
  for (const std::string& note : cleaned.notes) text += note + "\n";
  return text;
}

std::string surface_refusal(const PolygonSoup& soup) {
  try {
    closed_surface(soup);
  } catch (const MeshError& error) {
    return error.what();
  }
  return "";
}

void add_shell(PolygonSoup& soup, const PolygonSoup& other) {
  const auto first = static_cast<std::uint32_t>(soup.vertices.size());
  soup.vertices.insert(soup.vertices.end(), other.vertices.begin(), other.vertices.end());
  for (std::vector<std::uint32_t> face : other.faces) {
    for (std::uint32_t& v : face) v += first;
    soup.faces.push_back(std::move(face));
  }
}

PolygonSoup shifted(PolygonSoup soup, const Vec3& by) {
  for (Vec3& v : soup.vertices) v += by;
  return soup;
}

PolygonSoup turned_over(PolygonSoup soup) {
  for (auto& face : soup.faces) std::reverse(face.begin(), face.end());
  return soup;
}

TEST(ClosedSurfaceTest, ASurfaceOfTrianglesIsKeptUnchanged) {
  const PolygonSoup sphere = icosphere(0.03, 2);
  const CleanedSurface cleaned = closed_surface(sphere);
  EXPECT_EQ(notes_of(cleaned), "");
  expect_closed(cleaned.surface);
  ASSERT_EQ(cleaned.surface.triangles.size(), sphere.faces.size());
  for (std::size_t f = 0; f < sphere.faces.size(); ++f) {
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_EQ(cleaned.surface.vertices[cleaned.surface.triangles[f][k]],
                sphere.vertices[sphere.faces[f][k]]);
  }
}

// Any outline, so concave, and with hundreds of corners.
TEST(ClosedSurfaceTest, CutsFacesIntoTrianglesOfTheSameVolume) {
  constexpr std::uint64_t kSeed = 5;
  Random random(kSeed);
  for (int i = 0; i < 200; ++i) {
    solids::Outline outline;
    const auto corners = 3 + random.below(i % 10 == 0 ? 400 : 30);
    for (std::uint64_t k = 0; k < corners; ++k) {
      const double angle =
          2 * std::numbers::pi * static_cast<double>(k) / static_cast<double>(corners);
      const double radius = 0.01 + 0.03 * random.unit();
      outline.push_back({radius * std::cos(angle), radius * std::sin(angle)});
    }
    const solids::Solid solid = solids::prism(outline, 0.02);
    const PolygonSoup soup = placed(solid.soup, uniform_rotation(random), 1, Vec3(0.1, 0, 0));
    const CleanedSurface cleaned = closed_surface(soup);
    expect_closed(cleaned.surface);
    EXPECT_EQ(cleaned.surface.triangles.size(), 4 * corners - 4);
    EXPECT_NEAR(volume_in(cleaned.surface), solid.volume, 1e-12 * 0.04);
    // Each triangle has its face's orientation: no part of a cap counts twice.
    double sides = 0;
    for (std::size_t k = 0; k < outline.size(); ++k) {
      const auto &from = outline[k], &to = outline[(k + 1) % outline.size()];
      sides += 0.02 * std::hypot(to[0] - from[0], to[1] - from[1]);
    }
    EXPECT_NEAR(bulk_of(places_of(cleaned.surface)).area, 2 * solids::area_of(outline) + sides,
                1e-9);
  }
}

TEST(ClosedSurfaceTest, BentFacesAreCutNotRefused) {
  PolygonSoup soup = cube(0.04);
  soup.vertices[0] *= 1.3;
  const CleanedSurface cleaned = closed_surface(soup);
  expect_closed(cleaned.surface);
  // Corner 0 is (-0.026, -0.026, -0.026), so three diagonals pass each other at 0.0026 m.
  EXPECT_EQ(notes_of(cleaned),
            "6 faces of four or more corners cut into triangles\n"
            "face 0 (vertices 0 3 2 1) is bent by 0.0026 m; cut between vertices 3 and 1\n"
            "face 2 (vertices 0 1 5 4) is bent by 0.0026 m; cut between vertices 1 and 4\n"
            "face 5 (vertices 3 0 4 7) is bent by 0.0026 m; cut between vertices 3 and 4\n");
  EXPECT_EQ(cleaning_notes(soup), cleaned.notes);
}

TEST(ClosedSurfaceTest, NamesTheDiagonalOfBentFaces) {
  PolygonSoup soup = cube(0.04);
  for (Vec3& v : soup.vertices) v.z += v.x > 0 && v.y > 0 && v.z > 0 ? 0.001 : 0;
  const CleanedSurface cleaned = closed_surface(soup);
  // The top's corners are at 0.02, but one at 0.021: its diagonals meet at 0.02 and 0.0205.
  const std::string notes = notes_of(cleaned);
  const std::size_t at = notes.find("is bent by 0.0005 m; cut between vertices ");
  ASSERT_NE(at, std::string::npos) << notes;
  std::size_t from = 0, to = 0;
  ASSERT_EQ(std::sscanf(notes.c_str() + at, "is bent by 0.0005 m; cut between vertices %zu and %zu",
                        &from, &to),
            2)
      << notes;
  const auto has = [&](const std::array<Vec3, 3>& t, std::size_t corner) {
    return std::find(t.begin(), t.end(), soup.vertices.at(corner)) != t.end();
  };
  const TriangleSurface triangles = places_of(cleaned.surface);
  EXPECT_EQ(std::count_if(triangles.begin(), triangles.end(),
                          [&](const auto& t) { return has(t, from) && has(t, to); }),
            2);
}

TEST(ClosedSurfaceTest, NotesHowFarCornersMoved) {
  PolygonSoup soup = triangulated(cube(0.04));
  soup.coordinate_error = 1e-5;
  const std::vector<std::uint32_t> face = soup.faces[0];
  const auto near = static_cast<std::uint32_t>(soup.vertices.size());
  // Three errors from the first corner, on an edge.
  const Vec3 way = glm::normalize(soup.vertices[face[1]] - soup.vertices[face[0]]);
  soup.vertices.push_back(soup.vertices[face[0]] + 3e-5 * way);
  soup.faces[0] = {near, face[1], face[2]};
  soup.faces.push_back({face[0], near, face[2]});
  for (std::size_t f = 1; f + 1 < soup.faces.size(); ++f) {
    std::vector<std::uint32_t>& other = soup.faces[f];
    const auto at = std::find(other.begin(), other.end(), face[1]);
    if (at == other.end() || std::find(other.begin(), other.end(), face[0]) == other.end())
      continue;
    const auto third = std::find_if(other.begin(), other.end(),
                                    [&](std::uint32_t v) { return v != face[0] && v != face[1]; });
    const std::uint32_t apex = *third;
    other = {face[1], near, apex};
    soup.faces.push_back({near, face[0], apex});
    break;
  }
  const CleanedSurface cleaned = closed_surface(soup);
  EXPECT_NE(notes_of(cleaned).find("1 corner merged with another at most 3e-05 m from it"),
            std::string::npos)
      << notes_of(cleaned);
}

// A face with a bridge to its hole visits two corners twice.
TEST(ClosedSurfaceTest, AcceptsFacesWithABridgeToAHole) {
  PolygonSoup soup;
  for (const double z : {0.0, 0.01}) {
    for (const double r : {0.03, 0.01}) {
      for (const auto& [x, y] : {std::pair(-r, -r), {r, -r}, {r, r}, {-r, r}})
        soup.vertices.emplace_back(x, y, z);
    }
  }
  // Outer ring 0 to 3, inner 4 to 7; the same 8 higher.
  soup.faces = {{3, 2, 1, 0, 4, 5, 6, 7, 4, 0}, {8, 9, 10, 11, 8, 12, 15, 14, 13, 12}};
  for (std::uint32_t k = 0; k < 4; ++k) {
    const std::uint32_t n = (k + 1) % 4;
    soup.faces.push_back({k, n, n + 8, k + 8});
    soup.faces.push_back({n + 4, k + 4, k + 12, n + 12});
  }
  const CleanedSurface cleaned = closed_surface(soup);
  expect_closed(cleaned.surface);
  EXPECT_NEAR(volume_in(cleaned.surface), 0.01 * (0.06 * 0.06 - 0.02 * 0.02), 1e-15);
}

TEST(ClosedSurfaceTest, RemovesTrianglesWithoutAreaAndStaysClosed) {
  constexpr std::uint64_t kSeed = 9;
  Random random(kSeed);
  for (int i = 0; i < 100; ++i) {
    // A corner on the middle of an edge belongs to a triangle without area on one side of it.
    PolygonSoup soup = triangulated(cube(0.04));
    const double volume = 0.04 * 0.04 * 0.04;
    for (int n = 0; n < 20; ++n) {
      const std::size_t f = random.below(soup.faces.size());
      const std::vector<std::uint32_t> face = soup.faces[f];
      const auto middle = static_cast<std::uint32_t>(soup.vertices.size());
      // Sometimes close to an end.
      const double at = random.below(4) == 0 ? 1e-13 : 0.5;
      soup.vertices.push_back(soup.vertices[face[0]] * (1 - at) + soup.vertices[face[1]] * at);
      soup.faces[f] = {face[0], middle, face[2]};
      soup.faces.push_back({middle, face[1], face[2]});
      soup.faces.push_back({face[0], face[1], middle});
    }
    soup = placed(soup, uniform_rotation(random), 1, Vec3(0));
    const CleanedSurface cleaned = closed_surface(soup);
    expect_closed(cleaned.surface);
    EXPECT_NE(notes_of(cleaned).find("without area left out"), std::string::npos);
    EXPECT_NEAR(volume_in(cleaned.surface), volume, 1e-9 * volume);
    EXPECT_NEAR(bulk_of(places_of(cleaned.surface)).area, 6 * 0.04 * 0.04, 1e-8);
    for (const auto& t : places_of(cleaned.surface)) {
      const double longest = std::max(
          {glm::distance(t[0], t[1]), glm::distance(t[1], t[2]), glm::distance(t[2], t[0])});
      EXPECT_GT(glm::length(glm::cross(t[1] - t[0], t[2] - t[0])), 1e-12 * longest);
    }
  }
}

TEST(ClosedSurfaceTest, LeavesOutDoubledFacesAndUnusedCorners) {
  PolygonSoup soup = cube(0.04);
  soup.vertices.emplace_back(1, 1, 1);
  soup.faces.push_back({0, 1, 6});
  soup.faces.push_back({1, 0, 6});
  const CleanedSurface cleaned = closed_surface(soup);
  expect_closed(cleaned.surface);
  EXPECT_EQ(cleaned.surface.vertices.size(), 8U);
  EXPECT_EQ(notes_of(cleaned),
            "1 corner in no face left out\n6 faces of four or more corners cut into triangles\n"
            "1 pair of faces back to back left out\n");
}

TEST(ClosedSurfaceTest, CornersAreWeldedByPlaceNotByDistance) {
  PolygonSoup soup = triangulated(cube(0.04));
  PolygonSoup apart;
  for (const auto& face : soup.faces) {
    for (const std::uint32_t v : face) apart.vertices.push_back(soup.vertices[v]);
    const auto n = static_cast<std::uint32_t>(apart.vertices.size());
    apart.faces.push_back({n - 3, n - 2, n - 1});
  }
  EXPECT_EQ(closed_surface(apart).surface.vertices.size(), 8U);
  // A tetrahedron smaller than the digits' error is judged at its own size.
  const PolygonSoup tiny = placed(soup, Quat(1, 0, 0, 0), 1e-6, Vec3(0));
  EXPECT_EQ(closed_surface(tiny).surface.vertices.size(), 8U);
}

TEST(ClosedSurfaceTest, WeldsNearlyEqualCornersOnlyOnOpenEdges) {
  constexpr std::uint64_t kSeed = 11;
  Random random(kSeed);
  PolygonSoup apart;
  apart.coordinate_error = 0x1p-24 * 0.1;
  const PolygonSoup sphere = placed(icosphere(0.03, 2), uniform_rotation(random), 1, Vec3(0.05));
  for (const auto& face : sphere.faces) {
    for (const std::uint32_t v : face) {
      Vec3 at = sphere.vertices[v];
      for (int axis = 0; axis < 3; ++axis) {
        auto single = static_cast<float>(at[axis]);
        if (random.below(10) == 0) single = std::nextafter(single, 9.0F);
        at[axis] = single;
      }
      apart.vertices.push_back(at);
    }
    const auto n = static_cast<std::uint32_t>(apart.vertices.size());
    apart.faces.push_back({n - 3, n - 2, n - 1});
  }
  const CleanedSurface cleaned = closed_surface(apart);
  expect_closed(cleaned.surface);
  EXPECT_EQ(cleaned.surface.triangles.size(), sphere.faces.size());
  EXPECT_NE(notes_of(cleaned).find("on an open edge merged with another"), std::string::npos);
}

TEST(ClosedSurfaceTest, CutsEdgesAtNeighboursCornersOnThem) {
  constexpr std::uint64_t kSeed = 13;
  Random random(kSeed);
  for (int i = 0; i < 50; ++i) {
    // One face of a cube in two halves; its neighbours lack the corners between.
    PolygonSoup soup = cube(0.04);
    const std::vector<std::uint32_t> face = soup.faces[2];
    const auto n = static_cast<std::uint32_t>(soup.vertices.size());
    const double at = 0.1 + 0.8 * random.unit();
    const auto between = [&](std::uint32_t a, std::uint32_t b) {
      return soup.vertices[a] * (1 - at) + soup.vertices[b] * at;
    };
    const Vec3 one = between(face[0], face[1]), other = between(face[3], face[2]);
    soup.vertices.push_back(one);
    soup.vertices.push_back(other);
    soup.faces[2] = {face[0], n, n + 1, face[3]};
    soup.faces.push_back({n, face[1], face[2], n + 1});
    soup = placed(soup, uniform_rotation(random), 1, Vec3(0.01));
    const CleanedSurface cleaned = closed_surface(soup);
    expect_closed(cleaned.surface);
    EXPECT_NEAR(volume_in(cleaned.surface), 0.04 * 0.04 * 0.04, 1e-15);
    EXPECT_NE(notes_of(cleaned).find("2 edges cut at corners of other faces"), std::string::npos);
  }
}

TEST(ClosedSurfaceTest, ShellsMayOverlapAbutAndTouch) {
  for (const Vec3& by :
       {Vec3(0.01, 0.007, 0.003), Vec3(0.04, 0, 0), Vec3(0.04, 0.04, 0), Vec3(0.04, 0.04, 0.04),
        Vec3(0.02, 0, 0), Vec3(0, 0, 0), Vec3(0.1, 0, 0)}) {
    PolygonSoup soup = cube(0.04);
    add_shell(soup, shifted(cube(0.04), by));
    const CleanedSurface cleaned = closed_surface(soup);
    expect_closed(cleaned.surface);
    EXPECT_NEAR(volume_in(cleaned.surface), 2 * 0.04 * 0.04 * 0.04, 1e-15);
  }
}

// Solid must lie between neighbours; otherwise a segment could pass through an edge that two shells
// share.
TEST(ClosedSurfaceTest, EdgesOfTwoShellsPairNeighboursAcrossSolid) {
  PolygonSoup soup = cube(0.04);
  add_shell(soup, shifted(cube(0.04), Vec3(0.04, 0.04, 0)));
  const ClosedSurface surface = closed_surface(soup).surface;
  for (std::uint32_t t = 0; t < surface.triangles.size(); ++t) {
    const auto side_of = [&](std::uint32_t n) {
      double sum = 0;
      for (const std::uint32_t v : surface.triangles[n])
        sum += surface.vertices[v].x + surface.vertices[v].y;
      return sum > 0.12;
    };
    for (const std::uint32_t n : surface.across[t]) EXPECT_EQ(side_of(n), side_of(t));
  }
}

TEST(ClosedSurfaceTest, AcceptsCavitiesAndRefusesInvertedShells) {
  PolygonSoup cavity = cube(0.04);
  add_shell(cavity, turned_over(cube(0.02)));
  EXPECT_NEAR(volume_in(closed_surface(cavity).surface), 0.000064 - 0.000008, 1e-15);

  PolygonSoup beside = cube(0.04);
  add_shell(beside, shifted(turned_over(cube(0.02)), Vec3(0.05, 0, 0)));
  const std::string text = surface_refusal(beside);
  EXPECT_NE(text.find("negative: face "), std::string::npos) << text;
  EXPECT_NE(text.find("a shell there is turned inside out"), std::string::npos) << text;

  PolygonSoup partly = cube(0.04);
  add_shell(partly, shifted(turned_over(cube(0.02)), Vec3(0.0199, 0.001, 0.002)));
  EXPECT_NE(surface_refusal(partly).find("it passes through itself"), std::string::npos);

  EXPECT_NE(surface_refusal(turned_over(cube(0.04))).find("inside out: all faces are clockwise"),
            std::string::npos);
}

// A dent pushed out through the far side leaves a region of negative winding.
TEST(ClosedSurfaceTest, FindsSmallNegativeWindingInALargeMesh) {
  PolygonSoup sphere = icosphere(0.03, 4);
  EXPECT_EQ(surface_refusal(sphere), "");
  const Vec3 dent = sphere.vertices[0];
  for (Vec3& v : sphere.vertices) {
    if (v == dent) v = -1.05 * dent;
  }
  EXPECT_NE(surface_refusal(sphere).find("negative: face "), std::string::npos);
}

// A plate whose upper side is pushed through the lower one in one corner of its grid.
PolygonSoup pierced_plate(double depth) {
  constexpr double kEdge = 0.04, kThick = 1e-3;  // m
  PolygonSoup soup;
  soup.vertices = {{0, 0, 0}, {kEdge, 0, 0}, {kEdge, kEdge, 0}, {0, kEdge, 0}};
  for (int i = 0; i < 4; ++i) soup.vertices.push_back(soup.vertices[i] + Vec3(0, 0, kThick));
  soup.vertices.emplace_back(0.021, 0.018, -depth);
  soup.faces = {{3, 2, 1, 0}};
  for (std::uint32_t k = 0; k < 4; ++k) {
    const std::uint32_t next = (k + 1) % 4;
    soup.faces.push_back({k, next, next + 4, k + 4});
    soup.faces.push_back({k + 4, next + 4, 8});
  }
  return soup;
}

TEST(ClosedSurfaceTest, APocketThatNoHandFeelsIsNoted) {
  for (const double depth : {1e-7, 1e-6, 2e-5, 5e-5}) {
    const stimuli::CleanedSurface cleaned = closed_surface(pierced_plate(depth));
    ASSERT_EQ(cleaned.notes.size(), 2U);  // the other one: quadrangles are cut
    double x = 0, y = 0, z = 0, deep = 0;
    ASSERT_EQ(
        std::sscanf(cleaned.notes.back().c_str(),
                    "it passes through itself, at (%lf, %lf, %lf) m by %lf m", &x, &y, &z, &deep),
        4)
        << cleaned.notes.back();
    EXPECT_NEAR(deep, depth, 0.1 * depth);
    EXPECT_NEAR(x, 0.021, 0.002);
    EXPECT_NEAR(y, 0.018, 0.002);
    EXPECT_GT(cleaned.surface.at_pockets.size(), 4U);
  }
  EXPECT_TRUE(closed_surface(pierced_plate(-1e-6)).surface.at_pockets.empty());
}

TEST(ClosedSurfaceTest, APocketThatAHandFeelsIsRefused) {
  for (const double depth : {1.2e-4, 5e-4, 1e-3})
    EXPECT_NE(surface_refusal(pierced_plate(depth)).find("negative: "), std::string::npos) << depth;
}

// A plate with a square pocket from above whose floor is `depth` below the lower side.
PolygonSoup deep_pocket(double depth, double width, double taper) {
  PolygonSoup soup;
  const auto add_square = [&](double z, double half) {
    for (const auto& [x, y] : {std::pair(-half, -half), {half, -half}, {half, half}, {-half, half}})
      soup.vertices.emplace_back(x, y, z);
  };
  add_square(0, 0.02);
  add_square(1e-3, 0.02);
  add_square(1e-3, width / 2);
  add_square(-depth, width / 2 - taper);
  soup.faces = {{3, 2, 1, 0}, {12, 13, 14, 15}};
  for (std::uint32_t k = 0; k < 4; ++k) {
    const std::uint32_t next = (k + 1) % 4;
    for (std::uint32_t ring = 0; ring < 12; ring += 4)
      soup.faces.push_back({ring + k, ring + next, ring + next + 4, ring + k + 4});
  }
  return soup;
}

TEST(ClosedSurfaceTest, PocketDepthIsBeyondOtherSide) {
  for (const double taper : {0.0, 1e-3, 4e-3}) {
    for (const double depth : {1e-6, 1e-5, 3.5e-5}) {
      const stimuli::CleanedSurface cleaned = closed_surface(deep_pocket(depth, 0.01, taper));
      double deep = 0;
      ASSERT_EQ(std::sscanf(cleaned.notes.back().c_str(),
                            "it passes through itself, at (%*f, %*f, %*f) m by %lf m", &deep),
                1)
          << cleaned.notes.back();
      // Along the normal of a wall at 45 degrees it is deeper.
      EXPECT_GE(deep, 0.99 * depth) << taper;
      EXPECT_LE(deep, 1.5 * depth) << taper;
    }
    EXPECT_NE(surface_refusal(deep_pocket(1.2e-4, 0.01, taper)).find("negative: "),
              std::string::npos)
        << taper;
  }
  // A fin, thinner than what is felt, but high.
  EXPECT_NE(surface_refusal(deep_pocket(3e-4, 4e-5, 0)).find("negative: "), std::string::npos);
}

// The triangles of such faces are long, so that all their boxes meet.
TEST(ClosedSurfaceTest, FacesOfManyTrianglesAreTaken) {
  // A toothed wheel whose ends are fans, and a ring.
  constexpr std::uint32_t kSides = 60000;
  for (const bool is_ring : {false, true}) {
    PolygonSoup soup;
    const auto add_circle = [&](double z, double radius, double tooth) {
      for (std::uint32_t i = 0; i < kSides; ++i) {
        const double a = 2 * std::numbers::pi * i / kSides, r = radius + tooth * std::sin(40 * a);
        soup.vertices.emplace_back(r * std::cos(a), r * std::sin(a), z);
      }
    };
    for (const double z : {0.0, 0.01}) add_circle(z, 0.02, is_ring ? 0 : 0.002);
    if (is_ring) {
      for (const double z : {0.0, 0.01}) add_circle(z, 0.01, 0);
    } else {
      soup.vertices.insert(soup.vertices.end(), {Vec3(0), Vec3(0, 0, 0.01)});
    }
    for (std::uint32_t i = 0; i < kSides; ++i) {
      const std::uint32_t k = (i + 1) % kSides, up = kSides, in = 2 * kSides;
      const auto add_quad = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c,
                                std::uint32_t d) {
        soup.faces.push_back({a, b, c});
        soup.faces.push_back({a, c, d});
      };
      add_quad(i, k, up + k, up + i);
      if (is_ring) {
        add_quad(in + k, in + i, in + up + i, in + up + k);
        add_quad(k, i, in + i, in + k);
        add_quad(up + i, up + k, in + up + k, in + up + i);
      } else {
        soup.faces.push_back({k, i, in});
        soup.faces.push_back({up + i, up + k, in + 1});
      }
    }
    EXPECT_EQ(surface_refusal(soup), "");
  }
}

// In any place, boxes around long bars meet everywhere.
TEST(ClosedSurfaceTest, TakesManyBarsThatPassThroughEachOther) {
  constexpr std::uint64_t kSeed = 8;
  Random random(kSeed);
  const Quat turn = uniform_rotation(random);
  constexpr int kBars = 40;  // in each direction and row
  PolygonSoup soup;
  for (int axis = 0; axis < 3; ++axis) {
    for (int i = 0; i < kBars * kBars; ++i) {
      const int row = i / kBars;
      Vec3 at(0), size(0.0005);
      at[(axis + 1) % 3] = 0.001 * row;
      at[(axis + 2) % 3] = 0.001 * (i % kBars);
      at[axis] = 0.0195;
      size[axis] = 0.041;
      PolygonSoup bar = box(size);
      for (Vec3& v : bar.vertices) v = turn * (v + at);
      add_shell(soup, bar);
    }
  }
  EXPECT_EQ(surface_refusal(soup), "");
}

TEST(ClosedSurfaceTest, RefusesOpenSurfacesWithPlaceAndAdvice) {
  PolygonSoup soup = cube(0.04);
  soup.faces.pop_back();
  const std::string open = surface_refusal(soup);
  EXPECT_NE(open.find("open: edge "), std::string::npos) << open;
  EXPECT_NE(open.find("fill holes and orient faces in a modelling program"), std::string::npos);

  soup = cube(0.04);
  std::reverse(soup.faces[0].begin(), soup.faces[0].end());
  EXPECT_NE(surface_refusal(soup).find("turned face: edge "), std::string::npos);

  soup = cube(0.04);
  soup.vertices.emplace_back(1, 1, 1);
  soup.faces.push_back({soup.faces[0][0], soup.faces[0][1], 8});
  EXPECT_NE(surface_refusal(soup).find(" belongs to 3 faces, and "), std::string::npos)
      << surface_refusal(soup);

  soup = cube(0.04);
  soup.vertices[3].y = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(surface_refusal(soup).find("not finite: vertex 3"), std::string::npos);
  soup.vertices[3].y = 1e31;
  EXPECT_NE(surface_refusal(soup).find("not finite: vertex 3"), std::string::npos);
  EXPECT_NE(surface_refusal({}).find("empty"), std::string::npos);

  soup = cube(0.04);
  for (Vec3& v : soup.vertices) v.z = 0;
  EXPECT_NE(surface_refusal(soup).find("flat: expected a solid"), std::string::npos)
      << surface_refusal(soup);
}

TEST(ClosedSurfaceTest, AGapIsDistinguishedFromAHole) {
  PolygonSoup soup = cube(0.04);
  soup.vertices.push_back(soup.vertices[soup.faces[0][0]] + Vec3(1e-7, 0, 0));
  soup.faces[0][0] = 8;
  const std::string text = surface_refusal(soup);
  EXPECT_NE(text.find("crowded: 1 corners on open edges are nearer than "), std::string::npos)
      << text;
}

// The winding number of the surface, seen from random places, is that of the polygons.
TEST(ClosedSurfaceTest, RandomShellsGiveTheirUnion) {
  constexpr std::uint64_t kSeed = 17;
  Random random(kSeed);
  for (int i = 0; i < 60; ++i) {
    PolygonSoup soup;
    std::vector<TriangleSurface> shells;
    for (std::uint64_t n = 1 + random.below(4); n > 0; --n) {
      const PolygonSoup shell =
          placed(testing::random_polyhedron(random, 12, Vec3(0.5)), uniform_rotation(random), 0.04,
                 0.03 * Vec3(random.unit(), random.unit(), random.unit()));
      shells.push_back(places_of(closed_surface(shell).surface));
      add_shell(soup, shell);
    }
    const CleanedSurface cleaned = closed_surface(soup);
    expect_closed(cleaned.surface);
    const TriangleSurface whole = places_of(cleaned.surface);
    for (int k = 0; k < 50; ++k) {
      const Vec3 at = 0.05 * Vec3(random.unit(), random.unit(), random.unit()) - Vec3(0.01);
      double sum = 0;
      for (const TriangleSurface& shell : shells) sum += winding_number(shell, at);
      EXPECT_NEAR(winding_number(whole, at), sum, 1e-9);
    }
  }
}

}  // namespace
}  // namespace palpate::stimuli
