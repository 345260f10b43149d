// A material that the device cannot render is refused or limited, as the protocol specifies.

#include "runner/session/device_check.h"

#include <gtest/gtest.h>

#include <cmath>

#include "protocols/parse.h"
#include "protocols/schedule.h"
#include "stimuli/shapes.h"

namespace palpate::runner::session {
namespace {

servo::DeviceCapabilities some_device() {
  servo::DeviceCapabilities device;
  device.name = "some";
  device.sensed_freedom = device.actuated_freedom = 5;
  device.max_force = 8;
  device.max_stiffness = 4000;
  device.max_rate = 2000;
  device.workspace_radius = 1;
  device.resolution = 4e-5;
  device.damping = 1;
  device.friction = 0.06;  // holds 3000 N/m
  return device;
}

protocols::Protocol some_protocol(const stimuli::Material& material) {
  protocols::Protocol protocol;
  protocol.renderers = {protocols::RendererKind::point};
  protocol.servo_rate = 1000;
  protocols::StimulusSpec stimulus;
  stimulus.name = "ball";
  stimulus.object.subdivisions = 1;
  stimulus.object.material = material;
  protocol.stimuli = {stimulus};
  protocol.blocks = {protocols::shapes_block(protocol)};
  protocol.materials_vary = false;
  return protocol;
}

stimuli::Material of(double stiffness, double damping = 0) {
  stimuli::Material material;
  material.stiffness = stiffness;
  material.damping = damping;
  return material;
}

double share(const stimuli::Material& material, const servo::DeviceCapabilities& device,
             double rate = 1000, double scale = 1, bool controlled = false) {
  return showable(material, device, rate, scale, controlled).fraction;
}

TEST(DeviceCheck, TorqueNeedsADeviceOrItsOmission) {
  for (const int driven : {0, 3, 5}) {
    for (const bool ray : {false, true}) {
      for (const bool left_out : {false, true}) {
        protocols::Protocol protocol = some_protocol(of(100));
        if (ray) protocol.renderers = {protocols::RendererKind::ray};
        if (left_out) protocol.torque = protocols::TorqueRule::left_out;
        servo::DeviceCapabilities device = some_device();
        device.actuated_freedom = driven;
        const StimulusLibrary library(protocol);
        const std::vector<std::string> faults = incompatibilities(protocol, library, device);
        const bool refused = driven == 3 && ray && !left_out;
        ASSERT_EQ(faults.size(), refused ? 1U : 0U) << driven << ray << left_out;
        if (refused) {
          EXPECT_NE(faults[0].find("/torque"), std::string::npos) << faults[0];
        }
      }
    }
  }
}

TEST(DeviceCheck, LevelsWithTheSameFaultShareASentence) {
  const protocols::Protocol protocol = protocols::parse_protocol_text(
      R"({"version": 2, "name": "levels", "renderers": ["point"],
          "stimuli": [{"name": "ball", "shape": "sphere", "radius_m": 0.02, "subdivisions": 1,
                       "stiffness_n_per_m": 100},
                      {"name": "die", "shape": "cube", "edge_m": 3, "stiffness_n_per_m": 100}],
          "blocks": [{"name": "b", "task": "compare", "stimuli": ["ball"], "standard": "ball",
                      "level": {"path": "/radius_m"},
                      "procedure": {"kind": "constant", "levels": [0.021, 2, 3, 4],
                                    "repetitions": 1}},
                     {"name": "i", "task": "identify", "stimuli": ["ball", "die"],
                      "repetitions": 1}]})",
      "levels.json");
  const auto refused = incompatibilities(protocol, StimulusLibrary(protocol), some_device());
  ASSERT_EQ(refused.size(), 2u);  // the die, and the ball at three of its levels
  EXPECT_NE(refused[0].find("'die'"), std::string::npos) << refused[0];
  EXPECT_NE(refused[1].find("'ball at 4'"), std::string::npos) << refused[1];
  EXPECT_NE(refused[1].find("2 other levels of 'ball'"), std::string::npos) << refused[1];
}

TEST(DeviceCheck, AStimulusMayFillButNotExceedTheWorkspace) {
  const protocols::Protocol protocol = some_protocol(of(100));
  const StimulusLibrary library(protocol);
  const auto faults_where_it_lacks = [&](double metres) {
    servo::DeviceCapabilities device = some_device();
    device.workspace_radius = library.reach(0) + protocol.home.margin - metres;
    return incompatibilities(protocol, library, device).size();
  };
  EXPECT_EQ(faults_where_it_lacks(0), 0u);
  EXPECT_EQ(faults_where_it_lacks(1e-12), 0u) << "a rounding of the sum is no lack of room";
  EXPECT_EQ(faults_where_it_lacks(1e-6), 1u);
}

TEST(DeviceCheck, MaterialsAreBoundedByDampingAndFriction) {
  const servo::DeviceCapabilities device = some_device();
  EXPECT_EQ(share(of(2000), device), 1);  // at the bound: b = K T / 2
  EXPECT_NEAR(share(of(2500), device), 0.8, 1e-12);
  EXPECT_NEAR(share(of(1000, 0.75), device), 0.8, 1e-12);  // 0.5 + 0.75 N s/m
  EXPECT_NEAR(share(of(2000), device, 500), 0.5, 1e-12);
  EXPECT_NEAR(share(of(2000), device, 1000, 2), 0.5, 1e-12);  // magnified: twice as stiff
  EXPECT_EQ(share(of(2800), device, 2000), 1);
  EXPECT_NEAR(share(of(6000), device, 2000), 0.5, 1e-12);  // 3000 N/m by friction
  EXPECT_NEAR(share(of(2000 * kPassivityExtension), device, 2000, 1, true), 0.75, 1e-12);
  EXPECT_EQ(share(of(0), device), 1);
}

TEST(DeviceCheck, UnknownPropertiesOfADeviceDoNotLimit) {
  servo::DeviceCapabilities device = some_device();
  device.damping = device.friction = 0;
  EXPECT_EQ(share(of(2000, 100), device), 1);  // by the maker's figure at half its rate
  EXPECT_NEAR(share(of(2500), device), 0.8, 1e-12);
}

/// A layer with 2 N s/m, of which a device can render a quarter.
double limited_layer_damping() {
  stimuli::Material material = of(1000);
  material.layers = {{1e-3, 3000, 2}};
  protocols::Protocol protocol = some_protocol(material);
  protocol.material_limit = protocols::MaterialLimit::limit;
  limit_materials(protocol, some_device());
  return std::round(1e9 * protocol.stimuli[0].object.material.layers[0].damping) / 1e9;
}

TEST(DeviceCheck, TheStiffnessMagnifiedByAReachIsLimited) {
  protocols::Protocol protocol = some_protocol(of(100));
  EXPECT_EQ(felt_gain(protocol), 1);
  protocol.reach = {.factor = 5, .pivot = protocols::ReachSpec::Pivot::point};
  EXPECT_DOUBLE_EQ(felt_gain(protocol), 25);
  protocol.workspace.scale = 2;
  EXPECT_DOUBLE_EQ(felt_gain(protocol), 50);
  protocol.workspace.scale = 1;
  protocol.reach->pivot = protocols::ReachSpec::Pivot::grip;  // a hand that turns about the grip
  EXPECT_DOUBLE_EQ(felt_gain(protocol), 25);
  protocol.reach->pivot = protocols::ReachSpec::Pivot::tail;  // 5 of the tip less 4 of the tail
  EXPECT_DOUBLE_EQ(felt_gain(protocol), 41);
  protocol.workspace.centre = {0, 0.5, 0};
  const auto refused = incompatibilities(protocol, StimulusLibrary(protocol), some_device());
  ASSERT_EQ(refused.size(), 1u);
  EXPECT_NE(refused[0].find("100 N/m (4100 N/m at the hand)"), std::string::npos) << refused[0];
  EXPECT_NE(refused[0].find("lessen /reach/factor"), std::string::npos) << refused[0];
  protocol.material_limit = protocols::MaterialLimit::limit;
  ASSERT_EQ(limit_materials(protocol, some_device()).size(), 1u);
  EXPECT_NEAR(protocol.stimuli[0].object.material.stiffness, 2000 / 41.0, 1e-9);
  EXPECT_TRUE(incompatibilities(protocol, StimulusLibrary(protocol), some_device()).empty());
}

TEST(DeviceCheck, AToolBeyondTheStylusIsALeverToo) {
  protocols::Protocol protocol = some_protocol(of(100));
  protocol.tool.segments = {{{0, 0, 0}, {0, 0, 0.12}}};
  EXPECT_EQ(felt_gain(protocol), 1);
  protocol.tool.segments.push_back({{0, 0, 0}, {0, 0, -0.12}});
  EXPECT_EQ(felt_gain(protocol), 1) << "a point is touched at the tip";
  protocol.renderers = {protocols::RendererKind::ray};
  EXPECT_DOUBLE_EQ(felt_gain(protocol), 4 + 1);  // as far beyond the tip as the tail is behind it
}

TEST(DeviceCheck, AStimulusMustLieWithinReachOfTheVirtualTip) {
  protocols::Protocol protocol = some_protocol(of(1));
  protocol.reach = {.factor = 5, .pivot = protocols::ReachSpec::Pivot::tail};
  servo::DeviceCapabilities device = some_device();
  device.workspace_radius = 0.1;
  const StimulusLibrary library(protocol);
  const double radius = library.reach(0) + protocol.home.margin;  // 0.04 m
  const auto fits = [&](double distance) {
    protocol.workspace.centre = {0, distance, 0};
    return incompatibilities(protocol, library, device).empty();
  };
  // The virtual stylus of 0.6 m has its tail in the hand, 0.06 m behind the grip.
  EXPECT_TRUE(fits(0.54));
  EXPECT_TRUE(fits(0.64 - radius));
  EXPECT_FALSE(fits(0.64 - radius + 1e-6));
  EXPECT_TRUE(fits(0.44 + radius));
  EXPECT_FALSE(fits(0.44 + radius - 1e-6));
  EXPECT_FALSE(fits(0));
  protocol.reach->pivot = protocols::ReachSpec::Pivot::point;
  protocol.reach->point = {0, 0, 0};  // the stimulus itself: the workspace is five times as wide
  EXPECT_TRUE(fits(0.1 - radius / 5));
  EXPECT_FALSE(fits(0.1 - radius / 5 + 1e-6));
  device.sensed_freedom = 3;
  EXPECT_TRUE(fits(0));
  protocol.reach->pivot = protocols::ReachSpec::Pivot::grip;
  EXPECT_FALSE(fits(0.3)) << "without its direction no stylus can be stretched about its grip";
}

TEST(DeviceCheck, LayersAndPartsCount) {
  stimuli::Material layered = of(1000);
  layered.layers = {{1e-3, 2000}, {2e-3, 1000}};
  EXPECT_NEAR(share(layered, some_device()), 0.5, 1e-12) << "who presses deep feels the sum";
  layered.layers[0].damping = 2;
  EXPECT_NEAR(share(layered, some_device()), 0.25, 1e-12);
  EXPECT_EQ(limited_layer_damping(), 0.5);

  protocols::Protocol protocol = some_protocol(of(500));
  stimuli::ObjectSpec part;
  part.material = of(8000);
  protocol.stimuli[0].object.parts = {part};
  protocol.material_limit = protocols::MaterialLimit::limit;
  EXPECT_EQ(limit_materials(protocol, some_device()).size(), 1u);
  EXPECT_EQ(protocol.stimuli[0].object.material.stiffness, 500);
  EXPECT_NEAR(protocol.stimuli[0].object.parts[0].material.stiffness, 2000, 1e-6);
}

TEST(DeviceCheck, LayersOfACompoundsPartsAddUp) {
  // Surface of one part, layer of another: below an edge where they meet both act.
  stimuli::ObjectSpec surface, layered, both;
  surface.material = of(1800);
  layered.material = of(0);
  layered.material.layers = {{1e-3, 200}, {2e-3, 1600}};
  both.material = of(100);
  both.material.layers = {{1e-3, 600}};
  protocols::Protocol protocol = some_protocol(of(1));
  stimuli::ObjectSpec& object = protocol.stimuli[0].object;
  object.shape = stimuli::ShapeKind::compound;
  const StimulusLibrary library(some_protocol(of(1)));
  object.parts = {surface, both};
  object.parts[0].material.stiffness = 1400;
  EXPECT_TRUE(incompatibilities(protocol, library, some_device()).empty());  // 1400 + 600
  object.parts[0].material.stiffness = 1401;
  EXPECT_EQ(incompatibilities(protocol, library, some_device()).size(), 1u);
  object.parts = {surface, layered, both};  // 1800 + 600 + 1600 N/m: twice the device's limit
  const auto refused = incompatibilities(protocol, library, some_device());
  ASSERT_EQ(refused.size(), 1u);
  EXPECT_NE(refused[0].find("'ball' has in all its parts 4000 N/m with its layers"),
            std::string::npos)
      << refused[0];
  protocol.material_limit = protocols::MaterialLimit::limit;
  protocols::Protocol again = protocol;
  const auto limited = limit_materials(protocol, some_device());
  EXPECT_NEAR(object.parts[0].material.stiffness, 900, 1e-6);
  EXPECT_NEAR(object.parts[1].material.layers[1].stiffness, 800, 1e-6);
  EXPECT_NEAR(object.parts[2].material.layers[0].stiffness, 300, 1e-6);
  EXPECT_TRUE(incompatibilities(protocol, library, some_device()).empty());
  EXPECT_TRUE(limit_materials(protocol, some_device()).empty());
  EXPECT_TRUE(limit_as_recorded(again, to_json_text(limited, some_device(), 1000)));
  EXPECT_EQ(again.stimuli[0].object.parts[2].material.layers[0].stiffness,
            object.parts[2].material.layers[0].stiffness);
}

TEST(DeviceCheck, OnlyPartsThatAreTooStiffAreLimited) {
  stimuli::ObjectSpec soft, stiff;
  soft.material = of(500);
  stiff.material = of(8000);
  protocols::Protocol protocol = some_protocol(of(1));
  protocol.stimuli[0].object.shape = stimuli::ShapeKind::compound;
  protocol.stimuli[0].object.parts = {soft, stiff};
  protocol.material_limit = protocols::MaterialLimit::limit;
  EXPECT_EQ(limit_materials(protocol, some_device()).size(), 1u);
  EXPECT_EQ(protocol.stimuli[0].object.parts[0].material.stiffness, 500);
  EXPECT_NEAR(protocol.stimuli[0].object.parts[1].material.stiffness, 2000, 1e-6);
}

TEST(DeviceCheck, RefusesUnlessLimitsAreRequested) {
  protocols::Protocol protocol = some_protocol(of(2500, 0.1));
  EXPECT_TRUE(limit_materials(protocol, some_device()).empty());
  EXPECT_EQ(protocol.stimuli[0].object.material.stiffness, 2500);
  const auto refused = incompatibilities(protocol, StimulusLibrary(protocol), some_device());
  ASSERT_EQ(refused.size(), 1u);
  EXPECT_NE(refused[0].find("'ball' has 2500 N/m and 0.1 N s/m"), std::string::npos) << refused[0];
  EXPECT_NE(refused[0].find("material_limit"), std::string::npos);
  EXPECT_NE(refused[0].find("set /servo/passivity_controller to true (then up to 2000 N/m)"),
            std::string::npos)
      << refused[0];
  protocol.stimuli[0].object.material = of(1e5);
  const auto stiff = incompatibilities(protocol, StimulusLibrary(protocol), some_device());
  ASSERT_EQ(stiff.size(), 1u);
  EXPECT_NE(stiff[0].find("passivity_controller"), std::string::npos) << stiff[0];
  protocol.stimuli[0].object.material = of(2500, 0.1);

  protocol.material_limit = protocols::MaterialLimit::limit;
  const auto limited = limit_materials(protocol, some_device());
  ASSERT_EQ(limited.size(), 1u);
  EXPECT_NE(limited[0].text.find("limited to 1851.85 N/m and 0.0740741 N s/m"), std::string::npos)
      << limited[0].text;
  const stimuli::Material& shown = protocol.stimuli[0].object.material;
  EXPECT_NEAR(shown.stiffness / 2000 + shown.damping, 1, 1e-9);
  EXPECT_TRUE(incompatibilities(protocol, StimulusLibrary(protocol), some_device()).empty());
  EXPECT_TRUE(limit_materials(protocol, some_device()).empty());  // nothing remains to be limited
}

TEST(DeviceCheck, TheRecordLimitsAProtocolAgainToTheBit) {
  const auto compound = [] {
    protocols::Protocol protocol = some_protocol(of(2500, 0.1));
    stimuli::ObjectSpec part;
    part.material = of(7777, 0.3);
    part.material.layers = {{1e-3, 9876.5}};
    protocol.stimuli[0].object.parts = {stimuli::ObjectSpec{}, part};
    protocol.material_limit = protocols::MaterialLimit::limit;
    return protocol;
  };
  protocols::Protocol limited = compound();
  const auto materials = limit_materials(limited, some_device());
  ASSERT_EQ(materials.size(), 2u);
  const std::string event = to_json_text(materials, some_device(), 1000);
  EXPECT_NE(event.find("\"asked_stiffness_n_per_m\":2500.0"), std::string::npos) << event;
  EXPECT_NE(event.find("\"rate_hz\":1000.0"), std::string::npos) << event;

  protocols::Protocol again = compound();
  EXPECT_FALSE(limit_as_recorded(again, "a note {"));
  EXPECT_FALSE(limit_as_recorded(again, R"({"masking_noise":"on"})"));
  EXPECT_EQ(again.stimuli[0].object.material.stiffness, 2500);
  EXPECT_TRUE(limit_as_recorded(again, event));
  const stimuli::ObjectSpec &was = limited.stimuli[0].object, &is = again.stimuli[0].object;
  EXPECT_EQ(is.material.stiffness, was.material.stiffness);
  EXPECT_EQ(is.material.damping, was.material.damping);
  EXPECT_EQ(is.parts[0].material.stiffness, was.parts[0].material.stiffness);
  EXPECT_EQ(is.parts[1].material.stiffness, was.parts[1].material.stiffness);
  EXPECT_EQ(is.parts[1].material.layers[0].stiffness, was.parts[1].material.layers[0].stiffness);
  EXPECT_NE(is.parts[1].material.stiffness, 7777);

  EXPECT_THROW(limit_as_recorded(again, event), std::invalid_argument) << "it is limited already";
  protocols::Protocol other = some_protocol(of(2500, 0.1));  // no parts
  EXPECT_THROW(limit_as_recorded(other, event), std::invalid_argument);
  protocols::Protocol whole = compound();
  EXPECT_THROW(limit_as_recorded(whole, R"({"material_limited":[{"stimulus":"ball"}]})"),
               std::invalid_argument);
}

TEST(DeviceCheck, ADeviceWithoutMotorsRefusesNoMaterial) {
  servo::DeviceCapabilities mouse = some_device();
  mouse.actuated_freedom = 0;
  protocols::Protocol protocol = some_protocol(of(1e5));
  EXPECT_TRUE(incompatibilities(protocol, StimulusLibrary(protocol), mouse).empty());
  protocol.material_limit = protocols::MaterialLimit::limit;
  EXPECT_TRUE(limit_materials(protocol, mouse).empty());
}

}  // namespace
}  // namespace palpate::runner::session
