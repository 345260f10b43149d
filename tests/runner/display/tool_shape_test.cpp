// The console draws the tool that is rendered.

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

#include "rendering/tool.h"
#include "runner/display/scene/scene_drawing.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/primitives.h"

namespace palpate::runner::display {
namespace {

const rendering::Tool kHook{{{{0, 0, 0}, {0, 0, 0.12}}, {{-0.01, 0, 0}, {0.03, 0, 0.01}}}};

void expect_near(const Vec3& a, const Vec3& b) { EXPECT_LE(glm::distance(a, b), 1e-12); }

TEST(ToolShape, WithoutAToolIsTheStylus) {
  servo::Sample sample;
  sample.probe = {{0, 0, 0.1}, {0, 0.12, 0.1}};
  const DrawnTool drawn = tool_in_hand({}, sample);
  ASSERT_EQ(drawn.segments.size(), 1u);
  EXPECT_EQ(drawn.segments[0].tip, sample.probe.tip);
  EXPECT_EQ(drawn.segments[0].tail, sample.probe.tail);
}

TEST(ToolShape, BeforeATrialHasTheInitialRollOfATrial) {
  servo::Sample sample;
  sample.probe = {{0.01, 0, 0.1}, {0.01, 0.12, 0.1}};
  const DrawnTool drawn = tool_in_hand(kHook, sample);
  const Mat3 frame = rendering::tool_frame(sample.probe.tail - sample.probe.tip, nullptr, Vec3(0));
  ASSERT_EQ(drawn.segments.size(), 2u);
  expect_near(drawn.segments[1].tip, sample.probe.tip + frame * kHook.segments[1].from);
  expect_near(drawn.segments[1].tail, sample.probe.tip + frame * kHook.segments[1].to);
}

TEST(ToolShape, IdealToolRestsOnTheObject) {
  rendering::SceneObject cube;
  cube.mesh = std::make_shared<const stimuli::ConvexMesh>(stimuli::cube(0.06));
  const rendering::Scene scene({cube}, true, kHook);
  rendering::RenderState state = scene.initial_state();
  servo::Sample sample;
  for (int i = 0; i < 600; ++i) {  // down onto the cube's upper face, rolled by a quarter turn
    const double height = 0.06 - 6e-5 * i;
    sample.probe = {{0, 0, height}, {0, 0, height + 0.12}};
    state.measured_side = Vec3(0, 1, 0);
    sample.rendering = rendering::ray_renderer().tick(scene, state, sample.probe, 1e-3);
    const DrawnTool ideal = ideal_tool(kHook, sample), hand = tool_in_hand(kHook, sample);
    for (const rendering::LineProbe& segment : ideal.segments) {
      for (const Vec3& end : {segment.tip, segment.tail}) EXPECT_GE(end.z, 0.03 - 1e-6);
    }
    for (std::size_t k = 0; k < hand.segments.size(); ++k) {
      expect_near(hand.segments[k].tail - hand.segments[k].tip,
                  ideal.segments[k].tail - ideal.segments[k].tip);
      EXPECT_NEAR(hand.segments[k].tip.x, 0, 1e-12) << "its +x is the world's +y";
    }
  }
  EXPECT_GT(sample.rendering.contacts, 0);
  EXPECT_LT(tool_in_hand(kHook, sample).segments[0].tip.z, 0.03);
}

}  // namespace
}  // namespace palpate::runner::display
