// A stylus exactly parallel to a face, flush with it and held at the face's rim, was moved sideways
// off the object. No step of the walk lowered the depth then, and the walk stayed where it was: 1
// mm beside a cube the hand was still pushed up, by as much as it had been deep; a jump to the
// other side of the room was a contact kilometres deep.

#include <gtest/gtest.h>

#include <glm/geometric.hpp>
#include <memory>

#include "rendering/renderer.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/primitives.h"

namespace palpate {
namespace {

constexpr double kHalf = 0.03;  // m

class BesideACube {
 public:
  BesideACube()
      : scene_({{std::make_shared<const stimuli::ConvexMesh>(stimuli::cube(2 * kHalf)),
                 {},
                 {},
                 0,
                 nullptr}}) {
    state_ = scene_.initial_state();
  }
  rendering::Rendering tick(const Vec3& tip, const Vec3& d) {
    return rendering::ray_renderer().tick(scene_, state_, {tip, tip + d}, 1e-3);
  }

 private:
  rendering::Scene scene_;
  rendering::RenderState state_;
};

TEST(LeftSideways, AFlushStylusThatHasLeftIsFree) {
  // Along x, in the plane of the side at y = kHalf; comes down with its tip off the cube, is drawn
  // over it and then away from it.
  const Vec3 d(0.12, 0, 0);
  for (const double deep : {0.001, 0.002, 0.004}) {
    BesideACube bench;
    bench.tick({-0.031, kHalf, kHalf}, d);
    bench.tick({-0.031, kHalf, kHalf - deep}, d);
    for (const double x : {-0.03, -0.029}) bench.tick({x, kHalf, kHalf - deep}, d);
    const rendering::Rendering r = bench.tick({-0.029, kHalf + 0.001, kHalf - deep}, d);
    EXPECT_EQ(r.contacts, 0) << deep << ": " << r.deepest.depth;
    EXPECT_EQ(r.force, Vec3());
  }
}

TEST(LeftSideways, AJumpFarAwayIsFree) {
  for (const Vec3& d :
       {Vec3(0.12, 0, 0), Vec3(0, 0.12, 0), Vec3(0, 0, 0.12), Vec3(0.12, 0.12, 0)}) {
    for (const Vec3& to : {Vec3(5, 7, -3), Vec3(-3e4, 1e4, 2e4), Vec3(0.04, -0.1, 0.02)}) {
      BesideACube bench;
      bench.tick(Vec3(0, 0, 1) - 0.5 * d, d);
      bench.tick(Vec3(0.001, 0.002, 0.025) - 0.5 * d, d);
      const rendering::Rendering r = bench.tick(to, d);
      // Straight below the facet that held it, it is held; nowhere else.
      if (r.contacts > 0) {
        EXPECT_LT(std::abs(r.deepest.point.x), kHalf + 1e-9);
        EXPECT_LT(std::abs(r.deepest.point.y), kHalf + 1e-9);
        EXPECT_LT(std::abs(r.deepest.point.z), kHalf + 1e-9);
      }
    }
  }
}

}  // namespace
}  // namespace palpate
