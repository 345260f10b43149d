// The keys texture, fields and contact_transient of objects: values, bounds, levels.

#include "protocols/parse_effects.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <glm/geometric.hpp>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "protocols/parse.h"
#include "protocols/tasks/levels.h"
#include "tests/protocols/parsed_faults.h"

namespace palpate::protocols {
namespace {

using nlohmann::json;
using Kind = stimuli::TextureSpec::Kind;
using FieldKind = stimuli::FieldSpec::Kind;

const std::string kGood = PALPATE_SOURCE_DIR "/tests/protocols/good/";

SceneSpec textures() { return parse_scene(kGood + "scene-textures.json"); }

TEST(ParseEffects, ReadsEveryKeyOfATexture) {
  const SceneSpec scene = textures();
  const stimuli::TextureSpec& sine = *scene.objects[0].texture;
  EXPECT_EQ(sine.kind, Kind::sine);
  EXPECT_EQ(sine.period, 0.002);
  EXPECT_EQ(sine.depth, 0.0003);
  EXPECT_NEAR(glm::length(sine.direction - Vec3(1, 2, 0) / std::sqrt(5.0)), 0, 1e-15);
  EXPECT_EQ(sine.phase, 90);
  EXPECT_EQ(sine.tip_radius, 0.0005);
  const stimuli::TextureSpec& trapezoid = *scene.objects[1].texture;
  EXPECT_EQ(trapezoid.ridge, 0.0005);
  EXPECT_EQ(trapezoid.ramp, 0.0003);
  EXPECT_TRUE(scene.objects[2].texture->around);
  const stimuli::TextureSpec& cones = *scene.objects[3].texture;
  EXPECT_EQ(cones.jitter, 0.4);
  EXPECT_EQ(cones.seed, 3U);
  const stimuli::TextureSpec& noise = *scene.objects[4].texture;
  EXPECT_EQ(noise.exponent, 1.5);
  EXPECT_EQ(noise.longest, 0.02);
  ASSERT_NE(scene.objects[5].texture->file_bytes, nullptr);
  EXPECT_EQ(scene.objects[5].texture->file_name, "dot.png");
  EXPECT_FALSE(scene.objects[6].parts[0].texture);
}

TEST(ParseEffects, ReadsEveryKeyOfAField) {
  const std::vector<stimuli::FieldSpec> fields = textures().objects[7].fields;
  ASSERT_EQ(fields.size(), 8U);
  EXPECT_EQ(fields[0].force, Vec3(0, 0, -0.5));
  EXPECT_TRUE(fields[0].at_grip);
  EXPECT_EQ(fields[1].radius, 0.01);
  EXPECT_EQ(fields[1].stiffness, 50);
  EXPECT_EQ(fields[2].to, Vec3(0, 0.1, 0));
  EXPECT_EQ(fields[2].radius, 0.001);
  EXPECT_EQ(fields[3].damping, Mat3(5));
  EXPECT_EQ(fields[3].low_pass, 0.005);
  // Rows as they are written: the force is -B v.
  EXPECT_EQ(fields[4].damping * Vec3(0, 1, 0), Vec3(10, 0, 0));
  EXPECT_TRUE(fields[5].destabilising);
  EXPECT_EQ(fields[6].axis, Vec3(0, 0, 1));
  EXPECT_EQ(fields[6].low_pass, 0.002);
  EXPECT_EQ(fields[7].frequency, 60);
  EXPECT_TRUE(fields[7].always);
}

TEST(ParseEffects, ReadsTheKnock) {
  const stimuli::TransientSpec& knock = *textures().objects[6].transient;
  EXPECT_EQ(knock.amplitude, 5);
  EXPECT_EQ(knock.frequency, 80);
  EXPECT_EQ(knock.decay, 0.02);
}

json box_with(const char* key, const json& value) {
  return {{"objects", {{{"shape", "box"}, {"size_m", {0.05, 0.05, 0.02}}, {key, value}}}}};
}

std::vector<std::string> places(const json& scene) {
  std::vector<std::string> out;
  for (const Fault& fault : faults_when([&] { parse_scene_text(scene.dump(), "s.json"); }))
    out.push_back(fault.location);
  return out;
}

/// Holds each number's documented bounds against the parser.
void expect_bounds(const char* key, const json& good, const json& schema,
                   const std::string& place) {
  for (const auto& [name, entry] : schema.items()) {
    for (const char* word : {"minimum", "maximum", "exclusiveMinimum"}) {
      if (!entry.contains(word) || entry.value("type", "") != "number") continue;
      const double bound = entry[word], far = word[1] == 'a' ? HUGE_VAL : -HUGE_VAL;
      json beyond = good, scene;
      json& object = beyond.is_array() ? beyond[0] : beyond;
      object[name] = word[0] == 'e' ? bound : std::nextafter(bound, far);
      EXPECT_EQ(places(box_with(key, beyond)), std::vector{place + name}) << name << ' ' << word;
    }
  }
}

TEST(ParseEffects, BoundsEqualSchema) {
  std::ifstream stream(PALPATE_SOURCE_DIR "/protocols/scene.schema.json");
  const json all = json::parse(stream)["$defs"];
  const json sine = {{"kind", "sine"}, {"period_m", 0.002}, {"depth_m", 0.0001}};
  json numbers = all["texture"]["properties"];
  for (const char* key : {"ridge_m", "ramp_m", "jitter", "exponent", "longest_m"})
    numbers.erase(key);
  expect_bounds("texture", sine, numbers, "/objects/0/texture/");
  json cones = sine, noise = sine;
  cones["kind"] = "cones";
  cones["ramp_m"] = 0.0005;
  noise["kind"] = "noise";
  const json& keys = all["texture"]["properties"];
  expect_bounds(
      "texture", cones,
      {{"ridge_m", keys["ridge_m"]}, {"ramp_m", keys["ramp_m"]}, {"jitter", keys["jitter"]}},
      "/objects/0/texture/");
  expect_bounds("texture", noise,
                {{"exponent", keys["exponent"]}, {"longest_m", keys["longest_m"]}},
                "/objects/0/texture/");
  expect_bounds("contact_transient", json::object(), all["contact_transient"]["properties"],
                "/objects/0/contact_transient/");
  const json vibration = {
      {{"kind", "vibration"}, {"amplitude_n", 1}, {"frequency_hz", 50}, {"direction", {1, 0, 0}}}};
  const json spring = {{{"kind", "spring"}, {"centre_m", {0, 0, 0}}, {"stiffness_n_per_m", 1}}};
  int held = 0;
  for (const json& branch : all["fields"]["items"]["allOf"]) {
    const std::string kind = branch["if"]["properties"]["kind"]["const"];
    const json* const good = kind == "vibration" ? &vibration
                             : kind == "spring"  ? &spring
                                                 : nullptr;
    if (good == nullptr) continue;
    ++held;
    expect_bounds("fields", *good, branch["then"]["properties"], "/objects/0/fields/0/");
  }
  EXPECT_EQ(held, 2);
}

TEST(ParseEffects, EveryNumberIsALevel) {
  const std::string text =
      R"({"version": 2, "name": "p", "renderers": ["point"], "orientation": "fixed",
    "stimuli": [{"name": "a", "shape": "box", "size_m": [0.05, 0.05, 0.02],
      "texture": {"kind": "trapezoid", "period_m": 0.003, "depth_m": 0.0002, "ramp_m": 0.0004, "direction": [1, 0, 0]},
      "fields": [{"kind": "curl", "damping_ns_per_m": 3, "axis": [0, 0, 1]}],
      "contact_transient": {"frequency_hz": 90}}],
    "blocks": [{"name": "b", "task": "rate", "question": "?", "stimuli": ["a"],
      "level": {"path": "PATH"}, "procedure": {"kind": "constant", "levels": [LEVELS], "repetitions": 1}}]})";
  const auto at = [&](const std::string& path, const std::string& level) {
    std::string own = text;
    own.replace(own.find("PATH"), 4, path);
    own.replace(own.find("LEVELS"), 6, level);
    const Protocol protocol = parse_protocol_text(own, "p.json");
    return with_all_levels(protocol).stimuli.at(1).object;
  };
  EXPECT_EQ(at("/texture/period_m", "0.004").texture->period, 0.004);
  EXPECT_EQ(at("/texture/phase_deg", "45").texture->phase, 45);
  EXPECT_EQ(at("/texture/direction/1", "1").texture->direction, glm::normalize(Vec3(1, 1, 0)));
  EXPECT_EQ(at("/fields/0/damping_ns_per_m", "7").fields[0].damping, Mat3(7));
  EXPECT_EQ(at("/contact_transient/frequency_hz", "120").transient->frequency, 120);
  EXPECT_EQ(at("/contact_transient/decay_s", "0.02").transient->decay, 0.02);
}

TEST(ParseEffects, NamesUnitsOfLevels) {
  EXPECT_EQ(unit_of_level("/texture/period_m"), "m");
  EXPECT_EQ(unit_of_level("/texture/phase_deg"), "deg");
  EXPECT_EQ(unit_of_level("/contact_transient/frequency_hz"), "Hz");
  EXPECT_EQ(unit_of_level("/contact_transient/amplitude_ns_per_m"), "N s/m");
  EXPECT_EQ(unit_of_level("/body/damping_per_s"), "1/s");
}

}  // namespace
}  // namespace palpate::protocols
