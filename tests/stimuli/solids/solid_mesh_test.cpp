// Solids cut into finite elements: they fill their shape, without gaps, and their surface is
// closed.

#include "stimuli/solids/solid_mesh.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <numbers>
#include <set>
#include <stdexcept>
#include <utility>

namespace palpate::stimuli {
namespace {

/// Volume by the divergence theorem over the surface's triangles.
double volume_inside(const SolidMesh& mesh, const std::vector<SolidFace>& surface) {
  double volume = 0;
  for (const SolidFace& t : surface) {
    volume += glm::dot(mesh.nodes[t[0]], glm::cross(mesh.nodes[t[1]], mesh.nodes[t[2]])) / 6;
  }
  return volume;
}

/// Every side occurs once in each direction, so there is no hole and no reversed face.
void expect_closed(const std::vector<SolidFace>& surface) {
  std::set<std::pair<std::uint32_t, std::uint32_t>> sides;
  for (const SolidFace& t : surface) {
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_TRUE(sides.emplace(t[k], t[(k + 1) % 3]).second) << "twice: " << t[k];
  }
  for (const auto& [from, to] : sides) EXPECT_TRUE(sides.contains({to, from})) << from << " " << to;
}

/// Every corner's three edges are right-handed: no element is inside out or folded.
void expect_upright(const SolidMesh& mesh) {
  constexpr int kNeighbours[8][3] = {{1, 3, 4}, {2, 0, 5}, {3, 1, 6}, {0, 2, 7},
                                     {7, 5, 0}, {4, 6, 1}, {5, 7, 2}, {6, 4, 3}};
  for (const Hexahedron& h : mesh.hexahedra) {
    for (std::size_t c = 0; c < 8; ++c) {
      const auto edge = [&](int k) {
        return mesh.nodes[h[static_cast<std::size_t>(kNeighbours[c][k])]] - mesh.nodes[h[c]];
      };
      EXPECT_GT(glm::dot(edge(0), glm::cross(edge(1), edge(2))), 0);
    }
  }
}

ObjectSpec solid_spec(ShapeKind shape) {
  ObjectSpec spec;
  spec.shape = shape;
  spec.radius = 0.02;
  spec.height = 0.05;
  spec.edge = 0.03;
  spec.size = Vec3(0.04, 0.02, 0.01);
  return spec;
}

/// Half the extent of the nodes along each axis.
Vec3 half_extent(const SolidMesh& mesh) {
  Vec3 far;
  for (const Vec3& p : mesh.nodes) far = glm::max(far, glm::abs(p));
  return far;
}

TEST(SolidMesh, FillsItsShapeClosedAtEveryResolution) {
  const double pi = std::numbers::pi;
  struct Case {
    ShapeKind shape;
    Vec3 half;
    double volume;
    bool flat;  ///< the elements represent the shape exactly
  };
  const Case cases[] = {
      {ShapeKind::cube, Vec3(0.015), 0.03 * 0.03 * 0.03, true},
      {ShapeKind::box, {0.02, 0.01, 0.005}, 0.04 * 0.02 * 0.01, true},
      {ShapeKind::sphere, Vec3(0.02), 4 * pi / 3 * 0.02 * 0.02 * 0.02, false},
      {ShapeKind::cylinder, {0.02, 0.02, 0.025}, pi * 0.02 * 0.02 * 0.05, false},
  };
  for (const Case& c : cases) {
    double missing = 1;
    for (const int resolution : {kLeastResolution, 5, 10, kMostResolution}) {
      SCOPED_TRACE(static_cast<int>(c.shape) * 100 + resolution);
      const SolidMesh mesh = mesh_of_primitive(solid_spec(c.shape), resolution);
      const std::vector<SolidFace> surface = surface_of(mesh);
      expect_closed(surface);
      expect_upright(mesh);
      const double share = volume_inside(mesh, surface) / c.volume;
      if (c.flat) {
        EXPECT_NEAR(share, 1, 1e-12);
        EXPECT_LT(glm::distance(half_extent(mesh), c.half), 1e-15);
      } else {
        EXPECT_LT(share, 1) << "inscribed";
        EXPECT_LT(1 - share, missing) << "nearer at each resolution";
        missing = 1 - share;
        EXPECT_LE(half_extent(mesh).x, c.half.x * (1 + 1e-12));
        EXPECT_NEAR(half_extent(mesh).z, c.half.z, 0.1 * c.half.z);
      }
    }
    if (!c.flat) {
      EXPECT_LT(missing, 0.01);
    }
  }
}

TEST(SolidMesh, ElementsFollowSideLengthsWithAtLeastTwo) {
  EXPECT_EQ(mesh_of_primitive(solid_spec(ShapeKind::box), 8).hexahedra.size(), 8U * 4U * 2U);
  EXPECT_EQ(mesh_of_primitive(solid_spec(ShapeKind::box), 4).hexahedra.size(), 4U * 2U * 2U);
  EXPECT_EQ(mesh_of_primitive(solid_spec(ShapeKind::cube), 3).hexahedra.size(), 27U);
  EXPECT_EQ(mesh_of_primitive(solid_spec(ShapeKind::cube), 3).nodes.size(), 64U) << "shared";
  EXPECT_EQ(surface_of(mesh_of_primitive(solid_spec(ShapeKind::cube), 3)).size(), 6U * 9U * 2U);
}

TEST(SolidMesh, NeighboursShareNodesAndEveryInnerFace) {
  const SolidMesh mesh = mesh_of_primitive(solid_spec(ShapeKind::sphere), 6);
  std::set<std::array<double, 3>> places;
  for (const Vec3& p : mesh.nodes) {
    const auto rounded = [](double x) { return std::round(x * 1e8) / 1e8 + 0.0; };
    EXPECT_TRUE(places.insert({rounded(p.x), rounded(p.y), rounded(p.z)}).second);
  }
}

TEST(SolidMesh, TetrahedronIsClosedWithFourTrianglesAFace) {
  SolidMesh mesh;
  mesh.nodes = {{0, 0, 0}, {2, 0, 0}, {0, 2, 0}, {0, 0, 2}, {1, 0, 0},
                {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}};
  mesh.tetrahedra = {{0, 1, 2, 3, 4, 5, 6, 7, 8, 9}};
  const std::vector<SolidFace> surface = surface_of(mesh);
  ASSERT_EQ(surface.size(), 16U);
  expect_closed(surface);
  EXPECT_NEAR(volume_inside(mesh, surface), 8.0 / 6, 1e-15);
  for (const SolidFace& t : surface) {
    const Vec3 area =
        glm::cross(mesh.nodes[t[1]] - mesh.nodes[t[0]], mesh.nodes[t[2]] - mesh.nodes[t[0]]);
    EXPECT_GT(glm::length(area), 0.9) << "no triangle on two nodes";
  }
}

TEST(SolidMesh, OtherShapesHaveNoElements) {
  EXPECT_THROW(mesh_of_primitive(solid_spec(ShapeKind::cone), 6), std::invalid_argument);
}

}  // namespace
}  // namespace palpate::stimuli
