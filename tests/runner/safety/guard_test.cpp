// The guard process between runner and device: the data passed on, and its behaviour when it or the
// device is lost.

#include <gtest/gtest.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <memory>
#include <stdexcept>

#include "runner/safety/guarded_device.h"
#include "runner/servo/realtime.h"
#include "tests/runner/recording_device.h"
#include "tests/runner/safety/guard_stage.h"

namespace palpate::runner::safety {
namespace {

using runner::testing::RecordingDevice;
using testing::nap;
using testing::no_rights;
using testing::Stage;
using testing::stylus_at;
using testing::visiting;

TEST(Guard, TheDevicesReadingsPassThrough) {
  Stage stage;
  GuardedDevice device(
      [&] {
        return std::make_unique<RecordingDevice>(stage.shared->record, [](int tick) {
          servo::DeviceReading reading = stylus_at(0.001 * tick);
          reading.buttons = static_cast<std::uint8_t>(tick);
          if (tick == 3) {
            reading.lost = true;
            reading.trouble = servo::DeviceTrouble::not_homed;
          }
          return reading;
        });
      },
      no_rights());
  EXPECT_EQ(device.capabilities().name, "recording");
  EXPECT_EQ(device.capabilities().serial, "R-1");
  EXPECT_EQ(device.capabilities().max_rate, 10000);
  bool homing_lost = false;
  for (int i = 0; i < 20; ++i) {
    const servo::DeviceReading reading = device.read();
    if (reading.trouble == servo::DeviceTrouble::not_homed) homing_lost = reading.lost;
    if (reading.trouble != servo::DeviceTrouble::none) continue;
    EXPECT_NEAR(reading.stylus.tip.z, 0.001 * reading.buttons, 1e-12) << "one whole reading";
    device.write(Vec3(0), Vec3(0));
  }
  EXPECT_TRUE(homing_lost);
}

TEST(Guard, OpeningWaitsForAFirstReading) {
  Stage stage;
  GuardedDevice device(
      [&] {
        return std::make_unique<RecordingDevice>(stage.shared->record, [](int tick) {
          nap(tick == 0 ? 100 : 0);
          return stylus_at(0.1);
        });
      },
      no_rights());
  EXPECT_EQ(device.read().stylus.tip.z, 0.1) << "no reading is late before there was one";
  const auto dying = [&] {
    return std::make_unique<RecordingDevice>(stage.shared->record,
                                             [](int) -> servo::DeviceReading { _exit(1); });
  };
  EXPECT_THROW(GuardedDevice(dying, no_rights()), std::runtime_error);
  const auto hanging = [&] {
    return std::make_unique<RecordingDevice>(stage.shared->record, [](int) {
      nap(100'000);
      return stylus_at(0);
    });
  };
  GuardSettings hasty = no_rights();
  hasty.patience = 0.1;
  EXPECT_THROW(GuardedDevice(hanging, hasty), std::runtime_error);
}

TEST(Guard, NoForceBeforeAZeroCommandAndNoneAfterAnEmergency) {
  Stage stage;
  GuardSettings settings = no_rights();
  settings.silence = 60;  // only what is asked for
  GuardedDevice device(
      [&] { return std::make_unique<RecordingDevice>(stage.shared->record, visiting); }, settings);
  const auto command = [&](double force) {
    const std::uint32_t before = stage.shared->record.count;
    device.write({0, 0, force}, Vec3(0));
    while (stage.shared->record.count == before) nap(1);
    return stage.shared->record.last_force();
  };
  EXPECT_EQ(command(1), 0) << "forces begin with a zero";
  EXPECT_EQ(command(0), 0);
  EXPECT_EQ(command(1), 1);
  device.emergency_zero();
  while (stage.shared->record.last_force() != 0) nap(1);
  EXPECT_EQ(command(1), 0);
  EXPECT_EQ(command(0), 0);
  EXPECT_EQ(command(1), 0) << "the runner has not yet heard of it";
  servo::DeviceReading reading;
  do reading = device.read();
  while (reading.trouble == servo::DeviceTrouble::late);
  EXPECT_TRUE(reading.lost);
  EXPECT_EQ(reading.trouble, servo::DeviceTrouble::guarded);
  EXPECT_EQ(command(1), 0);
  EXPECT_EQ(command(0), 0);
  EXPECT_EQ(command(1), 1);
}

TEST(Guard, TheReasonWhyADeviceCannotBeOpenedIsReported) {
  const auto factory = []() -> std::unique_ptr<servo::Device> {
    throw std::runtime_error("the Falcon is asleep");
  };
  try {
    GuardedDevice device(factory, no_rights());
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "the Falcon is asleep");
  }
  const auto dying = []() -> std::unique_ptr<servo::Device> { _exit(1); };
  EXPECT_THROW(GuardedDevice(dying, no_rights()), std::runtime_error);
  const auto hanging = []() -> std::unique_ptr<servo::Device> {
    nap(100'000);
    return nullptr;
  };
  GuardSettings hasty = no_rights();
  hasty.patience = 0.05;
  EXPECT_THROW(GuardedDevice(hanging, hasty), std::runtime_error);
}

TEST(Guard, AGuardThatHasEndedCountsAsALostDevice) {
  Stage stage;
  GuardedDevice device(
      [&] { return std::make_unique<RecordingDevice>(stage.shared->record, visiting); },
      no_rights());
  device.read();
  kill(device.guard_process(), SIGKILL);
  servo::DeviceReading reading;
  for (int i = 0; i < 1000 && !reading.lost; ++i) {
    reading = device.read();
    device.write(Vec3(0), Vec3(0));
  }
  EXPECT_TRUE(reading.lost);
  EXPECT_EQ(reading.trouble, servo::DeviceTrouble::guard_lost);
}

/// Reads and commands zero until the reading satisfies the condition. \return the last reading
template <class Wished>
servo::DeviceReading read_until(GuardedDevice& device, Wished wished) {
  servo::DeviceReading reading = device.read();
  for (int i = 0; i < 20'000 && !wished(reading); ++i) {
    device.write(Vec3(0), Vec3(0));
    reading = device.read();
  }
  return reading;
}

bool is_lost(const servo::DeviceReading& reading) { return reading.lost; }
bool is_well(const servo::DeviceReading& reading) {
  return !reading.lost && reading.trouble == servo::DeviceTrouble::none;
}

/// Its readings wait while the test says so.
class Waiting final : public servo::Device {
 public:
  explicit Waiting(Stage& stage) : stage_(stage), recording_(stage.shared->record, visiting) {}
  const servo::DeviceCapabilities& capabilities() const override {
    return recording_.capabilities();
  }
  servo::DeviceReading read() noexcept override {
    while (stage_.shared->go) nap(1);
    return recording_.read();
  }
  void write(const Vec3& device1, const Vec3& device2) noexcept override {
    recording_.write(device1, device2);
  }

 private:
  Stage& stage_;
  RecordingDevice recording_;
};

TEST(Guard, ALateGuardIsALostDeviceOnlyUntilItRecovers) {
  Stage stage;
  GuardedDevice device([&] { return std::make_unique<Waiting>(stage); }, no_rights());
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(is_well(read_until(device, is_well)));
    stage.shared->go = true;
    EXPECT_EQ(read_until(device, is_lost).trouble, servo::DeviceTrouble::guard_late);
    stage.shared->go = false;
  }
  EXPECT_TRUE(is_well(read_until(device, is_well)));
}

TEST(Guard, AStoppedGuardSendsZeroAndEnds) {
  Stage stage;
  GuardedDevice device(
      [&] { return std::make_unique<RecordingDevice>(stage.shared->record, visiting); },
      no_rights());
  const auto press = [&](const servo::DeviceReading&) {
    device.write({0, 0, 1}, Vec3(0));
    return stage.shared->record.last_force() > 0;
  };
  EXPECT_TRUE(is_well(read_until(device, is_well)));
  read_until(device, press);
  ASSERT_GT(stage.shared->record.last_force(), 0);
  kill(device.guard_process(), SIGSTOP);
  servo::RealClock clock;
  const std::int64_t stopped = clock.now_ns();
  const auto is_over = [](const servo::DeviceReading& reading) {
    return reading.trouble == servo::DeviceTrouble::guard_lost;
  };
  EXPECT_TRUE(is_over(read_until(device, is_over)));
  while (!stage.shared->record.closed && clock.now_ns() - stopped < 5'000'000'000) device.read();
  EXPECT_TRUE(stage.shared->record.closed) << "it has closed the device";
  EXPECT_EQ(stage.shared->record.last_force(), 0);
  std::printf("  zero force and closed after %.1f ms\n",
              1e-6 * static_cast<double>(clock.now_ns() - stopped));
}

TEST(Guard, AGuardThatHangsForGoodIsKilled) {
  Stage stage;
  GuardSettings settings = no_rights();
  settings.given_up = 0.2;
  GuardedDevice device([&] { return std::make_unique<Waiting>(stage); }, settings);
  stage.shared->go = true;
  servo::RealClock clock;
  const std::int64_t began = clock.now_ns();
  EXPECT_EQ(read_until(device, is_lost).trouble, servo::DeviceTrouble::guard_late);
  const servo::DeviceReading last = read_until(device, [](const servo::DeviceReading& reading) {
    return reading.trouble == servo::DeviceTrouble::guard_lost;
  });
  EXPECT_EQ(last.trouble, servo::DeviceTrouble::guard_lost);
  EXPECT_GE(clock.now_ns() - began, 190'000'000);
  const auto is_gone = [&] { return kill(device.guard_process(), 0) != 0; };
  for (int i = 0; i < 5000 && !is_gone(); ++i) {
    device.read();
    nap(1);
  }
  EXPECT_TRUE(is_gone());
}

/// Unplugged and plugged in again by the test.
class Plug final : public servo::Device {
 public:
  explicit Plug(Stage& stage) : stage_(stage), recording_(stage.shared->record, visiting) {}
  const servo::DeviceCapabilities& capabilities() const override {
    return recording_.capabilities();
  }
  servo::DeviceReading read() noexcept override {
    open_ = open_ && !stage_.shared->go;
    servo::DeviceReading reading = recording_.read();
    reading.lost = !open_;
    reading.trouble = open_ ? servo::DeviceTrouble::none : servo::DeviceTrouble::unplugged;
    return reading;
  }
  void write(const Vec3& device1, const Vec3& device2) noexcept override {
    recording_.write(device1, device2);
  }
  void reopen() override {
    nap(60);
    if (stage_.shared->go) throw std::runtime_error("nothing is plugged in");
    open_ = true;
  }

 private:
  Stage& stage_;
  RecordingDevice recording_;
  bool open_ = true;
};

TEST(Guard, AnUnpluggedDeviceIsReopenedOnRequest) {
  Stage stage;
  GuardedDevice device([&] { return std::make_unique<Plug>(stage); }, no_rights());
  const auto reopened = [&device](const servo::DeviceReading&) { return !device.reopening(); };
  for (int i = 0; i < 3; ++i) {
    stage.shared->go = true;
    EXPECT_EQ(read_until(device, is_lost).trouble, servo::DeviceTrouble::unplugged);
    device.ask_to_reopen();
    EXPECT_TRUE(device.reopening());
    EXPECT_EQ(read_until(device,
                         [](const servo::DeviceReading& reading) {
                           return reading.trouble == servo::DeviceTrouble::reopening;
                         })
                  .trouble,
              servo::DeviceTrouble::reopening);
    EXPECT_TRUE(read_until(device, reopened).lost);
    EXPECT_EQ(device.reopen_trouble(), "nothing is plugged in");
    stage.shared->go = false;
    nap(10);
    EXPECT_TRUE(read_until(device, is_lost).lost) << "not before it is asked";
    device.ask_to_reopen();
    read_until(device, reopened);
    EXPECT_EQ(device.reopen_trouble(), "");
    EXPECT_TRUE(is_well(read_until(device, is_well)));
  }
}

TEST(Guard, ReopeningSwitchesForcesOffFirst) {
  Stage stage;
  GuardSettings settings = no_rights();
  settings.silence = 60;  // only what is asked for
  GuardedDevice device([&] { return std::make_unique<Plug>(stage); }, settings);
  const auto command = [&](double force) {
    const std::uint32_t before = stage.shared->record.count;
    device.write({0, 0, force}, Vec3(0));
    while (stage.shared->record.count == before) nap(1);
    return stage.shared->record.last_force();
  };
  command(0);
  EXPECT_EQ(command(1), 1);
  device.ask_to_reopen();
  while (device.reopening()) nap(1);
  EXPECT_EQ(stage.shared->record.last_force(), 0);
  EXPECT_EQ(command(0), 0);
  EXPECT_EQ(command(1), 0) << "the runner has not yet heard of it";
}

}  // namespace
}  // namespace palpate::runner::safety
