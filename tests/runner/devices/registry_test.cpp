// The kinds of device by name, and what is known of each without opening one.

#include "runner/devices/registry.h"

#include <gtest/gtest.h>

#include <stdexcept>
#include <string>
#include <vector>

#include "tests/shared/prose.h"

namespace palpate::runner {
namespace {
namespace kinds {

TEST(DeviceKinds, AreThoseOfTheHandbookEachWithADescription) {
  std::vector<std::string> names;
  for (const DeviceKind& kind : device_kinds()) {
    names.emplace_back(kind.name);
    EXPECT_EQ(&device_kind(kind.name), &kind);
    EXPECT_EQ(testing::flaw_of(kind.description), "") << kind.name;
  }
  EXPECT_EQ(names, (std::vector<std::string>{"falcon", "falcon2", "mouse", "simulated"}));
}

TEST(DeviceKinds, AnUnknownNameIsRefusedWithTheKnownOnes) {
  for (const std::string name : {"falcon3", "", "Mouse"}) {
    try {
      device_kind(name);
      ADD_FAILURE() << name;
    } catch (const std::invalid_argument& error) {
      EXPECT_EQ(error.what(),
                "no device '" + name + "'; there are: falcon, falcon2, mouse, simulated");
    }
  }
}

// A real hand that motors move must have a guard.
TEST(DeviceKinds, WhatHasMotorsIsGuarded) {
  for (const DeviceKind& kind : device_kinds()) {
    const bool falcon = std::string(kind.name).starts_with("falcon");
    EXPECT_EQ(kind.has_force_feedback, falcon) << kind.name;
  }
}

TEST(DeviceKinds, AFalconSensesAndMovesAPointTwoOfThemALine) {
  for (const auto& [name, freedom] : {std::pair("falcon", 3), std::pair("falcon2", 5)}) {
    const DeviceCapabilities can = nominal_capabilities(device_kind(name), {});
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

TEST(DeviceKinds, WithoutMotorsThereIsAlwaysOneAndItHasTheStylusOfTheConfig) {
  DeviceConfig config;
  config.stylus_length = 0.2;
  config.stylus_grip = 0.03;
  config.rate = 500;
  for (const char* name : {"mouse", "simulated"}) {
    const DeviceKind& kind = device_kind(name);
    EXPECT_NO_THROW(kind.check(config));
    const std::vector<ConnectedDevice> there = kind.connected();
    ASSERT_EQ(there.size(), 1U);
    EXPECT_EQ(there[0].serial, "");
    EXPECT_EQ(there[0].trouble, "");
    const std::unique_ptr<Device> device = kind.open(config);
    const DeviceReading reading = device->read();
    EXPECT_NEAR(glm::length(reading.stylus.tail - reading.stylus.tip), 0.2, 1e-4) << name;
    const DeviceCapabilities can = nominal_capabilities(kind, config);
    EXPECT_EQ(can.name, device->capabilities().name);
    EXPECT_EQ(can.sensed_freedom, 5) << name;
    EXPECT_EQ(can.actuated_freedom, std::string(name) == "mouse" ? 0 : 5);
  }
  // The simulated hand holds the stylus at the grip: the tip is as much below.
  const std::unique_ptr<Device> simulated = device_kind("simulated").open(config);
  const rendering::LineProbe stylus = simulated->read().stylus;
  EXPECT_NEAR(stylus.tip.z, 0, 1e-4);
  EXPECT_NEAR(stylus.tip.y, -0.1, 1e-4);
  // It moves as time goes by at the rate of the config: a rest of 1 s has 500 ticks.
  for (int tick = 0; tick < 490; ++tick) simulated->read();
  EXPECT_NEAR(simulated->read().stylus.tip.y, -0.1, 1e-3);
  for (int tick = 0; tick < 375; ++tick) simulated->read();
  EXPECT_NEAR(simulated->read().stylus.tip.y, 0, 2e-3) << "0.75 s later in the middle";
}

}  // namespace kinds
}  // namespace
}  // namespace palpate::runner
