// Data passed through the memory shared by the runner and its guard process.

#include <gtest/gtest.h>

#include <string>

#include "runner/safety/guarded_device.h"

namespace palpate::runner::safety {
namespace {

/// Every member differs from its default and from the others.
servo::DeviceCapabilities some_capabilities() {
  servo::DeviceCapabilities device;
  device.name = "falcon2";
  device.sensed_freedom = 5;
  device.actuated_freedom = 4;
  device.max_force = 8.5;
  device.max_stiffness = 1500;
  device.max_rate = 900;
  device.workspace_radius = 0.05;
  device.resolution = 6e-5;
  device.simulated = true;
  device.serial = "A1,B2";
  device.calibration = "of 2026-05-01";
  device.damping = 0.7;
  device.friction = 0.3;
  device.any_rate = true;
  return device;
}

TEST(GuardChannel, CapabilitiesPassThroughUnchanged) {
  const servo::DeviceCapabilities sent = some_capabilities();
  FixedCapabilities fixed;
  fixed.set(sent);
  const servo::DeviceCapabilities got = fixed.numbers();
  EXPECT_EQ(got.name, sent.name);
  EXPECT_EQ(got.sensed_freedom, sent.sensed_freedom);
  EXPECT_EQ(got.actuated_freedom, sent.actuated_freedom);
  EXPECT_EQ(got.max_force, sent.max_force);
  EXPECT_EQ(got.max_stiffness, sent.max_stiffness);
  EXPECT_EQ(got.max_rate, sent.max_rate);
  EXPECT_EQ(got.workspace_radius, sent.workspace_radius);
  EXPECT_EQ(got.resolution, sent.resolution);
  EXPECT_EQ(got.simulated, sent.simulated);
  EXPECT_EQ(got.serial, sent.serial);
  EXPECT_EQ(got.calibration, sent.calibration);
  EXPECT_EQ(got.damping, sent.damping);
  EXPECT_EQ(got.friction, sent.friction);
  EXPECT_EQ(got.any_rate, sent.any_rate);
}

TEST(GuardChannel, LongTextsAreTruncatedAndShorterOnesReplaceThem) {
  servo::DeviceCapabilities device = some_capabilities();
  device.name = std::string(1000, 'n');
  device.calibration = std::string(1000, 'c');
  FixedCapabilities fixed;
  fixed.set(device);
  EXPECT_EQ(fixed.numbers().name, std::string(63, 'n')) << "room for 64 with the end";
  EXPECT_EQ(fixed.numbers().calibration, std::string(255, 'c'));
  fixed.set(some_capabilities());
  EXPECT_EQ(fixed.numbers().name, "falcon2");
}

TEST(GuardChannel, ReadingsPassThroughUnchanged) {
  servo::DeviceReading sent;
  sent.stylus = {{0.01, 0.02, 0.03}, {0.04, 0.05, 0.06}};
  sent.buttons = 5;
  sent.lost = true;
  sent.trouble = servo::DeviceTrouble::apart;
  const GuardedReading guarded(sent, 17, 3);
  EXPECT_EQ(guarded.request, 17U);
  EXPECT_EQ(guarded.trips, 3U);
  const servo::DeviceReading got = guarded.reading();
  EXPECT_EQ(got.stylus.tip, sent.stylus.tip);
  EXPECT_EQ(got.stylus.tail, sent.stylus.tail);
  EXPECT_EQ(got.buttons, 5);
  EXPECT_TRUE(got.lost);
  EXPECT_EQ(got.trouble, servo::DeviceTrouble::apart);
}

}  // namespace
}  // namespace palpate::runner::safety
