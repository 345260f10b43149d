// Estimates of a level from exploration, against closed forms: the surface that passes through the
// felt places.

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <string>
#include <vector>

#include "protocols/parse.h"
#include "runner/participants/task_participant.h"

namespace palpate::runner::participants {
namespace {
namespace felt_levels {

/// Of one block that compares the first stimulus. \param stimuli  JSON objects without names
protocols::Protocol study(const std::vector<std::string>& stimuli, const std::string& path,
                          const std::string& levels) {
  std::string text = R"({"version": 2, "name": "l", "renderers": ["ray"], "stimuli": [)";
  for (std::size_t i = 0; i < stimuli.size(); ++i)
    text += (i > 0 ? "," : "") + (R"({"name": "s)" + std::to_string(i) + "\", ") + stimuli[i] + "}";
  text += R"(], "blocks": [{"name": "b", "task": "compare", "standard": "s0", "stimuli": ["s0"],
    "level": {"path": ")" +
          path + R"("}, "procedure": {"kind": "constant", "levels": [)" + levels +
          R"(], "repetitions": 1}}]})";
  return protocols::parse_protocol_text(text, "l.json");
}

protocols::Trial trial_of(const Quat& orientation = Quat(1, 0, 0, 0)) {
  protocols::Trial trial;
  trial.task_block = 0;
  trial.orientation = orientation;
  return trial;
}

protocols::Interval at(double level) { return {0, {}, level, false}; }

Percept touch(const Vec3& place) {
  Percept percept;
  percept.contact = true;
  percept.tip = place;
  return percept;
}

servo::Sample pressed(const Vec3& force, double depth, int contacts = 1) {
  servo::Sample sample;
  sample.phase = servo::Phase::feeling;
  sample.rendering.force = force;
  sample.rendering.deepest.depth = depth;
  sample.rendering.contacts = contacts;
  return sample;
}

/// A direction that is not an axis.
const Vec3 kSomewhere = glm::normalize(Vec3(1, -2, 2));
const Quat kTurned = glm::angleAxis(0.7, glm::normalize(Vec3(1, 1, 3)));

TEST(LevelPercept, StiffnessIsTheMeanOfForceOverDepth) {
  const auto protocol =
      study({R"("shape": "sphere", "radius_m": 0.03)"}, "/stiffness_n_per_m", "200, 400");
  LevelPercept percept(protocol);
  percept.begin(trial_of(), at(200));
  EXPECT_FALSE(percept.stiffness());
  percept.add(pressed({0, 0, 3}, 0.01));      // 300 N/m
  percept.add(pressed({0, 0.3, 0.4}, 1e-3));  // 500 N/m
  percept.add(pressed({0, 0, 9}, 1.9e-4));    // too shallow to count
  percept.add(pressed({0, 0, 9}, 0.01, 0));   // not in contact
  ASSERT_TRUE(percept.stiffness());
  EXPECT_DOUBLE_EQ(*percept.stiffness(), 400);
  EXPECT_EQ(percept.contact_ticks(), 2);
  percept.add(touch({0.03, 0, 0}));
  EXPECT_FALSE(percept.length());
  percept.begin(trial_of(), at(200));  // nothing is left of the last interval
  EXPECT_EQ(percept.contact_ticks(), 0);
  EXPECT_FALSE(percept.stiffness());
  percept.add(pressed({0, 2, 0}, 0.01));
  EXPECT_DOUBLE_EQ(percept.stiffness().value_or(0), 200);
}

TEST(LevelPercept, RadiusFitsBallThroughFeltPlaces) {
  const auto protocol =
      study({R"("shape": "sphere", "radius_m": 0.03, "position_m": [0.01, 0, 0])"}, "/radius_m",
            "0.02, 0.04");
  LevelPercept percept(protocol);
  percept.begin(trial_of(kTurned), at(0.03));
  const Vec3 centre = kTurned * Vec3(0.01, 0, 0);
  EXPECT_FALSE(percept.length());
  percept.add(touch(centre + 0.031 * kSomewhere));
  EXPECT_NEAR(percept.length().value_or(0), 0.031, 1e-9);
  percept.add(touch(centre - 0.035 * kSomewhere));
  EXPECT_NEAR(percept.length().value_or(0), 0.033, 1e-9);  // least squares: the mean
  Percept free = touch(centre + 0.09 * kSomewhere);
  free.contact = false;
  percept.add(free);
  Percept nowhere = touch(centre + 0.09 * kSomewhere);  // a ray's contact whose place is unknown
  nowhere.ray = true;
  nowhere.tail = nowhere.tip + Vec3(0, 0, 0.1);
  percept.add(nowhere);
  EXPECT_NEAR(percept.length().value_or(0), 0.033, 1e-9);
  EXPECT_FALSE(percept.stiffness());
  percept.begin(trial_of(kTurned), at(0.03));
  EXPECT_FALSE(percept.length());
}

TEST(LevelPercept, ARaysContactIsPlacedByTorque) {
  const auto protocol =
      study({R"("shape": "sphere", "radius_m": 0.03)"}, "/radius_m", "0.02, 0.04");
  LevelPercept percept(protocol);
  percept.begin(trial_of(), at(0.03));
  Percept ray = touch({-0.05, 0, 0.032});
  ray.ray = true;
  ray.tail = ray.tip + Vec3(0.14, 0, 0);
  ray.along = 0.05;  // above the centre
  percept.add(ray);
  EXPECT_NEAR(percept.length().value_or(0), 0.032, 1e-9);
}

TEST(LevelPercept, TheStimulusAtTheLevelItselfIsKnownToo) {
  const auto protocol =
      study({R"("shape": "sphere", "radius_m": 0.03)"}, "/radius_m", "0.02, 0.04");
  LevelPercept percept(protocol);
  percept.begin(trial_of(), {0, {}, {}, true});
  percept.add(touch({0, 0.029, 0}));
  EXPECT_NEAR(percept.length().value_or(0), 0.029, 1e-9);
  percept.begin(trial_of(), {-1, {}, {}, false});  // nothing is shown
  percept.add(touch({0, 0.029, 0}));
  EXPECT_FALSE(percept.length());
}

TEST(LevelPercept, AnEdgeLengthMovesEachFaceByHalf) {
  const auto protocol =
      study({R"("shape": "box", "size_m": [0.04, 0.05, 0.06])"}, "/size_m/0", "0.03, 0.05");
  LevelPercept percept(protocol);
  percept.begin(trial_of(), at(0.04));
  percept.add(touch({0.01, 0.025, -0.02}));  // on a face that does not depend on it
  percept.add(touch({0, 0, 0.031}));
  EXPECT_FALSE(percept.length());
  percept.add(touch({0.021, 0.01, -0.02}));   // outside
  percept.add(touch({-0.018, 0.02, 0.005}));  // within
  EXPECT_NEAR(percept.length().value_or(0), 0.039, 1e-9);
  percept.begin(trial_of(), at(0.04));
  percept.add(touch({0.02 + 0.003, 0.025 + 0.004, 0}));  // past an edge: 5 mm away, at 3 in 5
  EXPECT_NEAR(percept.length().value_or(0), 0.04 + 0.005 / (0.5 * 3 / 5), 5e-5);
}

TEST(LevelPercept, ARotatedObjectIsFeltInItsPose) {
  const auto protocol = study({R"("shape": "box", "size_m": [0.04, 0.05, 0.06],
      "orientation_wxyz": [0.8, 0, 0, 0.6])"},
                              "/size_m/0", "0.03, 0.05");
  LevelPercept percept(protocol);
  percept.begin(trial_of(kTurned), at(0.04));
  const Quat place = kTurned * Quat(0.8, 0, 0, 0.6);
  percept.add(touch(place * Vec3(0.021, 0.01, -0.02)));
  EXPECT_NEAR(percept.length().value_or(0), 0.042, 1e-9);
}

TEST(LevelPercept, TheNearestPartOfACompoundCounts) {
  const auto protocol = study({R"("shape": "compound", "parts": [
      {"shape": "sphere", "radius_m": 0.02, "position_m": [-0.03, 0, 0]},
      {"shape": "sphere", "radius_m": 0.015, "position_m": [0.03, 0, 0]}])"},
                              "/parts/1/radius_m", "0.01, 0.02");
  LevelPercept percept(protocol);
  percept.begin(trial_of(), at(0.015));
  percept.add(touch({-0.053, 0, 0}));  // on the part that does not change
  EXPECT_FALSE(percept.length());
  percept.add(touch({0.03, 0.018, 0}));
  percept.add(touch({0.03, 0, -0.014}));
  EXPECT_NEAR(percept.length().value_or(0), 0.016, 1e-9);
}

TEST(LevelPercept, AtTheLimitOfALevelTheOtherSideIsUsed) {
  const auto protocol = study({R"("shape": "sphere", "radius_m": 900)"}, "/radius_m", "800, 1000");
  LevelPercept percept(protocol);
  percept.begin(trial_of(), at(1000));  // m, the largest that a protocol can name
  percept.add(touch({0, 0, 990}));
  EXPECT_NEAR(percept.length().value_or(0), 990, 1e-6);
}

TEST(LevelPercept, LevelsThatDoNotChangeTheSurfaceHaveNoEstimate) {
  const auto protocol = study(
      {R"("shape": "sphere", "radius_m": 0.03, "friction_static": 0.5, "friction_dynamic": 0.4)"},
      "/friction_static", "0.4, 0.6");
  LevelPercept percept(protocol);
  percept.begin(trial_of(), at(0.5));
  percept.add(touch({0.03, 0, 0}));
  percept.add(pressed({0, 0, 3}, 0.01));
  EXPECT_FALSE(percept.length());
  EXPECT_FALSE(percept.stiffness());
}

stimuli::ObjectSpec some_object() {
  stimuli::ObjectSpec object;
  object.shape = stimuli::ShapeKind::compound;
  object.parts.resize(2);
  return object;
}

TEST(LevelPercept, EqualFormsHaveTheSameShapeSizesAndPlace) {
  const stimuli::ObjectSpec object = some_object();
  EXPECT_TRUE(have_one_form(object, some_object()));
  const auto differs = [&](auto&& change) {
    stimuli::ObjectSpec other = some_object();
    change(other);
    return !have_one_form(object, other) && !have_one_form(other, object);
  };
  using Spec = stimuli::ObjectSpec;
  EXPECT_TRUE(differs([](Spec& o) { o.shape = stimuli::ShapeKind::cone; }));
  EXPECT_TRUE(differs([](Spec& o) { o.radius = 0.031; }));
  EXPECT_TRUE(differs([](Spec& o) { o.height = 0.031; }));
  EXPECT_TRUE(differs([](Spec& o) { o.edge = 0.031; }));
  EXPECT_TRUE(differs([](Spec& o) { o.file = "a.stl"; }));
  EXPECT_TRUE(differs([](Spec& o) { o.parts.pop_back(); }));
  for (int k = 0; k < 3; ++k) {
    EXPECT_TRUE(differs([k](Spec& o) { o.size[k] = 0.031; }));
    EXPECT_TRUE(differs([k](Spec& o) { o.pose.position[k] = 0.031; }));
    EXPECT_TRUE(differs([k](Spec& o) { o.pose.orientation[k] += 0.1; }));
  }
  EXPECT_TRUE(differs([](Spec& o) { o.pose.orientation.w = 0.9; }));
  for (std::size_t k = 0; k < 2; ++k)
    EXPECT_TRUE(differs([k](Spec& o) { o.parts[k].radius = 0.031; }));
  EXPECT_FALSE(differs([](Spec& o) { o.material.stiffness *= 2; }));
  EXPECT_FALSE(differs([](Spec& o) { o.parts[0].material.stiffness *= 2; }));
}

TEST(LevelPercept, StiffnessPerceptNeedsEqualForms) {
  const std::string ball = R"("shape": "sphere", "radius_m": 0.03, "stiffness_n_per_m": )";
  const auto alone = [&](const std::vector<std::string>& stimuli) {
    protocols::Protocol protocol = study(stimuli, "/stiffness_n_per_m", "200, 300");
    protocols::TaskBlock& block = protocol.blocks[0];
    block.stimuli.clear();
    for (std::size_t i = 0; i < stimuli.size(); ++i) block.stimuli.push_back(static_cast<int>(i));
    return differ_in_stiffness(protocol, block);
  };
  EXPECT_TRUE(alone({ball + "100", ball + "200"}));
  EXPECT_TRUE(alone({ball + "100", ball + "200", ball + "300"}));
  EXPECT_FALSE(alone({ball + "100", ball + "200", ball + "100"}));
  EXPECT_FALSE(alone({ball + "100"}));
  EXPECT_FALSE(alone({ball + "100", ball + "200", R"("shape": "cube", "edge_m": 0.06)"}));
}

TEST(LevelPercept, IdentificationByStiffnessMeasuresIt) {
  const auto begun = [](const std::string& second) {
    const protocols::Protocol protocol = protocols::parse_protocol_text(
        R"({"version": 2, "name": "l", "renderers": ["ray"], "stimuli": [
          {"name": "a", "shape": "sphere", "radius_m": 0.03, "stiffness_n_per_m": 100},
          {"name": "b", "shape": "sphere", )" +
            second + R"(}], "blocks": [{"name": "b", "task": "identify", "stimuli": ["a", "b"],
          "repetitions": 1}]})",
        "l.json");
    LevelPercept percept(protocol);
    percept.begin(trial_of(), {0, {}, {}, false});
    percept.add(pressed({0, 0, 3}, 0.01));
    return percept.stiffness();
  };
  EXPECT_DOUBLE_EQ(begun(R"("radius_m": 0.03, "stiffness_n_per_m": 300)").value_or(0), 300);
  EXPECT_FALSE(begun(R"("radius_m": 0.02, "stiffness_n_per_m": 300)"));
}

}  // namespace felt_levels
}  // namespace
}  // namespace palpate::runner::participants
