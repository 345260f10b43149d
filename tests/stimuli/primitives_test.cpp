#include "stimuli/primitives.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "stimuli/convex_mesh.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/signed_distance.h"

namespace palpate::stimuli {
namespace {

ObjectSpec spec_of(ShapeKind shape) {
  ObjectSpec spec;
  spec.shape = shape;
  return spec;
}

TEST(Primitives, VerticesLieOnTheAnalyticSurface) {
  for (const ShapeKind shape :
       {ShapeKind::sphere, ShapeKind::cone, ShapeKind::cylinder, ShapeKind::cube}) {
    const ObjectSpec spec = spec_of(shape);
    for (const Vec3& vertex : polygons_of(spec).vertices) {
      EXPECT_NEAR(signed_distance(spec, vertex).distance, 0, 1e-17);
    }
  }
}

TEST(Primitives, IcosphereTrianglesAreTwentyTimesFourToN) {
  std::size_t triangles = 20;
  for (int n = 0; n <= 5; ++n, triangles *= 4) {
    const PolygonSoup sphere = icosphere(2, n);
    EXPECT_EQ(sphere.faces.size(), triangles);
    EXPECT_EQ(sphere.vertices.size(), triangles / 2 + 2);
    for (const Vec3& vertex : sphere.vertices) EXPECT_NEAR(glm::length(vertex), 2, 1e-15);
  }
}

TEST(Primitives, RimCornersStandAtEqualAnglesFromX) {
  for (const int segments : {3, 4, 7, 64, 1000}) {
    const PolygonSoup soup = cone(0.03, 0.06, segments);
    for (int k = 0; k < segments; ++k) {
      const Vec3& corner = soup.vertices[static_cast<std::size_t>(k)];
      const double angle = 2 * std::numbers::pi * k / segments;
      EXPECT_NEAR(corner.x, 0.03 * std::cos(angle), 1e-16);
      EXPECT_NEAR(corner.y, 0.03 * std::sin(angle), 1e-16);
      EXPECT_EQ(corner.z, -0.03);
    }
    EXPECT_EQ(soup.vertices.back(), Vec3(0, 0, 0.03));
  }
}

TEST(Primitives, RimCornersOnTheAxesAreExact) {
  const PolygonSoup soup = cylinder(0.03, 0.06, 64);
  ASSERT_EQ(soup.vertices.size(), 128U);
  EXPECT_EQ(soup.vertices[0], Vec3(0.03, 0, -0.03));
  EXPECT_EQ(soup.vertices[16], Vec3(0, 0.03, -0.03));
  EXPECT_EQ(soup.vertices[32], Vec3(-0.03, 0, -0.03));
  EXPECT_EQ(soup.vertices[48], Vec3(0, -0.03, -0.03));
  for (std::size_t k = 0; k < 64; ++k) {
    const Vec3 below = soup.vertices[k], above = soup.vertices[64 + k];
    EXPECT_EQ(above, Vec3(below.x, below.y, 0.03));
    EXPECT_EQ(soup.vertices[(64 - k) % 64], Vec3(below.x, -below.y, -0.03));
    EXPECT_EQ(soup.vertices[(32 + k) % 64], Vec3(-below.x, -below.y, -0.03));
  }
}

TEST(Primitives, CubeHasSixSquares) {
  const PolygonSoup soup = cube(0.06);
  EXPECT_EQ(soup.vertices.size(), 8U);
  ASSERT_EQ(soup.faces.size(), 6U);
  for (const auto& face : soup.faces) EXPECT_EQ(face.size(), 4U);
  for (const Vec3& vertex : soup.vertices) EXPECT_EQ(glm::abs(vertex), Vec3(0.03));
}

TEST(Primitives, PolygonsOfUsesTheSizes) {
  ObjectSpec spec = spec_of(ShapeKind::sphere);
  spec.radius = 0.5;
  spec.subdivisions = 2;
  EXPECT_EQ(polygons_of(spec).vertices, icosphere(0.5, 2).vertices);
  spec = spec_of(ShapeKind::cone);
  spec.radius = 0.02;
  spec.height = 0.05;
  spec.segments = 12;
  EXPECT_EQ(polygons_of(spec).vertices, cone(0.02, 0.05, 12).vertices);
  spec.shape = ShapeKind::cylinder;
  EXPECT_EQ(polygons_of(spec).vertices, cylinder(0.02, 0.05, 12).vertices);
  spec.shape = ShapeKind::cube;
  spec.edge = 0.01;
  EXPECT_EQ(polygons_of(spec).vertices, cube(0.01).vertices);
  spec.shape = ShapeKind::box;
  spec.size = Vec3(0.01);
  EXPECT_EQ(polygons_of(spec).vertices, cube(0.01).vertices);
  EXPECT_EQ(polygons_of(spec).faces, cube(0.01).faces);
  EXPECT_THROW(polygons_of(spec_of(ShapeKind::compound)), std::invalid_argument);
}

TEST(Primitives, ABoxHasItsEdgesAlongTheAxes) {
  const ConvexMesh mesh(box(Vec3(0.02, 0.04, 0.07)));
  ASSERT_EQ(mesh.facets().size(), 6U);
  for (const Facet& facet : mesh.facets()) {
    const Vec3 size = 2 * facet.offset * glm::abs(facet.normal);
    const bool one =
        size == Vec3(0.02, 0, 0) || size == Vec3(0, 0.04, 0) || size == Vec3(0, 0, 0.07);
    EXPECT_TRUE(one) << size.x << ' ' << size.y << ' ' << size.z;
  }
}

TEST(Primitives, ImpossibleSizesAreRefused) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double bad : {0.0, -0.03, nan, infinity}) {
    EXPECT_THROW(icosphere(bad, 2), std::invalid_argument);
    EXPECT_THROW(cone(bad, 1, 8), std::invalid_argument);
    EXPECT_THROW(cone(1, bad, 8), std::invalid_argument);
    EXPECT_THROW(cylinder(bad, 1, 8), std::invalid_argument);
    EXPECT_THROW(cylinder(1, bad, 8), std::invalid_argument);
    EXPECT_THROW(cube(bad), std::invalid_argument);
    EXPECT_THROW(box(Vec3(1, 1, bad)), std::invalid_argument);
    EXPECT_THROW(box(Vec3(bad, 1, 1)), std::invalid_argument);
  }
}

template <class Make>
std::string argument_refusal(Make&& make) {
  try {
    make();
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "taken";
}

TEST(Primitives, RefusalsNameShapeNumberAndAllowedValues) {
  EXPECT_EQ(argument_refusal([] { cone(-0.5, 1, 8); }),
            "cone: the radius must be a length above 0 m, not -0.500000");
  EXPECT_EQ(argument_refusal([] { cylinder(1, 0, 8); }),
            "cylinder: the height must be a length above 0 m, not 0.000000");
  for (const int bad : {-1, 9})
    EXPECT_EQ(argument_refusal([&] { icosphere(1, bad); }),
              "sphere: the number of subdivisions must be from 0 to 8, not " + std::to_string(bad));
  EXPECT_EQ(argument_refusal([] { cone(1, 1, 2); }),
            "cone: the number of segments must be from 3 to 65536, not 2");
  for (const int bad : {-64, 65537, std::numeric_limits<int>::max()})
    EXPECT_EQ(
        argument_refusal([&] { cylinder(1, 1, bad); }),
        "cylinder: the number of segments must be from 3 to 65536, not " + std::to_string(bad));
}

}  // namespace
}  // namespace palpate::stimuli
