// Haply's arm through an emulated Inverse Service.

#include "runner/devices/haply/inverse3.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <functional>
#include <glm/geometric.hpp>
#include <iostream>
#include <stdexcept>
#include <thread>

#include "runner/evidence/tick_meters.h"
#include "tests/runner/devices/haply/emulated_service.h"

namespace palpate::runner::devices::haply {
namespace {

using testing::EmulatedArm;
using testing::EmulatedService;

constexpr int kMinuteOfTicks = 60'000;  // at 1 kHz

constexpr const char* kState = R"({"inverse3":[{"device_id":"A","state":{"cursor_position":
  {"x":0.01,"y":0.02,"z":0.03},"current_cursor_force":{"x":1,"y":2,"z":3}},"status":{"calibrated":true}}],
  "wireless_verse_grip":[{"device_id":"W","state":{"orientation":{"w":1,"x":0,"y":0,"z":0},
  "buttons":{"a":true,"b":false,"c":true},"battery_level":0.5},"status":{"awake":true}}],"news":[[{}]]})";

TEST(HaplyMessages, AStateIsReadByTheNamesOfArmAndGrip) {
  const State state = parse_state(kState, "A", "W");
  EXPECT_TRUE(state.has_arm);
  EXPECT_EQ(state.position, Vec3(0.01, 0.02, 0.03));
  EXPECT_EQ(state.force, Vec3(1, 2, 3));
  EXPECT_TRUE(state.has_grip);
  EXPECT_EQ(state.axis, Vec3(0, -1, 0)) << "the tail is towards the user";
  EXPECT_EQ(state.buttons, 5);
  EXPECT_FALSE(parse_state(kState, "B", "W").has_arm);
  EXPECT_FALSE(parse_state(kState, "A", "V").has_grip);
  EXPECT_FALSE(parse_state(kState, "A", "").has_grip);
}

TEST(HaplyMessages, MissingValuesStayMissingAndInvalidMessagesAreRefused) {
  const State state = parse_state(
      R"({"inverse3":[{"device_id":"A","state":{"cursor_position":{"x":1}}}]})", "A", "W");
  EXPECT_TRUE(state.has_arm);
  EXPECT_TRUE(std::isnan(state.position.y));
  EXPECT_TRUE(std::isnan(state.force.x)) << "not told";
  EXPECT_FALSE(parse_state(R"({"inverse3":[{"device_id":"A","state":{}}]})", "A", "").has_arm);
  EXPECT_FALSE(parse_state(R"({"inverse3":7})", "A", "").has_arm);
  // A grip that is asleep, or has an invalid quaternion.
  for (const char* grip :
       {R"("state":{"orientation":{"w":0,"x":0,"y":0,"z":0}})",
        R"("state":{"orientation":{"w":1}})", R"("state":{})",
        R"("state":{"orientation":{"w":1,"x":0,"y":0,"z":0}},"status":{"awake":false})"}) {
    const std::string text = std::string(R"({"verse_grip":[{"device_id":"G",)") + grip + "}]}";
    EXPECT_FALSE(parse_state(text, "A", "G").has_grip) << grip;
  }
  const std::string deep = "{\"a\":" + std::string(100'000, '[') + std::string(100'000, ']') + "}";
  for (const std::string& bad : {std::string(), std::string("{"), std::string("[]"),
                                 std::string("null"), std::string("\xff"), deep})
    EXPECT_THROW(parse_state(bad, "A", ""), std::runtime_error);
}

TEST(HaplyMessages, VersionsAreReadBareAndWrapped) {
  EXPECT_EQ(parse_version(R"({"project_version":"3.1.2"})").minor, 1);
  EXPECT_EQ(parse_version(R"({"ok":true,"data":{"project_version":"4.0.0.0"}})").major, 4);
  EXPECT_EQ(dialect_of({3, 4, ""}), Dialect::values);
  EXPECT_EQ(dialect_of({3, 5, ""}), Dialect::vector);
  EXPECT_EQ(dialect_of({4, 0, ""}), Dialect::vector);
  for (const char* bad : {R"({"project_version":"3.0.9"})", R"({"project_version":"new"})", "{}",
                          R"({"ok":false,"error":"no"})", ""})
    EXPECT_THROW(parse_version(bad), std::runtime_error) << bad;
  EXPECT_EQ(parse_force_scale(R"({"ok":true,"data":{"force_scale":0.5}})"), 0.5);
  EXPECT_EQ(parse_force_scale(""), std::nullopt);
}

TEST(HaplyMessages, TheForceHasTheDialectsKey) {
  EXPECT_EQ(
      command("A\"", {1, -0.5, 0}, Dialect::values, false),
      R"({"inverse3":[{"device_id":"A\"","commands":{"set_cursor_force":{"values":{"x":1,"y":-0.5,"z":0}}}}]})");
  EXPECT_EQ(
      command("A", {0, 0, 0}, Dialect::vector, true),
      R"({"session":{"force_render_full_state":{}},"inverse3":[{"device_id":"A","commands":{"set_cursor_force":{"vector":{"x":0,"y":0,"z":0}}}}]})");
  EXPECT_THROW(command(std::string(600, 'a'), {}, Dialect::vector, false), std::runtime_error);
}

TEST(HaplyMessages, ThePresetHasTheDocumentedForm) {
  EXPECT_EQ(
      configuration("A", PresetForm::object),
      R"({"inverse3":[{"configure":{"preset":{"preset":"arm_front_centered"}},"device_id":"A"}],"session":{"configure":{"profile":{"name":"palpate"}},"force_render_full_state":{}}})");
  EXPECT_NE(
      configuration("A", PresetForm::name).find(R"("configure":{"preset":"arm_front_centered"},)"),
      std::string::npos);
}

TEST(HaplyMessages, AnArmThatOthersChangedIsNamed) {
  const auto change = [](const std::string& config, const std::string& transform = "{}") {
    return parse_inventory(R"({"inverse3":[{"device_id":"A","config":)" + config +
                           R"(,"state":{"transform":)" + transform + "}}]}")
        .arms.at(0)
        .changed;
  };
  EXPECT_EQ(change("{}"), "");
  EXPECT_EQ(
      change(
          R"({"mount":{"position":{"x":0,"y":-0.2,"z":0},"rotation":{"w":-1,"x":0,"y":0,"z":0}}})"),
      "")
      << "the preset places the origin; -1 is no turn either";
  EXPECT_EQ(change(R"({"mount":{"rotation":{"w":0,"x":0,"y":0,"z":1}}})"), "its mount is turned");
  EXPECT_EQ(change(R"({"mount":{"rotation":{"z":1}}})"), "its mount is turned");
  EXPECT_EQ(change(R"({"mount":{"rotation":{"w":0}}})"), "its mount is turned");
  EXPECT_EQ(change(R"({"mount":{"scale":{"x":-1,"y":1,"z":1}}})"), "its mount is scaled");
  EXPECT_EQ(change(R"({"mount":{"scale":{"x":0,"y":1,"z":1}}})"), "its mount is scaled");
  EXPECT_EQ(change(R"({"basis":{"permutation":"XZY"}})"), "its axes are permuted (basis XZY)");
  EXPECT_EQ(change("{}", R"({"scale":{"x":2}})"), "its workspace is scaled (\"transform\")");
  EXPECT_EQ(change("{}", R"({"position":{"y":0.01}})"), "its workspace is moved (\"transform\")");
  EXPECT_EQ(change(R"({"filters":{"damping":{"scalar":0.0},"force_gate":{"gain":0.3}}})"), "");
  EXPECT_EQ(change(R"({"filters":{"damping":{"scalar":6}}})"),
            "its motion is damped (\"filters\")");
  EXPECT_EQ(change("{}", R"({"rotation":{"w":"north"}})"),
            "its workspace is turned (\"transform\")");
}

class Inverse3 : public ::testing::Test {
 protected:
  Inverse3() { config_.service = service_.address(); }

  /// Reads like a servo, with a force to the right, until `holds` or a long time-out.
  bool until(servo::Device& device, const std::function<bool(const servo::DeviceReading&)>& holds,
             const Vec3& force = Vec3(0)) {
    for (int tick = 0; tick < 10'000; ++tick) {
      const servo::DeviceReading reading = device.read();
      device.write(force, Vec3(0));
      if (holds(reading)) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
  }
  bool works(servo::Device& device) {
    return until(device, [](const servo::DeviceReading& reading) { return !reading.lost; });
  }
  std::string refusal() {
    try {
      open(config_);
      return "";
    } catch (const std::runtime_error& error) {
      return error.what();
    }
  }

  EmulatedService service_;
  servo::DeviceConfig config_;
};

TEST_F(Inverse3, ReadsTheStylusAndAddsForcesAtTheCursor) {
  service_.with([](EmulatedArm& arm) {
    arm.hand = {0.01, 0.02, 0.03};
    arm.hand_stiffness = 0;
    arm.button = true;
    arm.grip = {std::sqrt(0.5), 0, 0, std::sqrt(0.5)};  // a quarter turn: its +y is the world's -x
  });
  const auto device = open(config_);
  ASSERT_TRUE(works(*device));
  const servo::DeviceReading reading = device->read();
  EXPECT_EQ(reading.stylus.tip, Vec3(0.01, 0.02, 0.03));
  EXPECT_LT(glm::length(reading.stylus.tail - Vec3(0.01 + config_.stylus_length, 0.02, 0.03)),
            1e-9);
  EXPECT_EQ(reading.buttons, 1);
  EXPECT_EQ(device->capabilities().sensed_freedom, 5);
  EXPECT_EQ(device->capabilities().actuated_freedom, 3);
  EXPECT_NE(device->capabilities().calibration.find("Inverse Service 3.5.0.0"), std::string::npos);
  EXPECT_TRUE(until(*device,
                    [this](const servo::DeviceReading&) { return service_.arm().force[0] == 1; },
                    {1, 0, 0}));
  EXPECT_EQ(service_.arm().preset, "arm_front_centered");
}

TEST_F(Inverse3, WithoutAGripItIsAPoint) {
  service_.with([](EmulatedArm& arm) { arm.has_grip = false; });
  const auto device = open(config_);
  ASSERT_TRUE(works(*device));
  EXPECT_EQ(device->capabilities().sensed_freedom, 3);
  const servo::DeviceReading reading = device->read();
  EXPECT_EQ(reading.stylus.tip, reading.stylus.tail);
}

TEST_F(Inverse3, AForceThatIsNotRenewedBecomesZero) {
  const auto device = open(config_);
  ASSERT_TRUE(until(*device,
                    [this](const servo::DeviceReading&) { return service_.arm().force[2] == 1; },
                    {0, 0, 1}));
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  while (service_.arm().force[2] != 0 && std::chrono::steady_clock::now() < give_up)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_EQ(service_.arm().force[2], 0) << "nobody writes: the servo has ended or hangs";
}

TEST_F(Inverse3, EveryFaultGivesTroubleAndZeroForceAndAllowsReopening) {
  const struct {
    const char* name;
    std::function<void(EmulatedArm&)> fault, mend;
    servo::DeviceTrouble trouble;
  } cases[] = {{"unplugged", [](auto& a) { a.present = false; }, [](auto& a) { a.present = true; },
                servo::DeviceTrouble::unplugged},
               {"no power", [](auto& a) { a.powered = false; }, [](auto& a) { a.powered = true; },
                servo::DeviceTrouble::silent},
               {"calibration lost", [](auto& a) { a.calibrated = false; },
                [](auto& a) { a.calibrated = true; }, servo::DeviceTrouble::not_calibrated},
               {"grip asleep", [](auto& a) { a.awake = false; }, [](auto& a) { a.awake = true; },
                servo::DeviceTrouble::silent},
               {"far",
                [](auto& a) {
                  a.hand = {1e9, 0, 0};
                },
                [](auto& a) {
                  a.hand = {0, 0, 0};
                },
                servo::DeviceTrouble::implausible},
               {"no replies", [](auto& a) { a.mute = true; }, [](auto& a) { a.mute = false; },
                servo::DeviceTrouble::silent},
               {"no JSON", [](auto& a) { a.instead = "{{{"; }, [](auto& a) { a.instead = ""; },
                servo::DeviceTrouble::unreadable},
               {"too long", [](auto& a) { a.instead = std::string(10 << 20, ' '); },
                [](auto& a) { a.instead = ""; }, servo::DeviceTrouble::service_gone}};
  for (const auto& [name, fault, mend, trouble] : cases) {
    SCOPED_TRACE(name);
    const auto device = open(config_);
    ASSERT_TRUE(works(*device));
    ASSERT_TRUE(until(*device,
                      [this](const servo::DeviceReading&) { return service_.arm().force[2] == 1; },
                      {0, 0, 1}));
    service_.with(fault);
    const auto began = std::chrono::steady_clock::now();
    EXPECT_TRUE(until(*device,
                      [this](const servo::DeviceReading&) { return service_.arm().force[2] == 0; },
                      {0, 0, 1}));
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - began;
    std::clog << name << ": zero force after " << took.count() << " ms\n";
    const servo::DeviceTrouble expected = trouble;
    EXPECT_TRUE(
        until(*device,
              [expected](const servo::DeviceReading& r) { return r.lost && r.trouble == expected; },
              {0, 0, 1}))
        << static_cast<int>(device->read().trouble);
    service_.with(mend);
    device->reopen();
    EXPECT_TRUE(works(*device));
    EXPECT_TRUE(until(*device,
                      [this](const servo::DeviceReading&) { return service_.arm().force[2] == 1; },
                      {0, 0, 1}));
  }
}

TEST_F(Inverse3, ReadsAndWritesDoNotAllocate) {
  if (!evidence::counts_allocations())
    GTEST_SKIP() << "allocations are not counted under sanitizers";
  const auto device = open(config_);
  ASSERT_TRUE(works(*device));
  const std::uint64_t before = evidence::allocations();
  for (int tick = 0; tick < kMinuteOfTicks; ++tick) {
    device->read();
    device->write({0, 0, 1}, Vec3(0));
  }
  EXPECT_EQ(evidence::allocations(), before);
}

TEST_F(Inverse3, AServiceThatEndsAndComesBackIsOpenedAgain) {
  const auto device = open(config_);
  ASSERT_TRUE(works(*device));
  service_.turn(false);
  EXPECT_TRUE(until(*device, [](const servo::DeviceReading& r) {
    return r.trouble == servo::DeviceTrouble::service_gone && r.lost;
  }));
  EXPECT_THROW(device->reopen(), std::runtime_error);
  EXPECT_TRUE(device->read().lost);
  service_.with([](EmulatedArm& arm) { arm.version = "3.4.0.0", arm.vector = false; });
  service_.turn(true);
  device->reopen();
  EXPECT_TRUE(works(*device));
  EXPECT_TRUE(until(*device,
                    [this](const servo::DeviceReading&) { return service_.arm().force[0] == 1; },
                    {1, 0, 0}));
}

TEST_F(Inverse3, RetriesIgnoredForcesInTheOtherDialect) {
  service_.with([](EmulatedArm& arm) { arm.vector = false; });  // although it is 3.5
  const auto device = open(config_);
  ASSERT_TRUE(works(*device));
  EXPECT_TRUE(until(*device,
                    [](const servo::DeviceReading& r) {
                      return r.trouble == servo::DeviceTrouble::stopped_by_device;
                    },
                    {1, 0, 0}));
  EXPECT_EQ(service_.arm().force[0], 0);
  device->reopen();
  EXPECT_TRUE(until(*device,
                    [this](const servo::DeviceReading&) { return service_.arm().force[0] == 1; },
                    {1, 0, 0}));
}

TEST_F(Inverse3, AStateThatNeverChangesIsStale) {
  const auto device = open(config_);
  ASSERT_TRUE(works(*device));
  service_.with([](EmulatedArm& arm) { arm.frozen = true; });
  double force = 0;
  EXPECT_TRUE(until(*device, [&](const servo::DeviceReading& r) {
    device->write({force += 1e-5, 0, 0}, Vec3(0));
    return r.trouble == servo::DeviceTrouble::silent;
  }));
}

TEST_F(Inverse3, NamesReasonOfFailedOpening) {
  const auto said = [this](const std::function<void(EmulatedArm&)>& change) {
    service_.with([&](EmulatedArm& arm) {
      arm = EmulatedArm{};
      change(arm);
    });
    return refusal();
  };
  EXPECT_NE(said([](auto& a) { a.in_use = true; }).find("would add up"), std::string::npos);
  EXPECT_NE(said([](auto& a) { a.basis = "ZXY"; }).find("permuted"), std::string::npos);
  EXPECT_NE(said([](auto& a) { a.workspace_scale = 2; }).find("its workspace is scaled"),
            std::string::npos);
  EXPECT_NE(said([](auto& a) { a.workspace_y = 0.05; }).find("its workspace is moved"),
            std::string::npos);
  EXPECT_NE(said([](auto& a) { a.mount_scale = 0.5; }).find("its mount is scaled"),
            std::string::npos);
  EXPECT_NE(said([](auto& a) { a.damping = 6; }).find("its motion is damped"), std::string::npos);
  EXPECT_NE(said([](auto& a) { a.gravity = false; }).find("gravity compensation"),
            std::string::npos);
  EXPECT_NE(
      said([](auto& a) { a.takes = EmulatedArm::Takes::nothing; }).find("stays in 'defaults'"),
      std::string::npos);
  EXPECT_NE(said([](auto& a) {
              a.takes = EmulatedArm::Takes::nothing;
              a.preset = "led_front";
            }).find("stays in 'led_front'"),
            std::string::npos);
  EXPECT_NE(said([](auto& a) { a.tells_preset = false; }).find("stays in 'not told'"),
            std::string::npos);
  EXPECT_EQ(service_.arm().commands, 2U * 20 - 2) << "zero forces alone, that ask for the state";
  EXPECT_EQ(service_.arm().force[0], 0);
  EXPECT_NE(said([](auto& a) { a.force_scale = 0.5; }).find("force_scale"), std::string::npos);
  EXPECT_NE(said([](auto& a) { a.version = "3.0.1"; }).find("3.1 or newer"), std::string::npos);
  EXPECT_NE(said([](auto& a) { a.present = false; }).find("lists no Inverse3"), std::string::npos);
  config_.serials = {"FFFF"};
  EXPECT_NE(said([](auto&) {}).find("there are: 049D"), std::string::npos);
  config_.serials.clear();
  service_.turn(false);
  EXPECT_NE(refusal().find("--service"), std::string::npos) << refusal();
  config_.service = "nowhere";
  EXPECT_NE(refusal().find("HOST:PORT"), std::string::npos) << refusal();
}

TEST_F(Inverse3, SetsThePresetInTheServicesForm) {
  using Takes = EmulatedArm::Takes;
  for (const char* version : {"3.5.0.0", "3.4.0.0"}) {
    for (const Takes takes : {Takes::object, Takes::name, Takes::both}) {
      service_.with([&](EmulatedArm& arm) {
        arm = EmulatedArm{};
        arm.takes = takes;
        arm.version = version;
        arm.vector = arm.version == "3.5.0.0";
        arm.hand = {0.01, 0.02, 0.03};
        arm.hand_stiffness = 0;
        arm.preset = "led_front";  // of the program before
      });
      const auto device = open(config_);
      ASSERT_TRUE(works(*device));
      EXPECT_LT(glm::length(device->read().stylus.tip - Vec3(0.01, 0.02, 0.03)), 1e-12);
      EXPECT_GE(service_.arm().full_states, 1U);
    }
  }
}

TEST_F(Inverse3, ItOpensAgainInItsOwnPreset) {
  for (int opening = 0; opening < 3; ++opening) {
    const auto device = open(config_);
    EXPECT_TRUE(works(*device));
    device->reopen();
    EXPECT_TRUE(works(*device));
  }
}

TEST_F(Inverse3, AnOldServiceMayNotTellItsPreset) {
  service_.with([](EmulatedArm& arm) {
    arm.version = "3.2.0.0";
    arm.vector = arm.tells_preset = false;
  });
  const auto device = open(config_);
  EXPECT_TRUE(works(*device));
  EXPECT_NE(device->capabilities().calibration.find("preset not told"), std::string::npos);
}

TEST_F(Inverse3, ForcesEndWhenAnotherProgramMovesTheFrame) {
  const struct {
    const char* name;
    std::function<void(EmulatedArm&)> change;
  } cases[] = {{"scaled", [](EmulatedArm& a) { a.workspace_scale = 2; }},
               {"moved", [](EmulatedArm& a) { a.workspace_y = 0.005; }},
               {"preset", [](EmulatedArm& a) { a.preset = "led_front_centered"; }},
               {"damping", [](EmulatedArm& a) { a.damping = 6; }},
               {"basis", [](EmulatedArm& a) { a.basis = "XZY"; }}};
  for (const auto& [name, change] : cases) {
    SCOPED_TRACE(name);
    service_.with([](EmulatedArm& arm) { arm = EmulatedArm{}; });
    const auto device = open(config_);
    ASSERT_TRUE(until(*device,
                      [this](const servo::DeviceReading&) { return service_.arm().force[2] == 1; },
                      {0, 0, 1}));
    service_.with(change);
    EXPECT_TRUE(until(*device,
                      [](const servo::DeviceReading& r) {
                        return r.lost && r.trouble == servo::DeviceTrouble::in_use;
                      },
                      {0, 0, 1}));
    EXPECT_TRUE(until(*device,
                      [this](const servo::DeviceReading&) { return service_.arm().force[2] == 0; },
                      {0, 0, 1}));
  }
}

TEST_F(Inverse3, IsListedWithoutBeingCommanded) {
  const std::vector<servo::ConnectedDevice> found = connected(config_);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].serial, "049D");
  EXPECT_EQ(service_.arm().commands, 0U);
}

}  // namespace
}  // namespace palpate::runner::devices::haply
