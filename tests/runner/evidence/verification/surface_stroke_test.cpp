// The hand of measurements moves as described: speed, depth, place along the stylus, pauses.

#include "runner/evidence/verification/surface_stroke.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace palpate::runner::evidence {
namespace {
namespace surface_stroke {

/// Statistics of a stroke over a ball.
struct Ticks {
  int touching = 0, lifted = 0, deep_enough = 0;
  double along_least = 1, along_most = 0;  ///< m, of the place on the stylus, while touching
  double farthest = 0;  ///< m, of that place's motion along the surface in a tick
  double nearest = 1;
  double most_turn = 0;  ///< rad, of the stylus in a tick
  double coverage = 0;   ///< the least cosine between two places' directions
};

Ticks stroked(const SurfaceStrokeSettings& settings, int ticks) {
  SurfaceStroke hand(settings);
  Ticks out;
  double depth = 0;
  rendering::LineProbe last{};
  Vec3 last_place(0), first_place(0);
  for (int i = 0; i < ticks; ++i) {
    const rendering::LineProbe probe = hand.next(depth);
    const Vec3 d = probe.tail - probe.tip, from = settings.centre - probe.tip;
    EXPECT_NEAR(glm::length(d), settings.length, 1e-12);
    const double share =
        settings.side ? std::clamp(glm::dot(from, d) / glm::dot(d, d), 0.0, 1.0) : 0;
    const Vec3 place = probe.tip + share * d - settings.centre;
    depth = settings.radius - glm::length(place);
    const bool was_on = i > 1000;  // it has come down
    if (was_on) {
      out.touching += depth > 0;
      out.lifted += depth < -0.5e-3;
      out.deep_enough += depth > 0.9e-3 && depth < 2.1e-3;
      if (depth > 0) {
        out.along_least = std::min(out.along_least, share * settings.length);
        out.along_most = std::max(out.along_most, share * settings.length);
      }
      const Vec3 way = glm::normalize(place) - glm::normalize(last_place);
      out.farthest = std::max(out.farthest, settings.radius * glm::length(way));
      out.nearest = std::min(out.nearest, settings.radius * glm::length(way));
      const double turn = glm::dot(d, last.tail - last.tip) / glm::dot(d, d);
      out.most_turn = std::max(out.most_turn, std::acos(std::min(1.0, turn)));
      out.coverage =
          std::min(out.coverage, glm::dot(glm::normalize(place), glm::normalize(first_place)));
    } else {
      first_place = place;
    }
    last = probe;
    last_place = place;
  }
  return out;
}

TEST(SurfaceStroke, KeepsItsPaceAndDepth) {
  for (const std::uint64_t seed : {1, 2, 3}) {
    for (const bool side : {false, true}) {
      SurfaceStrokeSettings settings;
      settings.centre = {0.1, -0.2, 0.3};
      settings.side = side;
      settings.seed = seed;
      const Ticks t = stroked(settings, 20000);
      EXPECT_EQ(t.touching, 18999);
      EXPECT_GT(t.deep_enough, 18000);
      EXPECT_NEAR(t.farthest, 1e-4, 3e-6) << side;
      EXPECT_NEAR(t.nearest, 1e-4, 3e-6) << side;
      EXPECT_LT(t.most_turn, 0.15) << "a hand does not jerk";
      EXPECT_LT(t.coverage, -0.5) << "it comes to the other side";
      EXPECT_LT(t.along_least, 1e-3);
      EXPECT_NEAR(t.along_most, side ? 0.04 : 0, 1e-3);
    }
  }
}

TEST(SurfaceStroke, StrokesSmallObjectsSlowerAndLessDeep) {
  SurfaceStrokeSettings settings;
  settings.radius = 0.006;
  settings.side = false;
  const Ticks t = stroked(settings, 8000);
  EXPECT_NEAR(t.farthest, 2e-5, 1e-6);
  EXPECT_EQ(t.deep_enough, 0);
  EXPECT_EQ(t.touching, 6999);
}

TEST(SurfaceStroke, LiftsForItsShareOfTheTime) {
  SurfaceStrokeSettings settings;
  settings.side = false;
  settings.lifted = 0.4;
  const Ticks t = stroked(settings, 41000);
  EXPECT_NEAR(t.lifted, 16000, 1200);
  EXPECT_NEAR(t.touching, 24000, 1200);
}

}  // namespace surface_stroke
}  // namespace
}  // namespace palpate::runner::evidence
