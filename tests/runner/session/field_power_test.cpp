#include "runner/session/field_power.h"

#include <gtest/gtest.h>

#include <cmath>

#include "protocols/parse.h"
#include "runner/scene_builder.h"

namespace palpate::runner::session {
namespace {

constexpr double kTick = 1e-3, kSpeed = 0.3;

rendering::Scene scene_of(const std::string& fields) {
  const protocols::Protocol protocol = protocols::parse_protocol_text(
      R"({"version": 2, "name": "p", "renderers": ["point"], "seed": 1, "stimuli": [
        {"name": "a", "shape": "none", "fields": )" +
          fields +
          R"(}], "blocks": [{"task": "detect", "name": "b", "stimuli": ["a"], "repetitions": 1}]})",
      "p.json");
  return SceneBuilder().build({protocol.stimuli[0].object}, false);
}

/// Goes round a circle about z for 4 s. \param turn  rad/s
FieldPower round(const rendering::Scene& scene, double turn, bool side_contact = false) {
  FieldPower power;
  power.begin(scene, side_contact);
  const double radius = kSpeed / std::abs(turn);
  servo::Sample sample;
  for (int i = 0; i < 4000; ++i) {
    sample.period_ns = i == 0 ? 0 : 1'000'000;
    sample.probe.tip = radius * Vec3(std::cos(turn * i * kTick), std::sin(turn * i * kTick), 0);
    sample.probe.tail = sample.probe.tip + Vec3(0, 0, 0.15);
    power.add(sample);
  }
  return power;
}

TEST(FieldPower, CurlOnACircleIsTheClosedForm) {
  const rendering::Scene scene = scene_of(
      R"([{"kind": "curl", "axis": [0, 0, 1], "damping_ns_per_m": 15, "low_pass_s": 0.01,
           "destabilising": true}])");
  for (const double turn : {6.0, -6.0}) {
    const FieldPower power = round(scene, turn);
    ASSERT_TRUE(power.measures());
    EXPECT_NEAR(power.watts(), rendering::curl_power(15, kSpeed, turn, kTick, 0.01), 1e-6);
    EXPECT_NEAR(round(scene, turn, true).watts(), power.watts(), 1e-9);  // the tail moves alike
  }
}

TEST(FieldPower, ViscousTakesTheSquareOfTheSpeed) {
  const rendering::Scene scene =
      scene_of(R"([{"kind": "viscous", "damping_ns_per_m": 2, "low_pass_s": 0}])");
  EXPECT_NEAR(round(scene, 6).watts(), -2 * kSpeed * kSpeed, 1e-3);
}

TEST(FieldPower, OtherFieldsAreNotMeasured) {
  const rendering::Scene scene = scene_of(R"([{"kind": "constant", "force_n": [1, 0, 0]}])");
  const FieldPower power = round(scene, 6);
  EXPECT_FALSE(power.measures());
  EXPECT_EQ(power.watts(), 0);
}

}  // namespace
}  // namespace palpate::runner::session
