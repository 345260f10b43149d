// Gaps of two closed surfaces against every pair of their triangles.

#include "rendering/bodies/surface_gap.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <memory>
#include <string>
#include <vector>

#include "data/base/random.h"
#include "stimuli/closed_surface.h"
#include "stimuli/nearest_on_triangle.h"
#include "stimuli/orientation.h"
#include "stimuli/primitives.h"
#include "tests/shared/probe_paths.h"
#include "tests/stimuli/concave_solids.h"

namespace palpate::rendering {
namespace {

using testing::random_direction;
using testing::uniform;

stimuli::CollisionSurface surface_of(const stimuli::PolygonSoup& soup) {
  const stimuli::ClosedSurface closed = stimuli::closed_surface(soup).surface;
  return {closed.vertices, closed.triangles};
}

/// A ball with bumps and hollows.
stimuli::PolygonSoup lump(Random& random, int subdivisions) {
  stimuli::PolygonSoup soup = stimuli::icosphere(0.02, subdivisions);
  for (Vec3& v : soup.vertices) v *= uniform(random, 0.6, 1.2);
  return soup;
}

stimuli::PolygonSoup any_shape(Random& random) {
  switch (random.below(6)) {
    case 0:
      return lump(random, 1);
    case 1:
      return lump(random, 2);
    case 2:
      return stimuli::solids::l_shape().soup;
    case 3:
      return stimuli::solids::u_shape().soup;
    case 4:
      return stimuli::box(Vec3(0.03, 0.05, 0.01));
    default:
      return stimuli::solids::stair(5).soup;
  }
}

SurfacePlace at(const stimuli::CollisionSurface& surface, const Vec3& position,
                const Quat& orientation = Quat(1, 0, 0, 0)) {
  return {&surface, glm::mat3_cast(orientation), position};
}

double between_segments(const Vec3& p, const Vec3& u, const Vec3& q, const Vec3& v) {
  // Least over the interior, then over ends.
  double least = HUGE_VAL;
  const auto to = [&](const Vec3& point, const Vec3& start, const Vec3& along) {
    const double t = std::clamp(glm::dot(point - start, along) / glm::dot(along, along), 0.0, 1.0);
    least = std::min(least, glm::distance(point, start + t * along));
  };
  to(p, q, v);
  to(p + u, q, v);
  to(q, p, u);
  to(q + v, p, u);
  const Vec3 n = glm::cross(u, v);
  const double n2 = glm::dot(n, n);
  if (n2 > 0) {
    const double s = glm::dot(glm::cross(q - p, v), n) / n2;
    const double t = glm::dot(glm::cross(q - p, u), n) / n2;
    if (s > 0 && s < 1 && t > 0 && t < 1)
      least = std::min(least, std::abs(glm::dot(n, q - p)) / std::sqrt(n2));
  }
  return least;
}

std::vector<std::array<Vec3, 3>> triangles_of(const SurfacePlace& place) {
  std::vector<std::array<Vec3, 3>> out;
  for (const stimuli::CollisionSurface::Face& face : place.surface->faces()) {
    std::array<Vec3, 3> corners;
    for (std::size_t k = 0; k < 3; ++k)
      corners[k] = place.axes * place.surface->vertices()[face.corners[k]] + place.position;
    out.push_back(corners);
  }
  return out;
}

/// Of two surfaces that do not cross.
double every_pair(const SurfacePlace& a, const SurfacePlace& b) {
  double least = HUGE_VAL;
  const auto all_a = triangles_of(a), all_b = triangles_of(b);
  for (const auto& s : all_a) {
    for (const auto& t : all_b) {
      for (std::size_t i = 0; i < 3; ++i) {
        least = std::min(least, glm::distance(s[i], stimuli::nearest_on_triangle(t, s[i])));
        least = std::min(least, glm::distance(t[i], stimuli::nearest_on_triangle(s, t[i])));
        for (std::size_t k = 0; k < 3; ++k)
          least = std::min(
              least, between_segments(s[i], s[(i + 1) % 3] - s[i], t[k], t[(k + 1) % 3] - t[k]));
      }
    }
  }
  return least;
}

bool cross(const SurfacePlace& a, const SurfacePlace& b) { return overlap_of(a, b) > 0; }

TEST(SurfaceGap, EqualsEveryPairOfTriangles) {
  int judged = 0;
  for (const std::uint64_t seed : {1, 2, 3}) {
    Random random(seed);
    for (int i = 0; i < 60; ++i) {
      const stimuli::CollisionSurface a = surface_of(any_shape(random)),
                                      b = surface_of(any_shape(random));
      const SurfacePlace at_a = at(a, uniform(random, 0, 0.06) * random_direction(random),
                                   stimuli::uniform_rotation(random));
      const SurfacePlace at_b = at(b, Vec3(0), stimuli::uniform_rotation(random));
      if (cross(at_a, at_b)) continue;
      const double exact = every_pair(at_a, at_b);
      EXPECT_NEAR(gap_between(at_a, at_b, {1}), exact, 1e-12) << seed << ' ' << i;
      EXPECT_NEAR(gap_between(at_b, at_a, {1}), exact, 1e-12) << seed << ' ' << i;
      ++judged;
    }
  }
  EXPECT_GT(judged, 60);
}

TEST(SurfaceGap, ShortReachFindsNoMore) {
  Random random(4);
  const stimuli::CollisionSurface a = surface_of(lump(random, 2)), b = surface_of(lump(random, 2));
  const SurfacePlace at_a = at(a, Vec3(0)), at_b = at(b, Vec3(0.06, 0, 0));
  const double gap = gap_between(at_a, at_b, {1});
  EXPECT_GT(gap, 2e-3);
  EXPECT_EQ(gap_between(at_a, at_b, {1e-8, 1e-3}), 1e-3);
  EXPECT_EQ(gap_between(at_a, at_b, {1.01 * gap}), gap);
}

TEST(SurfaceGap, BoxLiesOnItsFourCorners) {
  const stimuli::CollisionSurface floor = surface_of(stimuli::box(Vec3(0.5, 0.5, 0.02))),
                                  box = surface_of(stimuli::box(Vec3(0.03, 0.05, 0.01)));
  NearPlaces places;
  places.make_room();
  for (const double gap : {5e-9, 0.0, -5e-9, 1e-6, -1e-5}) {
    const Quat turn = glm::angleAxis(0.3, Vec3(0, 0, 1));
    EXPECT_NEAR(find_places(at(box, Vec3(0.01, 0.02, 0.015 + gap), turn), at(floor, Vec3(0)),
                            {1e-5}, 1e-4, places),
                gap, 1e-15);
    ASSERT_EQ(places.chosen.size(), 4U);
    for (const NearPlace& place : places.chosen) {
      EXPECT_NEAR(place.gap, gap, 1e-15);
      EXPECT_NEAR(place.normal.z, -1, 1e-12);
    }
  }
}

TEST(SurfaceGap, InnerEdgesOfAPlateAreNone) {
  // A plate of many triangles, a spike just over it.
  stimuli::PolygonSoup plate;
  constexpr int kCells = 10;
  const auto index = [](int i, int k) { return static_cast<std::uint32_t>(i * (kCells + 1) + k); };
  const auto half = static_cast<std::uint32_t>((kCells + 1) * (kCells + 1));
  for (const double z : {0.0, 0.01}) {
    for (int i = 0; i <= kCells; ++i) {
      for (int k = 0; k <= kCells; ++k) plate.vertices.emplace_back(0.01 * i, 0.01 * k, z);
    }
  }
  for (int i = 0; i < kCells; ++i) {
    for (int k = 0; k < kCells; ++k) {
      const auto a = index(i, k), b = index(i + 1, k), c = index(i + 1, k + 1), d = index(i, k + 1);
      plate.faces.push_back({a, d, c, b});
      plate.faces.push_back({half + a, half + b, half + c, half + d});
    }
    for (const auto& [a, b] : {std::pair{index(i, 0), index(i + 1, 0)},
                               std::pair{index(i + 1, kCells), index(i, kCells)},
                               std::pair{index(0, i + 1), index(0, i)},
                               std::pair{index(kCells, i), index(kCells, i + 1)}})
      plate.faces.push_back({a, b, half + b, half + a});
  }
  const stimuli::CollisionSurface flat = surface_of(plate);
  Random random(5);
  const stimuli::CollisionSurface box = surface_of(stimuli::box(Vec3(0.01, 0.01, 0.01)));
  NearPlaces places;
  places.make_room();
  for (int i = 0; i < 200; ++i) {
    const Quat turn = stimuli::uniform_rotation(random);
    double lowest = 0;
    for (const Vec3& v : box.vertices()) lowest = std::min(lowest, (turn * v).z);
    // Over an inner edge as well.
    const Vec3 place(i % 2 == 0 ? 0.05 : uniform(random, 0.03, 0.07), uniform(random, 0.03, 0.07),
                     0.01 - lowest + 1e-8);
    find_places(at(box, place, turn), at(flat, Vec3(0)), {2e-3}, 1e-3, places);
    ASSERT_FALSE(places.chosen.empty());
    for (const NearPlace& one : places.chosen) EXPECT_NEAR(one.normal.z, -1, 1e-9);
  }
}

TEST(SurfaceGap, OverlapHasItsDepth) {
  Random random(6);
  const stimuli::CollisionSurface box = surface_of(stimuli::box(Vec3(0.03, 0.05, 0.01)));
  const stimuli::CollisionSurface stairs = surface_of(stimuli::solids::l_shape().soup);
  EXPECT_NEAR(overlap_of(at(box, Vec3(0)), at(box, Vec3(0.029, 0, 0))), 1e-3, 1e-9);
  EXPECT_GT(overlap_of(at(box, Vec3(0)), at(box, Vec3(0.01, 0.01, 0))), 4e-3);
  EXPECT_EQ(overlap_of(at(box, Vec3(0)), at(box, Vec3(0.0301, 0, 0))), 0);
  for (const stimuli::CollisionSurface* one : {&box, &stairs})
    EXPECT_GT(overlap_of(at(*one, Vec3(0)), at(*one, Vec3(0))), 4e-3) << "at one place";
  // Crossed bars: no corner of one is in the other.
  EXPECT_GT(overlap_of(at(box, Vec3(0)), at(box, Vec3(0), glm::angleAxis(1.57, Vec3(0, 0, 1)))),
            4e-3);
  EXPECT_GT(overlap_of(at(stairs, Vec3(0)), at(box, Vec3(0.03, 0.01, 0.015))), 1e-3);
  EXPECT_EQ(overlap_of(at(stairs, Vec3(0)), at(box, Vec3(0.04, 0.046, 0.015))), 0);
}

}  // namespace
}  // namespace palpate::rendering
