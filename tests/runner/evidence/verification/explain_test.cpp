// explain() follows the compiled scene: each feature changes only its own line.

#include "runner/evidence/verification/explain.h"

#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "stimuli/convex_mesh.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/primitives.h"

namespace palpate::runner::evidence {
namespace {

rendering::SceneObject sphere(int subdivisions, int object = 0, const Vec3& position = Vec3(0)) {
  rendering::SceneObject made;
  made.mesh = std::make_shared<const stimuli::ConvexMesh>(stimuli::icosphere(0.03, subdivisions));
  made.pose.position = position;
  made.object = object;
  return made;
}

rendering::Scene scene_of(std::vector<rendering::SceneObject> objects,
                          const rendering::Renderer& renderer) {
  return rendering::Scene(std::move(objects), renderer.side_contact());
}

/// Without counts, which follow every change of the scene.
std::string without_digits(std::string text) {
  std::erase_if(text, [](char c) { return c >= '0' && c <= '9'; });
  return text;
}

using Names = std::vector<std::string>;

/// The names of the lines that differ between two scenes.
Names changed(const std::vector<TickStage>& a, const std::vector<TickStage>& b) {
  Names names;
  EXPECT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_EQ(a[i].name, b[i].name);
    EXPECT_FALSE(a[i].why.empty());
    const bool same_text = without_digits(a[i].why) == without_digits(b[i].why);
    EXPECT_TRUE(same_text || a[i].runs != b[i].runs) << a[i].name << ": " << b[i].why;
    if (!same_text || a[i].runs != b[i].runs) names.push_back(a[i].name);
  }
  return names;
}

Names changed_by_mesh(const stimuli::PolygonSoup& from, const stimuli::PolygonSoup& to,
                      const rendering::Renderer& renderer) {
  const auto lines = [&](const stimuli::PolygonSoup& soup) {
    rendering::SceneObject object;
    object.mesh = std::make_shared<const stimuli::ConvexMesh>(soup);
    return explain(scene_of({object}, renderer), renderer);
  };
  return changed(lines(from), lines(to));
}

Names changed_by_material(const stimuli::Material& material, const rendering::Renderer& renderer) {
  rendering::SceneObject plain = sphere(1), other = plain;
  other.material = material;
  return changed(explain(scene_of({plain}, renderer), renderer),
                 explain(scene_of({other}, renderer), renderer));
}

class Explain : public ::testing::TestWithParam<const rendering::Renderer*> {};

TEST_P(Explain, EachMaterialPropertyIsALineOfItsOwn) {
  const rendering::Renderer& renderer = *GetParam();
  stimuli::Material damped, rough, soft;
  damped.damping = 2;
  rough.friction_static = rough.friction_dynamic = 0.4;
  soft.stiffness = 100;
  EXPECT_EQ(changed_by_material(damped, renderer), Names{"damping"});
  EXPECT_EQ(changed_by_material(rough, renderer), Names{"friction"});
  EXPECT_EQ(changed_by_material(soft, renderer), Names{});
}

TEST_P(Explain, SeveralPartsAndCompoundsAndFarObjects) {
  const rendering::Renderer& renderer = *GetParam();
  const rendering::SceneObject here = sphere(1);
  const auto with = [&](int object, double x) {
    rendering::SceneObject there = here;
    there.object = object;
    there.pose.position.x = x;
    return explain(scene_of({here, there}, renderer), renderer);
  };
  const auto one = explain(scene_of({here}, renderer), renderer);
  EXPECT_EQ(changed(one, with(1, 0.05)), Names{"several parts"});
  EXPECT_EQ(changed(with(1, 0.05), with(0, 0.05)), Names{"unions and tools"});
  const auto near = with(1, 0.05), far = with(1, 5);
  ASSERT_EQ(near.size(), far.size());
  for (std::size_t i = 0; i < near.size(); ++i) {
    EXPECT_EQ(near[i].runs, far[i].runs);
    EXPECT_EQ(near[i].why == far[i].why, near[i].name != "objects out of reach") << far[i].why;
  }
}

TEST_P(Explain, TreesFollowTheMesh) {
  const rendering::Renderer& renderer = *GetParam();
  const bool sides = renderer.side_contact();
  // 22 facets and 60 edges; 32 and 90; 72 and 210.
  const stimuli::PolygonSoup few = stimuli::cylinder(0.03, 0.06, 20),
                             some = stimuli::cylinder(0.03, 0.06, 30),
                             many = stimuli::cylinder(0.03, 0.06, 70);
  EXPECT_EQ(changed_by_mesh(few, some, renderer), sides ? Names{"tree of edges"} : Names{});
  EXPECT_EQ(changed_by_mesh(some, many, renderer), Names{"tree of polygons"});
  EXPECT_EQ(changed_by_mesh(stimuli::icosphere(0.03, 3), stimuli::icosphere(0.03, 4), renderer),
            (Names{"support map", "facet map"}));
}

TEST(ExplainRenderers, ThePointLeavesOutStagesOfTheSide) {
  const rendering::SceneObject object = sphere(1);
  const rendering::Scene with_sides({object}, true), without({object}, false);
  EXPECT_EQ(changed(explain(with_sides, rendering::ray_renderer()),
                    explain(without, rendering::point_renderer())),
            (Names{"tree of edges", "side contact", "torque and second device"}));
  // It reports what was built, not what should have been built.
  EXPECT_EQ(changed(explain(with_sides, rendering::point_renderer()),
                    explain(without, rendering::point_renderer())),
            Names{"tree of edges"});
}

TEST_P(Explain, RunningStagesAreTimedAndOthersAreNot) {
  const rendering::Renderer& renderer = *GetParam();
  rendering::SceneObject object = sphere(2), other = sphere(1, 1, {0.2, 0, 0});
  for (const bool all : {false, true}) {
    if (all) {
      object.material.damping = 2;
      object.material.friction_static = object.material.friction_dynamic = 0.3;
    }
    const rendering::Scene scene =
        all ? scene_of({object, other}, renderer) : scene_of({object}, renderer);
    std::map<std::string, bool> runs{{kTickInContact, true}, {kTickInFreeSpace, true}};
    for (const TickStage& stage : explain(scene, renderer)) {
      if (stage.time != StageTime::once) runs[stage.name] = stage.runs;
    }
    std::size_t timed = 0;
    for (const StageTiming& timing : stage_timings(scene, renderer)) {
      ++timed;
      EXPECT_TRUE(runs[timing.name]) << timing.name;
      EXPECT_GT(timing.calls, 0u) << timing.name;
      timing.prepare();
      const double first = timing.run();
      timing.prepare();
      EXPECT_EQ(first, timing.run()) << timing.name;
      EXPECT_TRUE(std::isfinite(first)) << timing.name;
    }
    std::size_t expected = 0;
    for (const auto& [name, run] : runs) expected += run ? 1 : 0;
    EXPECT_EQ(timed, expected);
  }
}

TEST_P(Explain, AnEmptySceneHasNothingToTime) {
  const rendering::Scene scene({}, GetParam()->side_contact());
  EXPECT_TRUE(stage_timings(scene, *GetParam()).empty());
  EXPECT_FALSE(explain(scene, *GetParam()).empty());
}

INSTANTIATE_TEST_SUITE_P(Renderers, Explain,
                         ::testing::Values(&rendering::point_renderer(),
                                           &rendering::ray_renderer()),
                         [](const auto& tested) { return std::string(tested.param->name()); });

}  // namespace
}  // namespace palpate::runner::evidence
