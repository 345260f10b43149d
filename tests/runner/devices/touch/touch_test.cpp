// 3D Systems' devices through a stub of the maker's library.

#include "runner/devices/touch/touch.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <glm/geometric.hpp>
#include <iostream>
#include <stdexcept>
#include <string>
#include <thread>

#include "tests/runner/devices/forcedimension/stubbed_device.h"
#include "tests/shared/temporary_folder.h"

namespace palpate::runner::devices::touch {
namespace {

using testing::StubDevice;

class Touch : public testing::StubbedDevice {
 protected:
  Touch() : StubbedDevice(open, STUB_LIBRARY) {}

  /// Reads like a servo, with a force upwards, until `holds` or a long time-out.
  static bool until(servo::Device& device,
                    const std::function<bool(const servo::DeviceReading&)>& holds, double up = 0) {
    for (int tick = 0; tick < 10'000; ++tick) {
      const servo::DeviceReading reading = device.read();
      device.write({0, 0, up}, Vec3(0));
      if (holds(reading)) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
  }
  static bool works(servo::Device& device) {
    return until(device, [](const servo::DeviceReading& reading) { return !reading.lost; });
  }
  bool pushes(servo::Device& device) {
    return until(
        device, [this](const servo::DeviceReading&) { return one().force[1] == 1; }, 1);
  }
};

TEST_F(Touch, ReadsTheStylusAndAddsForcesAtItsTip) {
  one().hand[0] = 0.01;  // right
  one().hand[1] = 0.03;  // up
  one().hand[2] = 0.02;  // towards the user
  one().hand_stiffness = 0;
  const auto device = open(config_);
  ASSERT_TRUE(works(*device));
  const servo::DeviceReading reading = device->read();
  EXPECT_LT(glm::length(reading.stylus.tip - Vec3(0.01, -0.02, 0.03)), 1e-12);
  EXPECT_LT(glm::length(reading.stylus.tail - Vec3(0.01, -0.02 - config_.stylus_length, 0.03)),
            1e-12);
  const servo::DeviceCapabilities& can = device->capabilities();
  EXPECT_EQ(can.sensed_freedom, 5);
  EXPECT_EQ(can.actuated_freedom, 3);
  EXPECT_EQ(can.max_force, 3.3);
  EXPECT_EQ(can.max_stiffness, 500);
  EXPECT_EQ(can.calibration, "maker's: Touch, serial number 4711, OpenHaptics");
  for (int tick = 0; tick < 10'000 && one().force[0] == 0; ++tick) {
    device->read();
    device->write({1, 2, 3}, {0.1, 0.2, 0.3});
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_DOUBLE_EQ(one().force[0], 1.1);
  EXPECT_DOUBLE_EQ(one().force[1], 3.3);
  EXPECT_DOUBLE_EQ(one().force[2], -2.2);  // +y of the world is away from the user
}

TEST_F(Touch, ADeviceThatReportsNoLimitsGetsTheLowest) {
  one().model = 3;
  EXPECT_EQ(open(config_)->capabilities().max_force, 0.88);
}

TEST_F(Touch, AForceThatIsNotRenewedBecomesZero) {
  const auto device = open(config_);
  ASSERT_TRUE(pushes(*device));
  for (int i = 0; i < 10'000 && one().force[1] != 0; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_EQ(one().force[1], 0);
}

TEST_F(Touch, EveryFaultIsTroubleAndZeroForceUntilItIsOver) {
  const struct {
    const char* name;
    double StubDevice::*what;
    double value, well;
    servo::DeviceTrouble trouble;
  } cases[] = {
      {"unplugged", &StubDevice::connected, 0, 1, servo::DeviceTrouble::unplugged},
      {"too fast", &StubDevice::too_fast, 1, 0, servo::DeviceTrouble::stopped_by_device},
      {"warm", &StubDevice::error, 0x0200, 0, servo::DeviceTrouble::stopped_by_device},
      {"errors without end", &StubDevice::error, 1, 0, servo::DeviceTrouble::stopped_by_device},
      {"an unknown error", &StubDevice::error, 0x0999, 0, servo::DeviceTrouble::silent},
      {"calibration lost", &StubDevice::reset, 1, 0, servo::DeviceTrouble::not_calibrated},
      {"stalled", &StubDevice::delay, 1, 0, servo::DeviceTrouble::silent},
      {"NaN", &StubDevice::wrong, 1, 0, servo::DeviceTrouble::implausible},
      {"infinite", &StubDevice::wrong, 2, 0, servo::DeviceTrouble::implausible},
      {"1e9 m", &StubDevice::wrong, 3, 0, servo::DeviceTrouble::implausible}};
  for (const auto& [name, what, value, well, trouble] : cases) {
    SCOPED_TRACE(name);
    make_well();
    const auto device = open(config_);
    ASSERT_TRUE(works(*device));
    ASSERT_TRUE(pushes(*device));
    one().*what = value;
    const auto began = std::chrono::steady_clock::now();
    if (what != &StubDevice::delay) {  // a stalled scheduler sets no force
      EXPECT_TRUE(until(
          *device, [this](const servo::DeviceReading&) { return one().force[1] == 0; }, 1));
      const std::chrono::duration<double, std::milli> took =
          std::chrono::steady_clock::now() - began;
      std::clog << name << ": zero force after " << took.count() << " ms\n";
    }
    EXPECT_TRUE(until(
        *device,
        [expected = trouble](const servo::DeviceReading& read) { return read.trouble == expected; },
        1));
    const servo::DeviceReading reading = device->read();
    EXPECT_TRUE(reading.lost);
    EXPECT_TRUE(std::isfinite(reading.stylus.tip.x + reading.stylus.tip.y + reading.stylus.tip.z));
    one().*what = well;
    if (servo::needs_reopening(trouble)) device->reopen();
    EXPECT_TRUE(works(*device));
    EXPECT_TRUE(pushes(*device)) << "it works again";
  }
}

TEST_F(Touch, ReadsAndWritesDoNotAllocate) {
  const auto device = open(config_);
  ASSERT_TRUE(works(*device));
  expect_no_allocation(*device);
}

TEST_F(Touch, ACalibrationThatIsDueIsUpdated) {
  one().reset = 2;
  const auto device = open(config_);
  EXPECT_TRUE(works(*device));
  EXPECT_EQ(one().reset, 0);
}

TEST_F(Touch, OneStyleUpdatesACalibration) {
  constexpr int kEncoderReset = 1, kAuto = 2, kInkwell = 4;
  const struct {
    int styles, taken;
  } cases[] = {{kAuto, kAuto},
               {kInkwell, kInkwell},
               {kAuto | kInkwell, kAuto},
               {kEncoderReset | kInkwell, kInkwell},
               {kEncoderReset | kAuto | kInkwell, kAuto}};
  for (const auto& [styles, taken] : cases) {
    SCOPED_TRACE(styles);
    make_well();
    one().styles = styles;
    one().reset = 2;
    const auto device = open(config_);
    EXPECT_TRUE(works(*device));
    EXPECT_EQ(one().style, taken);
  }
}

TEST_F(Touch, EncodersAreNeverResetUnasked) {
  one().styles = 1;
  one().reset = 2;
  const auto device = open(config_);
  EXPECT_TRUE(until(*device, [](const servo::DeviceReading& read) {
    return read.trouble == servo::DeviceTrouble::not_calibrated;
  }));
  EXPECT_EQ(one().style, 0) << "the zero of the encoders would be where the hand is";
}

TEST_F(Touch, ForcesThatStayOffAreRefused) {
  one().deaf = 1;
  EXPECT_NE(refusal().find("forces stay off"), std::string::npos) << refusal();
  one().deaf = 0;
  EXPECT_TRUE(works(*open(config_))) << "and it is closed again";
}

TEST_F(Touch, AWorkspaceNotInMillimetresIsRefused) {
  one().metres = 1;
  EXPECT_NE(refusal().find("not in millimetres"), std::string::npos) << refusal();
}

TEST_F(Touch, TwoDevicesAreIdentifiedByNameAndShareOneScheduler) {
  state_->count = 2;
  other().serial = 99;
  other().hand[0] = 0.05;
  config_.serials = {"4711"};
  const auto tip = open(config_);
  config_.serials = {"99"};
  const auto tail = open(config_);
  EXPECT_TRUE(works(*tip));
  EXPECT_TRUE(works(*tail));
  EXPECT_NEAR(tail->read().stylus.tip.x, 0.05, 1e-9);
  tail->reopen();
  EXPECT_TRUE(works(*tip)) << "called again";
  EXPECT_NE(refusal().find("another program uses it"), std::string::npos) << refusal();
  EXPECT_TRUE(works(*tip)) << "also after one that could not be opened";
  config_.serials = {"5"};
  EXPECT_NE(refusal().find("'5' of 3D Systems cannot be opened: communication error"),
            std::string::npos)
      << refusal();
  config_.serials = {"1", "2"};
  EXPECT_THROW(check(config_), std::invalid_argument);
}

TEST_F(Touch, NamesEqualMakersSetup) {
  const palpate::testing::TemporaryFolder home;
  std::filesystem::create_directory(home / "config");
  for (const char* name : {"Left.config", "Default Device.config", "notes.txt"})
    std::ofstream(home / "config/" + name) << "\n";
  setenv("GTDD_HOME", home.path().c_str(), 1);
  const std::vector<servo::ConnectedDevice> found = connected(config_);
  unsetenv("GTDD_HOME");
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].serial, "Default Device");
  EXPECT_EQ(found[1].serial, "Left");
  EXPECT_EQ(connected(config_).size(), 1U) << "the default one, it may be";
}

// In a separate process: a loaded library stays loaded.
TEST_F(Touch, ALibraryThatCannotBeUsedSaysWhy) {
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  const auto tell = [this](const char* path) {
    config_.library = path;
    std::fputs(refusal().c_str(), stderr);
    _exit(0);
  };
  EXPECT_EXIT(tell("/nonexistent/libHD.so"), ::testing::ExitedWithCode(0),
              "--library.*nonexistent");
  EXPECT_EXIT(tell(FOREIGN_LIBRARY), ::testing::ExitedWithCode(0), "it has no hdInitDevice");
}

}  // namespace
}  // namespace palpate::runner::devices::touch
