// The driver against emulated Falcons through the real libusb.

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <glm/geometric.hpp>
#include <memory>
#include <string>
#include <thread>

#include "runner/devices/falcon/boot.h"
#include "runner/devices/falcon/driver.h"
#include "runner/devices/falcon/usb.h"
#include "tests/runner/devices/falcon/emulated_bus.h"
#include "tests/runner/devices/falcon/preload.h"

namespace palpate::runner::devices::falcon {
namespace {

using testing::EmulatedBus;
using testing::Emulator;
using testing::synthetic_image;

std::string open_failure(const std::string& serial) {
  try {
    open_usb(serial);
  } catch (const TransportError& error) {
    return error.what();
  }
  return "";
}

/// Ticks of at least a millisecond, until `done` or the given number.
template <class Force, class Done>
int run(FalconDriver& driver, int ticks, Force force, Done done) {
  auto due = std::chrono::steady_clock::now();
  for (int i = 0; i < ticks; ++i) {
    due += std::chrono::milliseconds(1);
    std::this_thread::sleep_until(due);
    const DriverReading& reading = driver.update();
    driver.push(force(reading.position));
    if (done()) return i;
  }
  return ticks;
}
constexpr auto kNoForce = [](const Vec3&) { return Vec3(0); };
constexpr auto kNever = [] { return false; };

struct ReadyArm {
  EmulatedBus bus;
  std::unique_ptr<FalconDriver> driver;
  explicit ReadyArm(bool homed = true) {
    bus.add("FALCON01");
    bus.with(0, [homed](Emulator& emulator) { emulator.preload(homed); });
    auto line = open_usb("");
    boot(*line, nullptr);
    DriverSettings settings;
    settings.silence_ns = 500'000'000;  // a busy machine and the mocked node are slow
    driver = std::make_unique<FalconDriver>(std::move(line), settings);
  }
};

TEST(FalconUsb, ListsConnectedDevices) {
  EmulatedBus bus;
  EXPECT_TRUE(list_usb().empty());
  bus.add("FALCON01");
  bus.add("FALCON02");
  const auto list = list_usb();
  ASSERT_EQ(list.size(), 2U);
  EXPECT_EQ(std::min(list[0].serial, list[1].serial), "FALCON01");
  EXPECT_EQ(std::max(list[0].serial, list[1].serial), "FALCON02");
  EXPECT_EQ(list[0].trouble, "");
  EXPECT_EQ(list[0].bus, 1);
}

TEST(FalconUsb, OpensTheNamedDevice) {
  EmulatedBus bus;
  EXPECT_NE(open_failure("").find("no Falcon is plugged in"), std::string::npos);
  bus.add("FALCON01");
  bus.add("");
  EXPECT_EQ(open_usb("FALCON01")->serial(), "FALCON01");
  EXPECT_EQ(open_usb("port-1-2")->serial(), "port-1-2");
  const std::string several = open_failure("");
  EXPECT_NE(several.find("several Falcons"), std::string::npos) << several;
  EXPECT_NE(several.find("FALCON01"), std::string::npos) << several;
  const std::string missing = open_failure("FALCON09");
  EXPECT_NE(missing.find("no Falcon FALCON09 is plugged in"), std::string::npos) << missing;
  EXPECT_NE(missing.find("there is FALCON01"), std::string::npos) << missing;
}

TEST(FalconUsb, ADeviceClaimedByAnotherProgramIsReported) {
  EmulatedBus bus;
  bus.add("FALCON01");
  bus.hold(0, true);
  EXPECT_NE(open_failure("").find("another program holds it"), std::string::npos);
  bus.hold(0, false);
  const auto first = open_usb("");
  EXPECT_NE(open_failure("").find("another program holds it"), std::string::npos);
}

TEST(FalconUsb, WithoutPermissionTheErrorGivesTheUdevRule) {
  const std::string text = usb_error("cannot open the Falcon", -3);
  EXPECT_NE(text.find("/etc/udev/rules.d/"), std::string::npos);
  EXPECT_NE(text.find("ATTR{idProduct}==\"cb48\""), std::string::npos);
}

TEST(FalconUsb, UploadsFirmwareInSpiteOfLostAndWrongEchoes) {
  EmulatedBus bus;
  bus.add("FALCON01");
  bus.with(0, [](Emulator& emulator) {
    emulator.faults.lost_echoes = 1;
    emulator.faults.wrong_echoes = 1;
    emulator.faults.stray_byte = true;
  });
  const FirmwareImage image = parse_image(synthetic_image(300), "made up");
  const auto line = open_usb("");
  BootSettings settings;
  settings.packet_probes = 2;
  EXPECT_FALSE(firmware_runs(*line, settings));
  boot(*line, &image, settings);
  bus.with(0, [&image, &settings](Emulator& emulator) {
    EXPECT_EQ(emulator.mode(), Emulator::Mode::run);
    EXPECT_EQ(emulator.image(), image.bytes);
    // On a busy machine an echo may be late as well, and counts as lost.
    EXPECT_GE(emulator.uploads(), 3);
    EXPECT_LE(emulator.uploads(), settings.uploads);
    EXPECT_EQ(emulator.latency_ms(), 1);
  });
}

TEST(FalconUsb, HomesAndHoldsAWall) {
  ReadyArm bench(false);
  FalconDriver& driver = *bench.driver;
  EXPECT_EQ(driver.reading().trouble, servo::DeviceTrouble::not_homed);
  bench.bus.with(0, [](Emulator& emulator) {
    emulator.plant.hand_stiffness = 400;
    emulator.plant.hand_damping = 20;
    emulator.plant.hand = [](double t) { return kCentre + Vec3(0, 0, 0.035 * std::sin(6 * t)); };
  });
  const auto push = [](const Vec3&) { return Vec3(1, 1, 1); };
  EXPECT_LT(run(driver, 5000, push,
                [&] { return driver.reading().trouble == servo::DeviceTrouble::none; }),
            5000);
  bench.bus.with(0, [](Emulator& emulator) {
    EXPECT_FALSE(emulator.torque_before_homing());
    emulator.plant.hand_stiffness = 80;
    emulator.plant.hand_damping = 6;
    emulator.plant.hand = [](double) { return kCentre + from_world({0, 0, -0.03}); };
  });
  run(driver, 1000, kNoForce, [&] { return driver.reading().position.z < -0.01; });
  const auto floor = [](const Vec3& p) {
    return Vec3(0, 0, p.z < -0.005 ? 400 * (-0.005 - p.z) : 0);
  };
  run(driver, 1500, floor, kNever);
  const double rest = -(80 * 0.03 + 400 * 0.005) / 480;
  EXPECT_NEAR(driver.reading().position.z, rest, 1e-3);
  bench.bus.with(0, [rest](Emulator& emulator) {
    EXPECT_NEAR(to_world(emulator.position() - kCentre).z, rest, 1e-3);
    EXPECT_GT(to_world(emulator.force()).z, 1);
    EXPECT_EQ(emulator.malformed(), 0U);
  });
  bench.driver.reset();
  EXPECT_TRUE(bench.bus.read(0, &Emulator::torque_is_zero));
}

TEST(FalconUsb, ToleratesSplitShortAndLateReplies) {
  ReadyArm bench;
  bench.bus.with(0, [](Emulator& emulator) {
    emulator.faults.short_every = 23;
    emulator.faults.split_every = 11;
    emulator.faults.late_every = 31;
  });
  int lost = 0;
  run(*bench.driver, 600, kNoForce, [&] {
    lost += bench.driver->reading().usable() ? 0 : 1;
    return false;
  });
  EXPECT_EQ(lost, 0);
  EXPECT_GT(bench.driver->counts().replies, 50U);
  EXPECT_GT(bench.driver->counts().malformed, 0U);
  EXPECT_GT(bench.driver->counts().late, 0U);
  EXPECT_EQ(bench.bus.read(0, &Emulator::malformed), 0U);
}

TEST(FalconUsb, UnpluggedInContactAndPluggedInAgain) {
  ReadyArm bench;
  FalconDriver& driver = *bench.driver;
  const auto push = [](const Vec3&) { return Vec3(0, 0, 2); };
  run(driver, 50, push, kNever);
  EXPECT_TRUE(driver.reading().usable());
  EXPECT_FALSE(bench.bus.read(0, &Emulator::torque_is_zero));
  bench.bus.unplug(0);
  EXPECT_LT(run(driver, 200, push,
                [&] { return driver.reading().trouble == servo::DeviceTrouble::unplugged; }),
            200);
  EXPECT_FALSE(driver.halt());
  EXPECT_THROW(driver.reopen(), TransportError);
  bench.bus.plug(0);
  bool open = false;
  for (int i = 0; i < 200 && !open; ++i) {  // events of the bus take a moment
    try {
      driver.reopen();
      open = true;
    } catch (const TransportError&) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
  }
  ASSERT_TRUE(open);
  EXPECT_EQ(driver.reading().trouble, servo::DeviceTrouble::none);
  EXPECT_TRUE(bench.bus.read(0, &Emulator::torque_is_zero));
}

TEST(FalconUsb, PluggingAndUnpluggingIsDetected) {
  EmulatedBus bus;
  bus.add("FALCON01");
  const auto watch = listen_for_hotplug();
  EXPECT_EQ(watch->arrived(), 1);
  const auto poll = [&watch] {
    for (int i = 0; i < 10; ++i) watch->poll(20'000'000);
  };
  bus.unplug(0);
  poll();
  EXPECT_EQ(watch->left(), 1);
  bus.plug(0);
  poll();
  EXPECT_EQ(watch->arrived(), 2);
}

TEST(FalconUsb, TwoDevicesWorkAtOnce) {
  EmulatedBus bus;
  for (const char* serial : {"TIP", "TAIL"}) {
    const int index = bus.add(serial);
    bus.with(index, [](Emulator& emulator) { emulator.preload(true); });
  }
  std::vector<std::unique_ptr<FalconDriver>> drivers;
  drivers.reserve(2);
  for (const char* serial : {"TIP", "TAIL"}) {
    auto line = open_usb(serial);
    boot(*line, nullptr);
    DriverSettings settings;
    settings.silence_ns = 500'000'000;
    drivers.push_back(std::make_unique<FalconDriver>(std::move(line), settings));
  }
  run(
      *drivers[0], 50, [](const Vec3&) { return Vec3(0, 0, 1); },
      [&] {
        drivers[1]->update();
        drivers[1]->push({0, 0, -1});
        return false;
      });
  bus.with(0, [](Emulator& emulator) { EXPECT_NEAR(to_world(emulator.force()).z, 1, 0.1); });
  bus.with(1, [](Emulator& emulator) { EXPECT_NEAR(to_world(emulator.force()).z, -1, 0.1); });
}

}  // namespace
}  // namespace palpate::runner::devices::falcon

int main(int argc, char** argv) {
  if (!palpate::runner::devices::falcon::testing::rerun_preloaded(argv)) return 1;
  ::testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
