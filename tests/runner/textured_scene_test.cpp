// Textures, fields and knocks of objects, built like scene files.

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <glm/geometric.hpp>
#include <string>
#include <vector>

#include "protocols/parse.h"
#include "protocols/protocol.h"
#include "runner/scene_builder.h"
#include "runner/servo/field_demand.h"
#include "runner/session/device_check.h"
#include "runner/session/effect_check.h"
#include "stimuli/polygon_soup.h"
#include "stimuli/texture.h"
#include "tests/shared/temporary_folder.h"

namespace palpate::runner {
namespace {

constexpr double kPeriod = 1e-3;  // s
constexpr double kLength = 0.12;  // m, of the stylus

stimuli::TextureSpec sine(double depth = 0.0003) {
  stimuli::TextureSpec out;
  out.period = 0.002;
  out.depth = depth;
  return out;
}

stimuli::ObjectSpec box(const Vec3& size, const Vec3& at = Vec3(0)) {
  stimuli::ObjectSpec out;
  out.shape = stimuli::ShapeKind::box;
  out.size = size;
  out.pose.position = at;
  return out;
}

stimuli::ObjectSpec compound(std::vector<stimuli::ObjectSpec> parts) {
  stimuli::ObjectSpec out;
  out.shape = stimuli::ShapeKind::compound;
  out.parts = std::move(parts);
  return out;
}

/// The forces of a stroke over z = 0.01, from x = -0.02 to 0.02, upright.
std::vector<rendering::Rendering> stroke(const stimuli::ObjectSpec& object, bool ray,
                                         double depth = 0.0008) {
  SceneBuilder builder;
  const rendering::Scene scene = builder.build({object}, ray);
  const rendering::Renderer& renderer =
      ray ? rendering::ray_renderer() : rendering::point_renderer();
  rendering::RenderState state = scene.initial_state();
  std::vector<rendering::Rendering> out;
  for (int i = 0; i < 2000; ++i) {
    const double down = std::min(1.0, i / 100.0);
    const Vec3 tip(-0.02 + 0.00002 * i, 0.001, 0.012 - down * (0.002 + depth));
    out.push_back(renderer.tick(scene, state, {tip, tip + Vec3(0, 0, kLength)}, kPeriod));
  }
  return out;
}

bool same_bits(const std::vector<rendering::Rendering>& a,
               const std::vector<rendering::Rendering>& b) {
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (a[i].force != b[i].force || a[i].torque != b[i].torque || a[i].device2 != b[i].device2 ||
        a[i].ideal.tip != b[i].ideal.tip || a[i].contacts != b[i].contacts)
      return false;
  }
  return a.size() == b.size();
}

/// N, the largest difference, after the first contact.
double apart(const std::vector<rendering::Rendering>& a, const std::vector<rendering::Rendering>& b,
             std::size_t end = 2000) {
  double most = 0;
  for (std::size_t i = 150; i < end; ++i)
    most = std::max(most, glm::length(a[i].force - b[i].force));
  return most;
}

TEST(TexturedScene, NothingOfItLeavesTheBits) {
  const stimuli::ObjectSpec plain = box({0.05, 0.05, 0.02});
  stimuli::ObjectSpec empty = plain;
  empty.texture = sine(0);
  empty.transient = stimuli::TransientSpec{0, 100, 0.01};
  SceneBuilder builder;
  for (const bool ray : {false, true}) {
    EXPECT_EQ(builder.build({plain}, ray).features_index(),
              builder.build({empty}, ray).features_index());
    EXPECT_TRUE(same_bits(stroke(plain, ray), stroke(empty, ray)));
  }
  empty.texture = sine();
  EXPECT_FALSE(same_bits(stroke(plain, false), stroke(empty, false)));
}

TEST(TexturedScene, CompoundFeelsLikeTheWhole) {
  stimuli::ObjectSpec whole = box({0.08, 0.05, 0.02});
  stimuli::ObjectSpec halves =
      compound({box({0.04, 0.05, 0.02}, {-0.02, 0, 0}), box({0.04, 0.05, 0.02}, {0.02, 0, 0})});
  whole.texture = halves.texture = sine();
  for (const bool ray : {false, true})
    EXPECT_LT(apart(stroke(whole, ray), stroke(halves, ray)), 1e-4) << ray;
}

TEST(TexturedScene, TouchingObjectsKeepTheirOwn) {
  stimuli::ObjectSpec left = box({0.04, 0.05, 0.02}, {-0.02, 0, 0}),
                      right = box({0.04, 0.05, 0.02}, {0.02, 0, 0});
  left.texture = sine();
  SceneBuilder builder;
  const rendering::Scene scene = builder.build({left, right}, false);
  rendering::RenderState state = scene.initial_state();
  const auto force = [&](double x, double depth) {
    const Vec3 tip(x, 0, 0.01 - depth);
    return rendering::point_renderer()
        .tick(scene, state, {tip, tip + Vec3(0, 0, kLength)}, kPeriod)
        .force;
  };
  force(-0.019, -0.01);  // a valley of the left one, whose crests are at its middle
  EXPECT_NEAR(force(-0.019, 0.0008).z, 800 * (0.0008 - 0.0003), 1e-6);
  force(0.019, -0.01);
  EXPECT_NEAR(force(0.019, 0.0008).z, 800 * 0.0008, 1e-6);
}

/// An L of two blocks as a closed mesh: its upper face at z = 0.01 is whole.
std::string corner_mesh(const std::string& folder) {
  std::string file = folder + "/corner.obj";
  std::ofstream out(file);
  // The outline in x and z, drawn out along y: a step down at x = 0.02.
  const double outline[][2] = {{-0.04, -0.01}, {0.04, -0.01}, {0.04, 0},
                               {0.03, 0},      {0.03, 0.01},  {-0.04, 0.01}};
  for (const double y : {-0.025, 0.025}) {
    for (const auto& at : outline) out << "v " << at[0] << ' ' << y << ' ' << at[1] << '\n';
  }
  out << "f 1 2 3 4 5 6\nf 12 11 10 9 8 7\n";
  for (int i = 0; i < 6; ++i) {
    const int next = (i + 1) % 6;
    out << "f " << i + 1 << ' ' << i + 7 << ' ' << next + 7 << ' ' << next + 1 << '\n';
  }
  return file;
}

TEST(TexturedScene, ClosedMeshFeelsLikeItsParts) {
  const testing::TemporaryFolder folder;
  stimuli::ObjectSpec mesh;
  mesh.shape = stimuli::ShapeKind::mesh;
  mesh.file = corner_mesh(folder.path());
  mesh.texture = sine();
  stimuli::ObjectSpec parts = compound(
      {box({0.08, 0.05, 0.01}, {0, 0, -0.005}), box({0.07, 0.05, 0.01}, {-0.005, 0, 0.005})});
  parts.texture = mesh.texture;
  SceneBuilder builder;
  ASSERT_EQ(builder.build({mesh}, true).surfaces().size(), 1U);
  for (const bool ray : {false, true})
    EXPECT_LT(apart(stroke(mesh, ray), stroke(parts, ray)), 1e-4) << ray;
}

TEST(TexturedScene, HeavyBodyFeelsLikeAFixedOne) {
  stimuli::ObjectSpec fixed = box({0.08, 0.05, 0.02});
  fixed.texture = sine(0.0001);
  stimuli::ObjectSpec body = fixed;
  body.body.emplace();
  body.body->mass = 10000;
  for (const bool ray : {false, true})
    // It gives way by and by, and its springs are half a tick behind.
    EXPECT_LT(apart(stroke(fixed, ray), stroke(body, ray), 500), 0.01) << ray;
}

TEST(TexturedScene, TooSteepOrDeepIsRefused) {
  SceneBuilder builder;
  stimuli::ObjectSpec steep = box({0.05, 0.05, 0.02});
  steep.texture = sine(0.002);
  EXPECT_THROW(builder.build({steep}, false), stimuli::MeshError);
  stimuli::ObjectSpec thin = compound({box({0.05, 0.05, 0.0002})});
  thin.texture = sine();
  EXPECT_THROW(builder.build({thin}, false), stimuli::MeshError);
}

TEST(TexturedScene, FieldsAloneAreAScene) {
  stimuli::ObjectSpec fields;
  fields.shape = stimuli::ShapeKind::none;
  stimuli::FieldSpec constant;
  constant.force = {0, 0, 1};
  fields.fields = {constant};
  SceneBuilder builder;
  const rendering::Scene scene = builder.build({fields}, true);
  rendering::RenderState state = scene.initial_state();
  const rendering::Rendering felt =
      rendering::ray_renderer().tick(scene, state, {Vec3(0), Vec3(0, 0, kLength)}, kPeriod);
  EXPECT_EQ(felt.force, constant.force);
  EXPECT_EQ(felt.object, -1);
}

TEST(EffectCheck, ViscousNeedsTheDampingOfTheory) {
  stimuli::FieldSpec viscous;
  viscous.kind = stimuli::FieldSpec::Kind::viscous;
  viscous.damping = Mat3(1);
  // Colgate & Schenkel 1997 with a low pass of 0, 1, 2, 5 and 10 ms at 1 kHz.
  for (const auto& [low_pass, needed] : {std::pair{0.0, 1.0},
                                         {0.001, 0.333333},
                                         {0.002, 0.2},
                                         {0.005, 0.0909091},
                                         {0.01, 0.0476190}}) {
    viscous.low_pass = low_pass;
    EXPECT_NEAR(servo::demand_of({viscous}, 1000, 0).damping, needed, 1e-6);
  }
  viscous.damping = Mat3(15);
  viscous.low_pass = 0.002;
  EXPECT_NEAR(servo::demand_of({viscous}, 1000, 3e-5).noise, 0.15, 1e-12);
}

std::vector<std::string> reasons(const std::string& object) {
  const protocols::Protocol protocol = protocols::parse_protocol_text(
      R"({"version": 1, "name": "p", "renderers": ["point"], "orientation": "fixed", "repetitions": 1,
          "response": {"keys": {"1": "a"}}, "stimuli": [{"name": "a", )" +
          object + "}]}",
      "p.json");
  servo::DeviceCapabilities device;
  device.name = "some";
  device.sensed_freedom = device.actuated_freedom = 3;
  device.workspace_radius = 0.2;
  device.max_stiffness = 2000;
  device.max_rate = 1000;
  device.resolution = 6e-5;
  device.damping = 1;
  return session::incompatibilities(protocol, StimulusLibrary(protocol), device);
}

void expect_reason(const std::string& object, const char* place) {
  const std::vector<std::string> found = reasons(object);
  ASSERT_EQ(found.size(), 1U) << object;
  EXPECT_NE(found[0].find(place), std::string::npos) << found[0];
}

TEST(EffectCheck, NamesThePlaceThatADeviceCannotShow) {
  const std::string plate = R"("shape": "box", "size_m": [0.05, 0.05, 0.02], )";
  EXPECT_TRUE(
      reasons(plate + R"("texture": {"kind": "sine", "period_m": 0.002, "depth_m": 0.0001})")
          .empty());
  expect_reason(plate + R"("texture": {"kind": "sine", "period_m": 0.0002, "depth_m": 0.00001})",
                "/texture/period_m");
  expect_reason(plate + R"("contact_transient": {"frequency_hz": 300})",
                "/contact_transient/frequency_hz");
  expect_reason(
      R"("shape": "none", "fields": [{"kind": "vibration", "amplitude_n": 1, "frequency_hz": 300,
          "direction": [1, 0, 0]}])",
      "/fields/0/frequency_hz");
  expect_reason(R"("shape": "none", "fields": [{"kind": "viscous", "damping_ns_per_m": 20}])",
                "/fields");
  EXPECT_TRUE(reasons(R"("shape": "none", "fields": [{"kind": "viscous", "damping_ns_per_m": 4}])")
                  .empty());
  expect_reason(R"("shape": "none", "fields": [{"kind": "spring", "centre_m": [0, 0, 0],
          "stiffness_n_per_m": 1900}, {"kind": "spring", "centre_m": [0, 0, 0],
          "stiffness_n_per_m": 1900}])",
                "/fields");
}

TEST(EffectCheck, NotesSayWhatToExpect) {
  stimuli::ObjectSpec object = box({0.05, 0.05, 0.02});
  object.texture = sine(0.0004);
  const stimuli::Texture texture(*object.texture);
  const std::vector<std::string> notes = session::effect_notes(object, &texture, 1000);
  ASSERT_EQ(notes.size(), 2U);
  EXPECT_NE(notes[0].find("above 0.5 m/s"), std::string::npos) << notes[0];
  EXPECT_NE(notes[1].find("snaps"), std::string::npos) << notes[1];
}

}  // namespace
}  // namespace palpate::runner
