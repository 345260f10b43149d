// Equation (2) where a stylus lies along several faces at once.

#include <gtest/gtest.h>

#include <numbers>

#include "rendering/renderer.h"
#include "stimuli/polygon_soup.h"
#include "tests/shared/union_scenes.h"

namespace palpate::rendering {
namespace {

using testing::kBlendAngle;
using testing::kTick;

constexpr double kHalfLength = 0.06;  // m, of the stylus; it is longer than the block

/// A block of 60 mm along x with a ridge over the middle, whose faces meet at `angle`, rad.
Scene ridge(double angle) {
  stimuli::PolygonSoup soup;
  const double fall = 0.03 * std::tan(angle / 2);
  for (const double y : {-0.02, 0.02}) {
    for (const Vec3& v : {Vec3(-0.03, y, -0.03), Vec3(0.03, y, -0.03), Vec3(0.03, y, -fall),
                          Vec3(0, y, 0), Vec3(-0.03, y, -fall)})
      soup.vertices.push_back(v);
  }
  soup.faces = {{0, 1, 2, 3, 4}, {9, 8, 7, 6, 5}, {0, 5, 6, 1}, {1, 6, 7, 2},
                {2, 7, 8, 3},    {3, 8, 9, 4},    {4, 9, 5, 0}};
  return Scene({testing::placed_object(testing::mesh_of(soup))});
}

/// Lying across the ridge, its middle 1 mm below, the tail lower by a tilt, rad.
LineProbe across(double tilt) {
  const Vec3 half = kHalfLength * Vec3(std::cos(tilt), 0, -std::sin(tilt));
  return {Vec3(0, 0, -0.001) - half, Vec3(0, 0, -0.001) + half};
}

/// m, places of the contact along the stylus while it is tilted from one side to the other.
template <class Visit>
void rock(const Scene& scene, double most, const Visit& visit) {
  constexpr double kStep = 2e-5;  // rad
  RenderState state = scene.initial_state();
  LineProbe above = across(-most);
  above.tip.z += 0.1;
  above.tail.z += 0.1;
  ray_renderer().tick(scene, state, above, kTick);
  for (double tilt = -most; tilt <= most; tilt += kStep)
    visit(tilt, ray_renderer().tick(scene, state, across(tilt), kTick));
}

TEST(EquivalentPoint, MovesWithoutJumpsOverAShallowRidge) {
  for (const double degrees : {0.1, 0.5, 1.0, 1.9, 2.5, 5.0}) {
    const double angle = degrees * std::numbers::pi / 180;
    double last = -1;
    rock(ridge(angle), angle / 2 + 1.5 * kBlendAngle, [&](double tilt, const Rendering& r) {
      ASSERT_EQ(r.contacts, 1);
      const double at = r.deepest.along;
      // Never faster than (2) over one face as long as the block: 60 mm in 2 epsilon.
      if (last >= 0) {
        ASSERT_LE(std::abs(at - last), 2e-5 * 0.06 / kBlendAngle + 1e-6)
            << degrees << " degrees, tilt " << tilt;
        ASSERT_GE(at - last, -1e-6) << "back, at " << tilt;
      }
      last = at;
    });
  }
}

TEST(EquivalentPoint, RidgeWithoutAngleIsAFlatFace) {
  const Scene flat({testing::placed_object(testing::box({-0.03, -0.02, -0.03}, {0.03, 0.02, 0}))});
  std::vector<double> on_flat;
  const double most = 0.9 * kBlendAngle;
  rock(flat, most, [&](double, const Rendering& r) { on_flat.push_back(r.deepest.along); });
  std::size_t i = 0;
  rock(ridge(1e-5), most, [&](double tilt, const Rendering& r) {
    ASSERT_NEAR(r.deepest.along, on_flat[i++], 0.06 * 1e-5 / kBlendAngle) << tilt;
    ASSERT_EQ(r.deepest.type, ContactType::segment_face);
  });
}

TEST(EquivalentPoint, FarFromTheRidgeEquationTwoHoldsAlone) {
  // Half of the stylus is over one face, and the other is beyond its end.
  const double angle = 1.5 * std::numbers::pi / 180;
  const Scene scene = ridge(angle);
  const Vec3 along(std::cos(angle / 2), 0, -std::sin(angle / 2)),
      out(std::sin(angle / 2), 0, std::cos(angle / 2));
  for (const double theta : {-0.5 * kBlendAngle, 0.0, 0.3 * kBlendAngle}) {
    // The tip is over the right-hand face, 10 mm from the ridge; the face ends 30 mm / cos from it.
    const Vec3 d = 0.1 * (std::cos(theta) * along + std::sin(theta) * out);
    const Vec3 tip = 0.01 * along - 0.001 * out;
    RenderState state = scene.initial_state();
    ray_renderer().tick(scene, state, {tip + 0.1 * out, tip + 0.1 * out + d}, kTick);
    ray_renderer().tick(scene, state, {tip + 0.01 * out, tip + 0.01 * out + d}, kTick);
    const Rendering r = ray_renderer().tick(scene, state, {tip, tip + d}, kTick);
    const double end = (0.03 / std::cos(angle / 2) - 0.01) / std::cos(theta);
    const double expected = end / 2 - theta / kBlendAngle * end / 2;
    EXPECT_NEAR(r.deepest.along, expected, 2e-5) << theta;
  }
}

TEST(EquivalentPoint, CutSlabHasThePointOfTheWhole) {
  const Scene whole(
      testing::object_of({testing::box_soup({-0.05, -0.05, -0.04}, {0.05, 0.05, 0})}));
  const Scene cut(testing::object_of({testing::box_soup({-0.05, -0.05, -0.04}, {-0.01, 0.05, 0}),
                                      testing::box_soup({-0.01, -0.05, -0.04}, {0, 0.05, 0}),
                                      testing::box_soup({0, -0.05, -0.04}, {0.05, 0.05, 0})}));
  ASSERT_TRUE(cut.features().unions);
  RenderState of_whole = whole.initial_state(), of_cut = cut.initial_state();
  for (double tilt = -2 * kBlendAngle; tilt <= 2 * kBlendAngle; tilt += 1e-4) {
    LineProbe probe = across(tilt);
    if (tilt == -2 * kBlendAngle)
      probe = {probe.tip + Vec3(0, 0, 0.1), probe.tail + Vec3(0, 0, 0.1)};
    const Rendering a = ray_renderer().tick(whole, of_whole, probe, kTick),
                    b = ray_renderer().tick(cut, of_cut, probe, kTick);
    ASSERT_EQ(a.contacts, b.contacts);
    ASSERT_LE(glm::length(a.force - b.force), 1e-11);
    ASSERT_LE(glm::length(a.torque - b.torque), 1e-12) << tilt;
    ASSERT_NEAR(a.deepest.along, b.deepest.along, 1e-12) << tilt;
  }
}

}  // namespace
}  // namespace palpate::rendering
