// The kinds of device by name, and their properties known without opening one.

#include "runner/devices/registry.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/shared/prose.h"

namespace palpate::runner::devices {
namespace {
namespace kinds {

TEST(DeviceKinds, AreTheDocumentedOnesEachWithADescription) {
  std::vector<std::string> names;
  for (const DeviceKind& kind : device_kinds()) {
    names.emplace_back(kind.name);
    EXPECT_EQ(&device_kind(kind.name), &kind);
    EXPECT_EQ(testing::flaw_of(kind.description), "") << kind.name;
  }
  EXPECT_EQ(names, (std::vector<std::string>{"falcon", "falcon2", "forcedimension",
                                             "forcedimension2", "inverse3", "inverse3x2", "touch",
                                             "touch2", "mouse", "simulated"}));
}

TEST(DeviceKinds, AnUnknownNameIsRefusedWithTheKnownOnes) {
  for (const std::string name : {"falcon3", "", "Mouse"}) {
    try {
      device_kind(name);
      ADD_FAILURE() << name;
    } catch (const std::invalid_argument& error) {
      EXPECT_EQ(error.what(),
                "no device '" + name +
                    "'; there are: falcon, falcon2, forcedimension, forcedimension2, inverse3, "
                    "inverse3x2, touch, touch2, mouse, simulated");
    }
  }
}

// A device with motors, which moves a real hand, must have a guard.
TEST(DeviceKinds, DevicesWithMotorsAreGuarded) {
  for (const DeviceKind& kind : device_kinds()) {
    const std::string name = kind.name;
    EXPECT_EQ(kind.has_force_feedback, name != "mouse" && name != "simulated") << name;
  }
}

TEST(DeviceKinds, AFalconSensesAndMovesAPointAndTwoALine) {
  for (const auto& [name, freedom] : {std::pair("falcon", 3), std::pair("falcon2", 5)}) {
    const servo::DeviceCapabilities can = device_kind(name).nominal({});
    EXPECT_EQ(can.name, name);
    EXPECT_EQ(can.sensed_freedom, freedom);
    EXPECT_EQ(can.actuated_freedom, freedom);
    EXPECT_EQ(can.max_stiffness, 3000) << "N/m, as CHAI3D lists";
    EXPECT_EQ(can.max_rate, 1000) << "Hz, of its USB bridge";
    EXPECT_EQ(can.workspace_radius, 0.04) << "m, reached all round";
    EXPECT_EQ(can.resolution, 5e-5) << "m";
    EXPECT_EQ(can.max_force, 0) << "differs from device to device";
    EXPECT_EQ(can.serial, "");
    EXPECT_EQ(can.calibration, "");
  }
}

TEST(DeviceKinds, DevicesWithoutMotorsAreAlwaysPresentWithTheConfigsStylus) {
  servo::DeviceConfig config;
  config.stylus_length = 0.2;
  config.stylus_grip = 0.03;
  config.rate = 500;
  for (const char* name : {"mouse", "simulated"}) {
    const DeviceKind& kind = device_kind(name);
    EXPECT_NO_THROW(kind.check(config));
    const std::vector<servo::ConnectedDevice> there = list_connected(kind, config);
    ASSERT_EQ(there.size(), 1U);
    EXPECT_EQ(there[0].serial, "");
    EXPECT_EQ(there[0].trouble, "");
    const std::unique_ptr<servo::Device> device = kind.open(config);
    const servo::DeviceReading reading = device->read();
    EXPECT_NEAR(glm::length(reading.stylus.tail - reading.stylus.tip), 0.2, 1e-4) << name;
    const servo::DeviceCapabilities can = kind.nominal(config);
    EXPECT_EQ(can.name, device->capabilities().name);
    EXPECT_EQ(can.sensed_freedom, 5) << name;
    EXPECT_EQ(can.actuated_freedom, std::string(name) == "mouse" ? 0 : 5);
  }
  // The simulated hand holds the stylus at the grip: the tip is as much below.
  const std::unique_ptr<servo::Device> simulated = device_kind("simulated").open(config);
  const rendering::LineProbe stylus = simulated->read().stylus;
  EXPECT_NEAR(stylus.tip.z, 0, 1e-4);
  EXPECT_NEAR(stylus.tip.y, -0.1, 1e-4);
  // It moves with time at the config's rate: a rest of 1 s has 500 ticks.
  for (int tick = 0; tick < 490; ++tick) simulated->read();
  EXPECT_NEAR(simulated->read().stylus.tip.y, -0.1, 1e-3);
  for (int tick = 0; tick < 375; ++tick) simulated->read();
  EXPECT_NEAR(simulated->read().stylus.tip.y, 0, 2e-3) << "0.75 s later in the middle";
}

// A maker's library may do all of these; the program must continue.
TEST(DeviceKinds, AreListedInASeparateProcess) {
  DeviceKind kind = device_kind("falcon");
  const auto said = [&kind] {
    try {
      list_connected(kind, {});
      return std::string();
    } catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
  };
  kind.connected = [](const servo::DeviceConfig& config) {
    return std::vector<servo::ConnectedDevice>{
        {config.library + "\xff", "in use by process " + std::to_string(getpid())}};
  };
  servo::DeviceConfig config;
  config.library = "a";
  const std::vector<servo::ConnectedDevice> found = list_connected(kind, config);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].serial, "a\xef\xbf\xbd") << "bytes that are no text are replaced";
  EXPECT_NE(found[0].trouble, "in use by process " + std::to_string(getpid()));

  kind.connected = [](const servo::DeviceConfig&) -> std::vector<servo::ConnectedDevice> {
    throw std::runtime_error("no rights");
  };
  EXPECT_EQ(said(), "no rights");
  kind.connected = [](const servo::DeviceConfig&) -> std::vector<servo::ConnectedDevice> {
    std::raise(SIGKILL);
    return {};
  };
  EXPECT_NE(said().find("crashed"), std::string::npos) << said();
  kind.connected = [](const servo::DeviceConfig&) -> std::vector<servo::ConnectedDevice> {
    pause();
    return {};
  };
  EXPECT_NE(said().find("longer than 3 s"), std::string::npos);
}

}  // namespace kinds
}  // namespace
}  // namespace palpate::runner::devices
