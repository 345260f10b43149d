
#include "stimuli/signed_distance.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <limits>
#include <numbers>

#include "stimuli/convex_mesh.h"
#include "stimuli/primitives.h"
#include "tests/shared/random_polyhedron.h"

namespace palpate::stimuli {
namespace {

using testing::placed;

constexpr ShapeKind kShapes[] = {ShapeKind::sphere, ShapeKind::cone, ShapeKind::cylinder,
                                 ShapeKind::cube, ShapeKind::box};

ObjectSpec solid_of(ShapeKind shape, double radius = 0.03, double height = 0.06) {
  ObjectSpec spec;
  spec.shape = shape;
  spec.radius = radius;
  spec.height = height;
  spec.edge = height;
  spec.size = {height, 0.05, 2 * radius};
  return spec;
}

Vec3 random_direction(Random& random) { return uniform_rotation(random) * Vec3(0, 0, 1); }

Vec3 random_point(Random& random, double reach) {
  return reach * (2.0 * Vec3(random.unit(), random.unit(), random.unit()) - 1.0);
}

// Distance along a ray from the middle of the solid to its surface, by bisection.
template <class Shape>
Vec3 surface_point(const Shape& shape, const Vec3& middle, const Vec3& direction, double reach) {
  double inside = 0, outside = reach;
  for (int i = 0; i < 60; ++i) {
    const double half = (inside + outside) / 2;
    (signed_distance(shape, middle + half * direction).distance < 0 ? inside : outside) = half;
  }
  return middle + inside * direction;
}

// The definition: no point of the surface is nearer than the distance, and distance and normal lead
// to a point on the surface. Both outside and inside.
template <class Shape>
void expect_nearest(const Shape& shape, double reach, Random& random) {
  std::vector<Vec3> surface;
  for (int i = 0; i < 3000; ++i) {
    surface.push_back(surface_point(shape, Vec3(0), random_direction(random), reach));
  }
  for (int i = 0; i < 200; ++i) {
    const Vec3 point = random_point(random, reach);
    const SurfaceDistance found = signed_distance(shape, point);
    EXPECT_NEAR(glm::length(found.normal), 1, 1e-12);
    const Vec3 foot = point - found.distance * found.normal;
    EXPECT_NEAR(signed_distance(shape, foot).distance, 0, 1e-14 * reach);
    double nearest = std::numeric_limits<double>::max();
    for (const Vec3& other : surface) nearest = std::min(nearest, glm::distance(point, other));
    EXPECT_GE(nearest, std::abs(found.distance) - 1e-12 * reach);
    EXPECT_LE(nearest, std::abs(found.distance) + 0.15 * reach);  // density of the samples
  }
}

// The gradient, by central differences, where the distance is smooth.
template <class Shape>
void expect_gradient(const Shape& shape, double reach, Random& random) {
  const double step = 1e-6 * reach;
  int smooth = 0;
  for (int i = 0; i < 500; ++i) {
    const Vec3 point = random_point(random, reach);
    Vec3 gradient;
    for (int axis = 0; axis < 3; ++axis) {
      Vec3 by;
      by[axis] = step;
      gradient[axis] = (signed_distance(shape, point + by).distance -
                        signed_distance(shape, point - by).distance) /
                       (2 * step);
    }
    if (std::abs(glm::length(gradient) - 1) > 1e-4) continue;  // an inner ridge lies between
    ++smooth;
    EXPECT_NEAR(glm::distance(gradient, signed_distance(shape, point).normal), 0, 2e-4);
  }
  EXPECT_GT(smooth, 480);
}

template <class Shape>
void expect_lipschitz(const Shape& shape, double reach, Random& random) {
  for (int i = 0; i < 1000; ++i) {
    const Vec3 a = random_point(random, reach);
    const Vec3 b = a + reach * std::pow(10, -6 * random.unit()) * random_direction(random);
    EXPECT_LE(std::abs(signed_distance(shape, a).distance - signed_distance(shape, b).distance),
              glm::distance(a, b) + 1e-14 * reach);
  }
}

TEST(SignedDistance, PrimitivesGiveTheNearestPoint) {
  constexpr std::uint64_t kSeed = 1;
  Random random(kSeed);
  for (const ShapeKind shape : kShapes) {
    expect_nearest(solid_of(shape), 0.1, random);
    expect_nearest(solid_of(shape, 0.05, 0.02), 0.1, random);
  }
}

TEST(SignedDistance, PrimitivesHaveTheNormalAsGradient) {
  constexpr std::uint64_t kSeed = 2;
  Random random(kSeed);
  for (const ShapeKind shape : kShapes) {
    expect_gradient(solid_of(shape), 0.08, random);
    expect_gradient(solid_of(shape, 0.02, 0.1), 0.08, random);
    expect_lipschitz(solid_of(shape), 0.08, random);
  }
}

void expect_distance(const ObjectSpec& spec, const Vec3& point, double distance,
                     const Vec3& normal) {
  const SurfaceDistance found = signed_distance(spec, point);
  EXPECT_NEAR(found.distance, distance, 1e-15);
  EXPECT_NEAR(glm::distance(found.normal, normal), 0, 1e-12);
}

TEST(SignedDistance, AtPlacesThatAreKnown) {
  expect_distance(solid_of(ShapeKind::sphere), {0, 0, 0.05}, 0.02, {0, 0, 1});
  expect_distance(solid_of(ShapeKind::sphere), {0, 0, 0}, -0.03, {0, 0, 1});

  expect_distance(solid_of(ShapeKind::cube), {0.04, 0, 0}, 0.01, {1, 0, 0});
  expect_distance(solid_of(ShapeKind::cube), {0, -0.02, 0}, -0.01, {0, -1, 0});
  expect_distance(solid_of(ShapeKind::cube), {-0.06, 0.07, 0}, 0.05, {-0.6, 0.8, 0});
  expect_distance(solid_of(ShapeKind::cube), {0, 0, 0}, -0.03, {1, 0, 0});
  expect_distance(solid_of(ShapeKind::box), {-0.06, 0.065, 0.01}, 0.05, {-0.6, 0.8, 0});
  expect_distance(solid_of(ShapeKind::box), {0, 0, 0}, -0.025, {0, 1, 0});

  const ObjectSpec rod = solid_of(ShapeKind::cylinder);
  expect_distance(rod, {0, 0.05, 0.01}, 0.02, {0, 1, 0});
  expect_distance(rod, {0, 0, -0.05}, 0.02, {0, 0, -1});
  expect_distance(rod, {0, 0.06, 0.07}, 0.05, {0, 0.6, 0.8});
  expect_distance(rod, {0, 0, 0}, -0.03, {1, 0, 0});

  const ObjectSpec hat = solid_of(ShapeKind::cone, 0.03, 0.04);  // slant 0.05
  expect_distance(hat, {0, 0, 0.03}, 0.01, {0, 0, 1});           // over the apex
  expect_distance(hat, {0, 0, 0.02}, 0, {0.8, 0, 0.6});          // the apex: a side's normal
  expect_distance(hat, {0.01, 0, -0.03}, 0.01, {0, 0, -1});
  expect_distance(hat, {-0.06, 0, -0.06}, 0.05, {-0.6, 0, -0.8});  // off the rim
  expect_distance(hat, {0.015 + 0.008, 0, 0.006}, 0.01, {0.8, 0, 0.6});
  expect_distance(hat, {0, 0, 0}, -0.012, {0.8, 0, 0.6});
}

TEST(SignedDistance, RefusesMeshAndCompoundSpecs) {
  EXPECT_THROW(signed_distance(solid_of(ShapeKind::mesh), Vec3(0)), std::invalid_argument);
  EXPECT_THROW(signed_distance(solid_of(ShapeKind::compound), Vec3(0)), std::invalid_argument);
}

TEST(SignedDistance, PolyhedraGiveTheNearestPoint) {
  constexpr std::uint64_t kSeed = 3;
  Random random(kSeed);
  for (int i = 0; i < 6; ++i) {
    const ConvexMesh mesh(testing::random_polyhedron(random, 16 + 4 * i, Vec3(0.5, 0.4, 0.3)));
    if (signed_distance(mesh, Vec3(0)).distance > -0.02) continue;
    expect_nearest(mesh, 1, random);
    expect_gradient(mesh, 1, random);
    expect_lipschitz(mesh, 1, random);
  }
  expect_nearest(ConvexMesh(cone(0.4, 0.8, 7)), 1, random);
}

TEST(SignedDistance, CubeMeshEqualsTheCube) {
  constexpr std::uint64_t kSeed = 4;
  Random random(kSeed);
  const ConvexMesh mesh(cube(0.06));
  for (int i = 0; i < 2000; ++i) {
    const Vec3 point = random_point(random, 0.08);
    const SurfaceDistance of_mesh = signed_distance(mesh, point);
    const SurfaceDistance exact = signed_distance(solid_of(ShapeKind::cube), point);
    EXPECT_NEAR(of_mesh.distance, exact.distance, 1e-16);
    EXPECT_NEAR(glm::distance(of_mesh.normal, exact.normal), 0, 1e-10);
  }
}

// From outside along a corner's axis, the nearest place is the corner itself.
TEST(SignedDistance, OverACornerIsTheCornersDistance) {
  const ConvexMesh mesh(cube(2));
  for (const Vec3& corner : mesh.vertices()) {
    const SurfaceDistance found = signed_distance(mesh, 3.0 * corner);
    EXPECT_NEAR(found.distance, 2 * std::sqrt(3), 1e-15);
    EXPECT_NEAR(glm::distance(found.normal, glm::normalize(corner)), 0, 1e-15);
  }
}

TEST(SignedDistance, OnTheSurfaceTheNormalIsAFacets) {
  constexpr std::uint64_t kSeed = 5;
  Random random(kSeed);
  for (int i = 0; i < 50; ++i) {
    const ConvexMesh mesh(placed(cube(0.06), uniform_rotation(random), 1, Vec3(0.1)));
    for (const Vec3& corner : mesh.vertices()) {
      const SurfaceDistance found = signed_distance(mesh, corner);
      EXPECT_NEAR(found.distance, 0, 1e-16);
      const auto& facets = mesh.facets();
      EXPECT_TRUE(std::any_of(facets.begin(), facets.end(),
                              [&](const Facet& facet) { return facet.normal == found.normal; }));
    }
  }
}

// An inscribed mesh lies within the analytic shape, and the gap falls with the square of the step.
TEST(SignedDistance, FinerMeshesTendToTheShapes) {
  constexpr std::uint64_t kSeed = 6;
  Random random(kSeed);
  const auto worst = [&](const ObjectSpec& spec) {
    const ConvexMesh mesh(polygons_of(spec));
    double gap = 0;
    for (int i = 0; i < 200; ++i) {
      const Vec3 point = random_point(random, 0.06);
      const double above =
          signed_distance(mesh, point).distance - signed_distance(spec, point).distance;
      EXPECT_GE(above, -1e-15);
      gap = std::max(gap, above);
    }
    return gap;
  };
  for (const ShapeKind shape : {ShapeKind::sphere, ShapeKind::cone, ShapeKind::cylinder}) {
    ObjectSpec coarse = solid_of(shape), fine = solid_of(shape);
    coarse.subdivisions = 1;
    fine.subdivisions = 3;
    coarse.segments = 16;
    fine.segments = 64;
    const double before = worst(coarse), after = worst(fine);
    EXPECT_LT(after, before / 10);
    EXPECT_GT(after, before / 25);
    const double sagitta = 0.03 * (1 - std::cos(std::numbers::pi / 64));
    if (shape != ShapeKind::sphere) {
      EXPECT_LE(after, sagitta * (1 + 1e-9));
    }
  }
}

}  // namespace
}  // namespace palpate::stimuli
