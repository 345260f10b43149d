// Every extreme case, with both renderers; a broken renderer fails it.

#include "runner/evidence/verification/extreme_cases.h"

#include <gtest/gtest.h>

#include <string>

namespace palpate::runner::evidence {
namespace {

class Extreme : public ::testing::TestWithParam<ExtremeCase> {};

TEST_P(Extreme, WithThePoint) {
  const ExtremeResult result = GetParam().run(rendering::point_renderer());
  EXPECT_TRUE(result.passed) << result.detail;
  EXPECT_LE(result.worst, result.limit);
  EXPECT_GT(result.in_contact, 20u);
}

TEST_P(Extreme, WithTheRay) {
  const ExtremeResult result = GetParam().run(rendering::ray_renderer());
  EXPECT_TRUE(result.passed) << result.detail;
  EXPECT_LE(result.worst, result.limit);
  EXPECT_GT(result.in_contact, 20u);
}

/// Drops every seventh contact, and gives force before the probe has left and at invalid poses.
class ContactDropper final : public rendering::Renderer {
 public:
  const char* name() const override { return "drops contacts"; }
  bool side_contact() const override { return true; }
  rendering::Rendering tick(const rendering::Scene& scene, rendering::RenderState& state,
                            const rendering::LineProbe& probe, double dt) const noexcept override {
    const bool began_inside = state.parts[0].started_inside;
    rendering::Rendering r = rendering::ray_renderer().tick(scene, state, probe, dt);
    if (began_inside || (r.faults & rendering::render_fault::kNonFinite)) {
      r.force = Vec3(0, 0, 1);
      return r;
    }
    if (r.contacts == 0 || ++count_ % 7 != 0) return r;
    r = rendering::Rendering{};
    r.ideal = probe;
    return r;
  }

 private:
  mutable int count_ = 0;
};

TEST_P(Extreme, FailsWhenRendererDropsContacts) {
  // Skip the million triangles: they take long and add nothing here.
  if (GetParam().name == std::string("million-triangles")) return;
  const ExtremeResult result = GetParam().run(ContactDropper());
  EXPECT_FALSE(result.passed);
  EXPECT_NE(result.detail, "");
}

INSTANTIATE_TEST_SUITE_P(All, Extreme, ::testing::ValuesIn(extreme_cases()),
                         [](const auto& parameter) {
                           std::string name = parameter.param.name;
                           for (char& c : name) {
                             if (c == '-') c = '_';
                           }
                           return name;
                         });

}  // namespace
}  // namespace palpate::runner::evidence
