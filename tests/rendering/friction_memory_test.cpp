// Friction remembers a contact while it lasts and forgets it when it ends, in every kind of scene.

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <memory>
#include <string>
#include <vector>

#include "rendering/renderer.h"
#include "rendering/scene.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/primitives.h"

namespace palpate::rendering {
namespace {
namespace friction_memory {

constexpr double kTick = 1e-3, kTop = 0.02;  // s; m, of every part

SceneObject block(const Vec3& middle, int object) {
  SceneObject part;
  part.mesh = std::make_shared<const stimuli::ConvexMesh>(stimuli::box({0.06, 0.06, 0.04}));
  part.pose.position = middle;
  part.object = object;
  part.material.stiffness = 800;
  part.material.friction_static = 0.6;
  part.material.friction_dynamic = 0.4;
  return part;
}

struct Place {
  std::string name;
  std::vector<SceneObject> parts;
  Vec3 over;  ///< m, where the tip goes down
};

/// One part alone; a part beside a compound; on a compound, away from its seam.
std::vector<Place> places() {
  const SceneObject alone = block({0, 0, 0}, 1);
  const std::vector<SceneObject> both{block({0.2, 0, 0}, 0), block({0.25, 0, 0}, 0), alone};
  return {{"alone", {alone}, {0, 0, 0}},
          {"beside a compound", both, {0, 0, 0}},
          {"on a compound", both, {0.185, 0, 0}}};
}

std::vector<Tool> tools() {
  return {{}, {{{Vec3(0), Vec3(0, 0, 0.05)}, {Vec3(0, 0, 0.05), Vec3(0.01, 0, 0.1)}}}};
}

/// Straight up from the tip.
LineProbe upright(const Vec3& tip) { return {tip, tip + Vec3(0, 0, 0.12)}; }

class Hand {
 public:
  Hand(const Scene& scene, const Renderer& renderer, const Vec3& tip)
      : scene_(scene), renderer_(renderer), state_(scene.initial_state()), tip_(tip) {
    move_to(tip_, 1);
  }
  /// \return the rendering at the end
  Rendering move_to(const Vec3& to, int ticks) {
    Rendering felt;
    const Vec3 from = tip_;
    for (int i = 1; i <= ticks; ++i) {
      tip_ = from + static_cast<double>(i) / ticks * (to - from);
      felt = renderer_.tick(scene_, state_, upright(tip_), kTick);
    }
    return felt;
  }

 private:
  const Scene& scene_;
  const Renderer& renderer_;
  RenderState state_;
  Vec3 tip_;
};

TEST(FrictionMemory, TipComingDownAgainIsPushedStraightUp) {
  for (const Place& place : places()) {
    for (const Tool& tool : tools()) {
      for (const Renderer* renderer : {&point_renderer(), &ray_renderer()}) {
        const Scene scene(place.parts, renderer->side_contact(), tool);
        const Vec3 above = place.over + Vec3(0, 0, kTop + 0.01),
                   in = place.over + Vec3(0, 0, kTop - 2e-3);
        const std::string what = place.name + ", " + renderer->name() + ", segments " +
                                 std::to_string(tool.segments.size());
        Hand hand(scene, *renderer, above);
        Rendering felt = hand.move_to(in, 24);
        EXPECT_NEAR(felt.force.z, 1.6, 1e-9) << what;
        EXPECT_NEAR(std::hypot(felt.force.x, felt.force.y), 0, 1e-9) << what;
        // Moved aside within the friction cone: a spring holds it back.
        felt = hand.move_to(in + Vec3(5e-4, 3e-4, 0), 10);
        EXPECT_NEAR(felt.force.x, -800 * 5e-4, 1e-9) << what;
        EXPECT_NEAR(felt.force.y, -800 * 3e-4, 1e-9) << what;
        // Moved far aside: it slides, with the dynamic coefficient, against the motion.
        felt = hand.move_to(in + Vec3(5e-3, 3e-4, 0), 90);
        EXPECT_NEAR(std::hypot(felt.force.x, felt.force.y), 0.4 * 1.6, 1e-6) << what;
        EXPECT_LT(felt.force.x, 0) << what;
        felt = hand.move_to(in + Vec3(5e-3, 3e-4, 0.01), 20);
        EXPECT_EQ(felt.contacts, 0) << what;
        // Down elsewhere, and at the same place once more.
        for (const Vec3& aside : {Vec3(-5e-3, -4e-3, 0), Vec3(5e-3, 3e-4, 0)}) {
          hand.move_to(above + aside, 40);
          felt = hand.move_to(in + aside, 24);
          EXPECT_NEAR(felt.force.z, 1.6, 1e-9) << what;
          EXPECT_NEAR(std::hypot(felt.force.x, felt.force.y), 0, 1e-9) << what;
          hand.move_to(above + aside, 24);
        }
      }
    }
  }
}

TEST(FrictionMemory, AContactOfOneTickIsForgottenToo) {
  for (const Place& place : places()) {
    for (const Renderer* renderer : {&point_renderer(), &ray_renderer()}) {
      const Scene scene(place.parts, renderer->side_contact(), {});
      const Vec3 above = place.over + Vec3(0, 0, kTop + 1e-3),
                 in = place.over + Vec3(0, 0, kTop - 1e-3);
      Hand hand(scene, *renderer, above);
      hand.move_to(in, 1);
      hand.move_to(in + Vec3(4e-4, 0, 0), 1);
      EXPECT_EQ(hand.move_to(above + Vec3(4e-4, 0, 0), 1).contacts, 0) << place.name;
      const Rendering felt = hand.move_to(in + Vec3(4e-4, 0, 0), 1);
      EXPECT_NEAR(std::hypot(felt.force.x, felt.force.y), 0, 1e-9) << place.name;
      EXPECT_NEAR(felt.force.z, 0.8, 1e-9) << place.name;
    }
  }
}

}  // namespace friction_memory
}  // namespace
}  // namespace palpate::rendering
