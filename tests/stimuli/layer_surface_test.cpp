// Layers of solids that are not convex, against distances by brute force.

#include "stimuli/layers/layer_surface.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <vector>

#include "data/base/random.h"
#include "stimuli/closed_surface.h"
#include "stimuli/polygon_soup.h"

namespace palpate::stimuli {
namespace {

/// An L of 60 x 60 x 30 mm whose arms are 20 mm thick, without its faces on other parts.
ClosedSurface closed_bracket() {
  PolygonSoup soup;
  for (const double z : {0.0, 0.03}) {
    for (const auto& [x, y] : std::vector<std::pair<double, double>>{
             {0, 0}, {0.06, 0}, {0.06, 0.02}, {0.02, 0.02}, {0.02, 0.06}, {0, 0.06}})
      soup.vertices.emplace_back(x, y, z);
  }
  soup.faces = {{5, 4, 3, 2, 1, 0}, {6, 7, 8, 9, 10, 11}};
  for (std::uint32_t k = 0; k < 6; ++k)
    soup.faces.push_back({k, (k + 1) % 6, (k + 1) % 6 + 6, k + 6});
  return closed_surface(soup).surface;
}

ClosedSurface closed_box(const Vec3& low, const Vec3& high) {
  PolygonSoup soup;
  for (int k = 0; k < 8; ++k)
    soup.vertices.emplace_back((k & 1) != 0 ? high.x : low.x, (k & 2) != 0 ? high.y : low.y,
                               (k & 4) != 0 ? high.z : low.z);
  soup.faces = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  return closed_surface(soup).surface;
}

/// m, below the surface of the bracket; negative outside. In closed form.
double depth_in_bracket(const Vec3& p) {
  const double in_arms =
      std::max(std::min(0.02 - p.x, 0.06 - p.y), std::min(0.06 - p.x, 0.02 - p.y));
  double across = std::min(p.x, p.y);
  if (p.x < 0.02 && p.y < 0.02) {
    across = std::min(across, std::hypot(0.02 - p.x, 0.02 - p.y));
  } else {
    across = std::min(across, in_arms);
  }
  return std::min({across, p.z, 0.03 - p.z});
}

double volume_within(const ClosedSurface& surface) {
  double volume = 0;
  for (const auto& [a, b, c] : surface.triangles)
    volume +=
        glm::dot(surface.vertices[a], glm::cross(surface.vertices[b], surface.vertices[c])) / 6;
  return volume;
}

SolidDepth depth_of(const ClosedSurface& surface) {
  const PlacedShell shell{&surface, Pose{}};
  return SolidDepth(std::span(&shell, 1));
}

TEST(LayerSurface, HoldsThePointsThatAreDeeper) {
  const ClosedSurface solid = closed_bracket();
  const double d = 0.004;
  const LayerSurface layer = layer_surface(depth_of(solid), d);
  ASSERT_FALSE(layer.surface.triangles.empty());
  EXPECT_LE(layer.error, 0.1 * d);
  const SolidDepth in_layer = depth_of(layer.surface);
  Random random(3);
  int inside = 0;
  for (int i = 0; i < 5000; ++i) {
    const Vec3 p(0.06 * random.unit(), 0.06 * random.unit(), 0.03 * random.unit());
    const double deeper = depth_in_bracket(p) - d;
    if (std::abs(deeper) <= layer.error) continue;
    EXPECT_EQ(deeper > 0, in_layer.at(p).depth > 0) << p.x << ' ' << p.y << ' ' << p.z;
    inside += deeper > 0 ? 1 : 0;
  }
  EXPECT_GT(inside, 500);
}

TEST(LayerSurface, ErrorIsTheLargestOnItsTriangles) {
  const ClosedSurface solid = closed_bracket();
  Random random(4);
  for (const double d : {0.002, 0.004, 0.006}) {
    const LayerSurface layer = layer_surface(depth_of(solid), d);
    double most = 0;
    int places = 0, beyond = 0;
    for (const auto& [a, b, c] : layer.surface.triangles) {
      for (int i = 0; i < 6; ++i) {
        const double u = std::sqrt(random.unit()), v = random.unit();
        const Vec3 p = (1 - u) * layer.surface.vertices[a] +
                       u * (1 - v) * layer.surface.vertices[b] + u * v * layer.surface.vertices[c];
        const double off = std::abs(depth_in_bracket(p) - d);
        most = std::max(most, off);
        beyond += off > kLayerError * d ? 1 : 0;
        ++places;
      }
    }
    EXPECT_LE(beyond, 0.01 * places) << d;
    EXPECT_LE(most, 1.1 * layer.error) << d;
    EXPECT_GE(most, 0.5 * layer.error) << d;
  }
}

TEST(LayerSurface, PlanesAndConvexEdgesAreExact) {
  const ClosedSurface outer = closed_box(Vec3(-0.02), Vec3(0.02)),
                      left = closed_box(Vec3(-0.02), {0.001, 0.02, 0.02});
  const std::vector<PlacedShell> shells = {{&outer, Pose{}}, {&left, Pose{}}};
  const LayerSurface layer = layer_surface(SolidDepth(shells), 0.005);
  EXPECT_LT(layer.error, 1e-12);
  EXPECT_NEAR(volume_within(layer.surface), std::pow(0.03, 3), 1e-14);
}

TEST(LayerSurface, PartsThatAbutHaveNoSurfaceBetween) {
  const ClosedSurface left = closed_box({0, 0, 0}, {0.02, 0.02, 0.02}),
                      right = closed_box({0.02, 0, 0}, {0.05, 0.02, 0.02});
  const std::vector<PlacedShell> shells = {{&left, Pose{}}, {&right, Pose{}}};
  const SolidDepth solid(shells);
  EXPECT_NEAR(solid.at(Vec3(0.02, 0.01, 0.01)).depth, 0.01, 1e-12);
  EXPECT_NEAR(volume_within(layer_surface(solid, 0.005).surface), 0.04 * 0.01 * 0.01, 1e-14);
}

TEST(LayerSurface, EndsWithItsPart) {
  const ClosedSurface left = closed_box({0, 0, 0}, {0.02, 0.02, 0.02}),
                      right = closed_box({0.02, 0, 0}, {0.05, 0.02, 0.02});
  const std::vector<PlacedShell> shells = {{&left, Pose{}}, {&right, Pose{}}};
  const SolidDepth solid(shells), own = depth_of(right);
  const double d = 0.005, length = 0.025 + kLayerError * d;
  EXPECT_NEAR(volume_within(layer_surface(solid, d, &own).surface), length * 0.01 * 0.01, 1e-14);
}

TEST(LayerSurface, ThinWallsHaveNone) {
  const ClosedSurface plate = closed_box({0, 0, 0}, {0.05, 0.05, 0.002});
  EXPECT_TRUE(layer_surface(depth_of(plate), 0.001).surface.triangles.empty());
  const double deepest = deepest_layer(depth_of(plate));
  EXPECT_GT(deepest, 0.85 * 0.001);
  EXPECT_LT(deepest, 0.001);
  EXPECT_FALSE(layer_surface(depth_of(plate), deepest).surface.triangles.empty());
}

}  // namespace
}  // namespace palpate::stimuli
