// The body behind the moved planes of a convex body, against the definition.

#include "stimuli/inset.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>
#include <glm/matrix.hpp>
#include <glm/vec4.hpp>
#include <limits>
#include <vector>

#include "data/base/random.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/grid_hull.h"
#include "stimuli/orientation.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"

namespace palpate::stimuli {
namespace {

std::vector<HalfSpace> moved_planes(const ConvexMesh& mesh, double depth) {
  std::vector<HalfSpace> planes;
  for (const Facet& facet : mesh.facets()) planes.push_back({facet.normal, facet.offset - depth});
  return planes;
}

double furthest_outside(const std::vector<HalfSpace>& planes, const Vec3& point) {
  double most = -std::numeric_limits<double>::infinity();
  for (const HalfSpace& p : planes) most = std::max(most, glm::dot(p.normal, point) - p.offset);
  return most;
}

/// max u.x over the intersection of the half-spaces, from every corner that three of them can form;
/// -infinity if it is empty.
double brute_force_support(const std::vector<HalfSpace>& planes, const Vec3& u, double size) {
  double best = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < planes.size(); ++i) {
    for (std::size_t j = i + 1; j < planes.size(); ++j) {
      for (std::size_t k = j + 1; k < planes.size(); ++k) {
        const glm::dmat3 rows =
            glm::transpose(glm::dmat3(planes[i].normal, planes[j].normal, planes[k].normal));
        if (std::abs(glm::determinant(rows)) < 1e-9) continue;
        const Vec3 x =
            glm::inverse(rows) * Vec3(planes[i].offset, planes[j].offset, planes[k].offset);
        if (furthest_outside(planes, x) < 1e-9 * size) best = std::max(best, glm::dot(u, x));
      }
    }
  }
  return best;
}

double support(const ConvexMesh& mesh, const Vec3& u) {
  double best = -std::numeric_limits<double>::infinity();
  for (const Vec3& v : mesh.vertices()) best = std::max(best, glm::dot(u, v));
  return best;
}

Vec3 random_vector(Random& random) { return {random.normal(), random.normal(), random.normal()}; }

ConvexMesh random_body(Random& random, int points) {
  std::vector<Vec3> cloud;
  const Vec3 stretch(0.01 + 0.05 * random.unit(), 0.01 + 0.05 * random.unit(),
                     0.01 + 0.05 * random.unit());
  for (int i = 0; i < points; ++i)
    cloud.push_back(stretch * random_vector(random) + Vec3(0.3, 0, 0));
  return ConvexMesh(grid_hull(cloud, 0).soup);
}

PolygonSoup turned(PolygonSoup soup, const Quat& rotation) {
  for (Vec3& v : soup.vertices) v = rotation * v;
  return soup;
}

void expect_as_defined(const ConvexMesh& mesh, double depth, const ConvexMesh& in) {
  const std::vector<HalfSpace> planes = moved_planes(mesh, depth);
  const double tolerance = 1e-11 * mesh.size();
  for (const Vec3& v : in.vertices()) {
    int touched = 0;
    double outside = -1;
    for (const HalfSpace& p : planes) {
      const double above = glm::dot(p.normal, v) - p.offset;
      outside = std::max(outside, above);
      touched += std::abs(above) <= tolerance ? 1 : 0;
    }
    EXPECT_LE(outside, tolerance);
    EXPECT_GE(touched, 3);
  }
  EXPECT_LE(in.facets().size(), mesh.facets().size());
}

TEST(Inset, IsTheIntersectionOfTheMovedHalfSpaces) {
  constexpr std::uint64_t kSeed = 31;
  Random random(kSeed);
  int vanished = 0;
  for (int body = 0; body < 40; ++body) {
    const ConvexMesh mesh = random_body(random, 6 + static_cast<int>(9 * random.unit()));
    const double depth = largest_inscribed_ball(mesh).radius * random.unit();
    const auto in = inset(mesh, depth);
    ASSERT_TRUE(in);
    vanished += in->facets().size() < mesh.facets().size();
    expect_as_defined(mesh, depth, *in);
    for (int i = 0; i < 3; ++i) {
      const Vec3 u = glm::normalize(random_vector(random));
      EXPECT_NEAR(support(*in, u), brute_force_support(moved_planes(mesh, depth), u, mesh.size()),
                  1e-10 * mesh.size());
    }
  }
  EXPECT_GT(vanished, 10);
}

TEST(Inset, IsEmptyFromTheInradiusOn) {
  constexpr std::uint64_t kSeed = 32;
  Random random(kSeed);
  for (int body = 0; body < 20; ++body) {
    const ConvexMesh mesh = random_body(random, 8);
    const double r = largest_inscribed_ball(mesh).radius;
    const Vec3 u = glm::normalize(random_vector(random));
    EXPECT_TRUE(inset(mesh, r * (1 - 1e-6)));
    EXPECT_FALSE(inset(mesh, r));
    EXPECT_FALSE(inset(mesh, 2 * r));
    // No corner is behind all planes any more (at r itself one is, within rounding).
    EXPECT_EQ(brute_force_support(moved_planes(mesh, r * (1 + 1e-6)), u, 0),
              -std::numeric_limits<double>::infinity());
  }
}

TEST(Inset, LargestBallIsInsideAndNoneIsLarger) {
  constexpr std::uint64_t kSeed = 33;
  Random random(kSeed);
  for (int body = 0; body < 30; ++body) {
    const ConvexMesh mesh = random_body(random, 7);
    const Ball ball = largest_inscribed_ball(mesh);
    EXPECT_NEAR(furthest_outside(moved_planes(mesh, 0), ball.centre), -ball.radius,
                1e-14 * mesh.size());
    // The largest r of all (c, r) on four planes and behind the others.
    const auto planes = moved_planes(mesh, 0);
    double best = 0;
    for (std::size_t a = 0; a < planes.size(); ++a) {
      for (std::size_t b = a + 1; b < planes.size(); ++b) {
        for (std::size_t c = b + 1; c < planes.size(); ++c) {
          for (std::size_t d = c + 1; d < planes.size(); ++d) {
            glm::dmat4 rows;
            glm::dvec4 offsets;
            int r = 0;
            for (const std::size_t i : {a, b, c, d}) {
              for (int k = 0; k < 3; ++k) rows[k][r] = planes[i].normal[k];
              rows[3][r] = 1;
              offsets[r++] = planes[i].offset;
            }
            if (std::abs(glm::determinant(rows)) < 1e-9) continue;
            const glm::dvec4 x = glm::inverse(rows) * offsets;
            if (furthest_outside(planes, Vec3(x)) <= -x[3] + 1e-10 * mesh.size())
              best = std::max(best, x[3]);
          }
        }
      }
    }
    EXPECT_NEAR(ball.radius, best, 1e-9 * mesh.size());
  }
}

TEST(Inset, CubeStaysACube) {
  constexpr std::uint64_t kSeed = 34;
  Random random(kSeed);
  const Quat rotation = uniform_rotation(random);
  const ConvexMesh mesh(turned(cube(0.05), rotation));
  const auto in = inset(mesh, 0.004);
  ASSERT_TRUE(in);
  EXPECT_EQ(in->vertices().size(), 8u);
  for (const Vec3& v : in->vertices()) {
    const Vec3 local = glm::inverse(rotation) * v;
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(std::abs(local[k]), 0.021, 1e-15);
  }
}

TEST(Inset, ConeStaysAConeWithinTheSameBall) {
  const ConvexMesh mesh(cone(0.03, 0.06, 64));
  const Ball ball = largest_inscribed_ball(mesh);
  // Apothem a and height h: in the section through a side's middle, r = a h / (a + slant).
  const double a = 0.03 * std::cos(M_PI / 64), slant = std::hypot(a, 0.06);
  EXPECT_NEAR(ball.radius, a * 0.06 / (a + slant), 1e-16);
  EXPECT_NEAR(ball.centre.z, -0.03 + ball.radius, 1e-16);
  const auto in = inset(mesh, 0.25 * ball.radius);
  ASSERT_TRUE(in);
  ASSERT_EQ(in->vertices().size(), mesh.vertices().size());
  const ConvexMesh expected(cone(0.75 * 0.03, 0.75 * 0.06, 64));
  const Vec3 shift(0, 0, 0.25 * ball.centre.z);  // scaled about the ball's centre
  for (int i = 0; i < 64; ++i) {
    const Vec3 u = glm::normalize(Vec3(std::cos(i), std::sin(i), std::sin(3.0 * i)));
    EXPECT_NEAR(support(*in, u), support(expected, u) + glm::dot(u, shift), 1e-15);
  }
}

TEST(Inset, CylinderGetsNarrowerAndLower) {
  const ConvexMesh mesh(cylinder(0.03, 0.05, 64));
  const auto in = inset(mesh, 0.004);
  ASSERT_TRUE(in);
  const double c = std::cos(M_PI / 64), rim = (0.03 * c - 0.004) / c;
  EXPECT_EQ(in->vertices().size(), 128u);
  for (const Vec3& v : in->vertices()) {
    EXPECT_NEAR(std::hypot(v.x, v.y), rim, 1e-15);
    EXPECT_NEAR(std::abs(v.z), 0.021, 1e-16);
  }
}

TEST(Inset, SphereIsAsDefinedHoweverLittleFacetsMove) {
  for (const int subdivisions : {0, 2, 4}) {
    const ConvexMesh mesh(icosphere(0.03, subdivisions));
    for (const double depth : {1e-12, 1e-9, 1e-6, 1e-3, 0.02}) {
      const auto in = inset(mesh, depth);
      ASSERT_TRUE(in) << subdivisions << ' ' << depth;
      expect_as_defined(mesh, depth, *in);
      EXPECT_EQ(in->facets().size(), mesh.facets().size()) << subdivisions << ' ' << depth;
    }
  }
}

TEST(Inset, PlateStaysAPlate) {
  constexpr std::uint64_t kSeed = 35;
  Random random(kSeed);
  const ConvexMesh mesh(turned(cylinder(0.03, 0.002, 64), uniform_rotation(random)));
  for (const double share : {0.5, 0.99, 0.9999}) {
    const auto in = inset(mesh, 0.001 * share);
    ASSERT_TRUE(in);
    EXPECT_EQ(in->facets().size(), 66u);
    expect_as_defined(mesh, 0.001 * share, *in);
  }
  EXPECT_FALSE(inset(mesh, 0.001));
}

TEST(Inset, ACornerSplitByRoundingIsOneCorner) {
  // A pyramid of 48 sides whose planes miss its apex by about 1e-12 of its size.
  constexpr double kSize = 0.06;
  constexpr int kSides = 48;
  constexpr std::uint64_t kSeed = 36;
  Random random(kSeed);
  for (int body = 0; body < 20; ++body) {
    const Quat rotation = uniform_rotation(random);
    const Vec3 apex = rotation * Vec3(0, 0, 0.5 * kSize);
    std::vector<HalfSpace> planes{{rotation * Vec3(0, 0, -1), 0.5 * kSize}};
    for (int i = 0; i < kSides; ++i) {
      const double angle = 2 * M_PI * i / kSides;
      const Vec3 normal = rotation * glm::normalize(Vec3(std::cos(angle), std::sin(angle), 1));
      planes.push_back({normal, glm::dot(normal, apex) + 1e-12 * kSize * random.normal()});
    }
    const auto pyramid = body_behind(planes, Vec3(0), kSize);
    EXPECT_EQ(pyramid->facets().size(), kSides + 1U);
    std::size_t at_base = 0;
    for (const Vec3& v : pyramid->vertices()) {
      EXPECT_LE(furthest_outside(planes, v), 1e-9 * kSize);
      if (glm::distance(v, apex) > 1e-7 * kSize) {
        EXPECT_NEAR(glm::distance(v, -apex), kSize / std::cos(M_PI / kSides), 1e-9 * kSize);
        ++at_base;
      }
    }
    EXPECT_EQ(at_base, kSides);
  }
}

}  // namespace
}  // namespace palpate::stimuli
