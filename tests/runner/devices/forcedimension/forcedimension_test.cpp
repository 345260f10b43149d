// Force Dimension's devices through a stub of the maker's library.

#include "runner/devices/forcedimension/forcedimension.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <stdexcept>
#include <string>
#include <thread>

#include "runner/devices/self_test.h"
#include "tests/runner/devices/forcedimension/stubbed_device.h"

namespace palpate::runner::devices::forcedimension {
namespace {

using testing::StubDevice;

class ForceDimension : public testing::StubbedDevice {
 protected:
  ForceDimension() : StubbedDevice(open, STUB_LIBRARY) {}

  static servo::DeviceTrouble read(servo::Device& device) { return device.read().trouble; }
  /// Reads until the status has been queried again.
  static servo::DeviceTrouble settle(servo::Device& device) {
    servo::DeviceTrouble trouble = servo::DeviceTrouble::none;
    for (int tick = 0; tick < 10; ++tick) {
      trouble = device.read().trouble;
      device.write(Vec3(0), Vec3(0));
    }
    return trouble;
  }
};

void expect_near(const Vec3& a, const Vec3& b) {
  EXPECT_LT(glm::length(a - b), 1e-12)
      << a.x << " " << a.y << " " << a.z << ", not " << b.x << " " << b.y << " " << b.z;
}

TEST_F(ForceDimension, ReadsTheStylusAndAddsForcesAtItsGrip) {
  one().hand[0] = 0.01;  // towards the user
  one().hand[1] = 0.02;  // right
  one().hand[2] = 0.03;  // up
  one().hand_stiffness = 0;
  const auto device = open(config_);
  const servo::DeviceReading reading = device->read();
  EXPECT_FALSE(reading.lost);
  expect_near(reading.stylus.tip, {0.02, -0.01, 0.03});
  expect_near(reading.stylus.tail, {0.02, -0.01 - config_.stylus_length, 0.03});
  const servo::DeviceCapabilities& can = device->capabilities();
  EXPECT_EQ(can.sensed_freedom, 5);
  EXPECT_EQ(can.actuated_freedom, 3);
  EXPECT_EQ(can.max_force, 12);
  EXPECT_EQ(can.serial, "4711");
  EXPECT_EQ(can.calibration, "maker's: omega.6, SDK 3.17.5.0");
  EXPECT_EQ(one().watchdog, 40) << "125 us each";
  EXPECT_EQ(one().brakes, 1);
  device->write({1, 2, 3}, {0.1, 0.2, 0.3});
  EXPECT_DOUBLE_EQ(one().force[0], -2.2);  // -y of the world is towards the user
  EXPECT_DOUBLE_EQ(one().force[1], 1.1);
  EXPECT_DOUBLE_EQ(one().force[2], 3.3);
  EXPECT_EQ(one().torque[2], 0);
}

TEST_F(ForceDimension, WithoutAWristTheStylusIsAPoint) {
  one().model = 1;
  const auto device = open(config_);
  EXPECT_EQ(device->capabilities().sensed_freedom, 3);
  const servo::DeviceReading reading = device->read();
  EXPECT_EQ(reading.stylus.tip, reading.stylus.tail);
}

TEST_F(ForceDimension, DrivenWristsGetTheTailsTorque) {
  one().model = 2;
  const auto device = open(config_);
  EXPECT_EQ(device->capabilities().actuated_freedom, 5);
  EXPECT_EQ(device->capabilities().max_torque, 0.2);
  device->read();
  device->write({0, 0, 1}, {0, 0, 1});
  EXPECT_DOUBLE_EQ(one().force[2], 2);
  // World: (0, -L, 0) x (0, 0, 1) = (-L, 0, 0), which is -y of the library.
  EXPECT_NEAR(one().torque[0], 0, 1e-15);
  EXPECT_NEAR(one().torque[1], -config_.stylus_length, 1e-15);
  EXPECT_NEAR(one().torque[2], 0, 1e-15);
}

TEST_F(ForceDimension, AnUnknownModelGetsCautiousLimits) {
  one().model = 3;
  const servo::DeviceCapabilities can = open(config_)->capabilities();
  EXPECT_EQ(can.max_force, 8);
  EXPECT_EQ(can.max_stiffness, 1000);
  EXPECT_EQ(can.workspace_radius, 0.05);
}

TEST_F(ForceDimension, EveryFaultIsTroubleAndZeroForceUntilItIsOver) {
  const struct {
    const char* name;
    double StubDevice::*what;
    double value, well;
    servo::DeviceTrouble trouble;
  } cases[] = {{"unplugged", &StubDevice::connected, 0, 1, servo::DeviceTrouble::unplugged},
               {"no power", &StubDevice::power, 0, 1, servo::DeviceTrouble::silent},
               {"calibration lost", &StubDevice::reset, 1, 0, servo::DeviceTrouble::not_calibrated},
               {"too fast", &StubDevice::too_fast, 1, 0, servo::DeviceTrouble::stopped_by_device},
               {"NaN", &StubDevice::wrong, 1, 0, servo::DeviceTrouble::implausible},
               {"infinite", &StubDevice::wrong, 2, 0, servo::DeviceTrouble::implausible},
               {"1e9 m", &StubDevice::wrong, 3, 0, servo::DeviceTrouble::implausible},
               {"communication", &StubDevice::error, 2, 0, servo::DeviceTrouble::unplugged},
               {"no answer", &StubDevice::error, 7, 0, servo::DeviceTrouble::silent},
               {"in use", &StubDevice::error, 20, 0, servo::DeviceTrouble::in_use}};
  for (const auto& [name, what, value, well, trouble] : cases) {
    SCOPED_TRACE(name);
    make_well();
    const auto device = open(config_);
    ASSERT_EQ(settle(*device), servo::DeviceTrouble::none);
    device->write({0, 0, 1}, Vec3(0));
    ASSERT_EQ(one().force[2], 1);
    one().*what = value;
    EXPECT_EQ(settle(*device), trouble);
    const servo::DeviceReading reading = device->read();
    EXPECT_TRUE(reading.lost);
    EXPECT_TRUE(std::isfinite(reading.stylus.tip.x + reading.stylus.tip.y + reading.stylus.tip.z));
    device->write({0, 0, 1}, Vec3(0));
    one().*what = well;
    const bool reached = what != &StubDevice::connected && what != &StubDevice::error;
    if (reached) {
      EXPECT_EQ(one().force[2], 0) << "a force that is asked for anyway";
    }
    if (servo::needs_reopening(trouble)) device->reopen();
    EXPECT_EQ(settle(*device), servo::DeviceTrouble::none);
    device->write({0, 0, 1}, Vec3(0));
    EXPECT_EQ(one().force[2], 1) << "it works again";
  }
}

TEST_F(ForceDimension, SettingsAreReadBackBeforeTheFirstForce) {
  one().deaf = 1;
  EXPECT_NE(refusal().find("gravity compensation"), std::string::npos) << refusal();
  EXPECT_EQ(one().open, 0);
  make_well();
  one().deaf = 2;
  one().gravity = 1;
  EXPECT_NE(refusal().find("time guard"), std::string::npos) << refusal();
  make_well();
  EXPECT_EQ(refusal(), "");
}

TEST_F(ForceDimension, ReadsAndWritesDoNotAllocate) {
  const auto device = open(config_);
  ASSERT_EQ(settle(*device), servo::DeviceTrouble::none);
  expect_no_allocation(*device);
}

TEST_F(ForceDimension, AJumpIsImplausible) {
  const auto device = open(config_);
  ASSERT_EQ(settle(*device), servo::DeviceTrouble::none);
  one().wrong = 4;
  EXPECT_EQ(read(*device), servo::DeviceTrouble::implausible);
  EXPECT_EQ(read(*device), servo::DeviceTrouble::none)
      << "the servo keeps the forces off by itself";
}

TEST_F(ForceDimension, AfterADeadGuardTheFirmwareSwitchesForcesOff) {
  const auto device = open(config_);
  device->read();
  device->write({0, 0, 1}, Vec3(0));
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_EQ(settle(*device), servo::DeviceTrouble::stopped_by_device);
  EXPECT_EQ(one().force[2], 0);
  EXPECT_EQ(one().forces_on, 0) << "not by itself on again";
  device->reopen();
  EXPECT_EQ(settle(*device), servo::DeviceTrouble::none);
}

TEST_F(ForceDimension, TheFirmwareWaitsForAServoThatIsSlow) {
  for (const auto& [rate, periods] : {std::pair(4000.0, 40), std::pair(1000.0, 40),
                                      std::pair(500.0, 80), std::pair(100.0, 255)}) {
    config_.rate = rate;
    const auto device = open(config_);
    EXPECT_EQ(one().watchdog, periods) << rate;
  }
}

TEST_F(ForceDimension, ADeviceIsIdentifiedByItsSerialNumberNotItsIndex) {
  state_->count = 2;
  other().serial = 99;
  other().hand[2] = 0.05;
  config_.serials = {"99"};
  const auto device = open(config_);
  EXPECT_NEAR(device->read().stylus.tip.z, 0.05, 1e-12);
  EXPECT_EQ(one().open, 0) << "the other one was let go";
  one().connected = 0;  // its index is the first now
  device->reopen();
  EXPECT_NEAR(device->read().stylus.tip.z, 0.05, 1e-12);
  config_.serials = {"5"};
  EXPECT_NE(refusal().find("has the serial number 5; connected: 99"), std::string::npos)
      << refusal();
}

TEST_F(ForceDimension, NamesReasonOfFailedOpening) {
  one().in_use = 1;
  EXPECT_NE(refusal().find("another program uses it"), std::string::npos) << refusal();
  one().in_use = 0;
  one().connected = 0;
  EXPECT_NE(refusal().find("check its cable"), std::string::npos) << refusal();
  state_->count = -1;
  EXPECT_NE(refusal().find("cannot be counted"), std::string::npos) << refusal();
  EXPECT_EQ(refusal().find('\x1b'), std::string::npos) << "no control characters of a library's";
  config_.library = "/nonexistent/libdrd.so";
  EXPECT_NE(refusal().find("--library"), std::string::npos) << refusal();
  EXPECT_NE(refusal().find("/nonexistent/libdrd.so"), std::string::npos) << refusal();
  config_.library = FOREIGN_LIBRARY;
  EXPECT_NE(refusal().find("it has no dhdGetSDKVersion"), std::string::npos) << refusal();
  config_.serials = {"1", "2"};
  EXPECT_THROW(check(config_), std::invalid_argument);
}

TEST_F(ForceDimension, MovesByItselfOnlyToCalibrate) {
  one().reset = 1;
  EXPECT_EQ(move_to_calibrate(config_), "omega.6, serial number 4711: is calibrated");
  EXPECT_EQ(one().moved, 1);
  EXPECT_EQ(one().watchdog, 200);
  EXPECT_EQ(one().force[2], 0);
  EXPECT_EQ(one().forces_on, 0);
  EXPECT_EQ(one().open, 0);
  EXPECT_NE(move_to_calibrate(config_).find("already"), std::string::npos);
  EXPECT_EQ(one().moved, 1);
}

TEST_F(ForceDimension, UncalibratedArmsEndWithoutForce) {
  const auto refused = [this] {
    try {
      return "it is said: " + move_to_calibrate(config_);
    } catch (const std::runtime_error& error) {
      return std::string(error.what());
    }
  };
  one().reset = one().too_fast = 1;
  EXPECT_EQ(refused(), "omega.6, serial number 4711 was not calibrated: timeout");
  EXPECT_EQ(one().force[2], 0);
  EXPECT_EQ(one().forces_on, 0);
  EXPECT_EQ(one().open, 0);
  state_->count = 2;
  other().serial = 99;
  EXPECT_NE(refused().find("--serial"), std::string::npos) << refused();
  EXPECT_EQ(one().moved, 1) << "which of two must be said";
  config_.library = OLD_LIBRARY;
  EXPECT_NE(refused().find("maker's program"), std::string::npos) << refused();
}

TEST_F(ForceDimension, AnOldLibraryWorksAndItsMissingFunctionsAreRecorded) {
  config_.library = OLD_LIBRARY;
  const auto device = open(config_);
  EXPECT_EQ(settle(*device), servo::DeviceTrouble::none);
  EXPECT_EQ(device->capabilities().calibration,
            "maker's: omega.6, SDK 3.3.0.1, WITHOUT the firmware's watchdog");
  EXPECT_EQ(one().watchdog, 0);
}

TEST_F(ForceDimension, DevicesAreListedWithSerialNumbersAndTroubles) {
  state_->count = 2;
  other().in_use = 1;
  const std::vector<servo::ConnectedDevice> found = connected(config_);
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].serial, "4711");
  EXPECT_EQ(found[0].trouble, "");
  EXPECT_NE(found[1].trouble.find("another program"), std::string::npos);
  EXPECT_EQ(one().open, 0);
}

}  // namespace
}  // namespace palpate::runner::devices::forcedimension
