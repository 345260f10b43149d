// A tip came down on a cube and in one tick stood exactly on its top: nothing separates strictly,
// nothing is crossed. The way out was then looked for from any facet, and a side was found, 30 mm
// away: the hand would have been pushed sideways with all its force.

#include <gtest/gtest.h>

#include <memory>

#include "rendering/renderer.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/primitives.h"

namespace palpate {
namespace {

TEST(TouchingExactly, IsNoContactAndNextTickIsTop) {
  const auto mesh = std::make_shared<const stimuli::ConvexMesh>(stimuli::cube(0.06));
  for (const rendering::Renderer* renderer :
       {&rendering::point_renderer(), &rendering::ray_renderer()}) {
    const rendering::Scene scene({{mesh, Pose{}, stimuli::Material{}, 0, nullptr}},
                                 renderer->side_contact());
    for (const double shift : {0.0, 0.01, -0.0299}) {
      rendering::RenderState state = scene.initial_state();
      rendering::Rendering rendering;
      for (const double z : {0.1, 0.0301, 0.03, 0.03, 0.0299}) {
        rendering = renderer->tick(scene, state, {{shift, 0, z}, {shift, 0, z + 0.12}}, 1e-3);
        EXPECT_NEAR(rendering.force.x, 0, 1e-12);
        EXPECT_NEAR(rendering.force.y, 0, 1e-12);
        EXPECT_NEAR(rendering.force.z, 800 * (z < 0.03 ? 0.03 - z : 0), 1e-9);
      }
      EXPECT_EQ(rendering.contacts, 1);
    }
  }
}

}  // namespace
}  // namespace palpate
