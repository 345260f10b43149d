#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <memory>

#include "runner/devices/falcon/driver.h"
#include "runner/devices/falcon/falcon.h"
#include "tests/runner/devices/falcon/emulator.h"
#include "tests/runner/devices/falcon/fake_transport.h"

namespace palpate::runner::devices::falcon {
namespace {

using testing::Emulator;
using testing::FakeTransport;

constexpr std::int64_t kTick = 1'000'000;

struct Bench {
  Emulator emulator;
  FakeTransport* line = nullptr;
  std::unique_ptr<FalconDriver> driver;

  explicit Bench(bool homed = true, const Vec3& at = kCentre) {
    emulator.preload(homed);
    emulator.place(at);
    auto transport = std::make_unique<FakeTransport>(emulator);
    line = transport.get();
    line->control(request::kLatency, 1);
    driver = std::make_unique<FalconDriver>(std::move(transport), DriverSettings{});
  }
  /// One tick of a servo that renders `force` of the position.
  template <class Force>
  const DriverReading& tick(Force force) {
    line->wait(kTick);
    const DriverReading& reading = driver->update();
    driver->push(force(reading.position));
    return reading;
  }
  const DriverReading& tick() {
    return tick([](const Vec3&) { return Vec3(0); });
  }
  Vec3 true_position() const { return to_world(emulator.position() - kCentre); }
};

TEST(FalconDriver, ReadsThePositionOfTheGrip) {
  for (const Vec3& at : {kCentre, Vec3(0.02, -0.03, 0.14), Vec3(-0.03, 0.01, 0.11)}) {
    Bench bench(true, at);
    bench.emulator.plant.hand = [at](double) { return at; };
    const DriverReading& reading = bench.tick();
    EXPECT_EQ(reading.trouble, servo::DeviceTrouble::none);
    EXPECT_LT(glm::length(reading.position - to_world(at - kCentre)), 5e-5);  // a count
  }
}

TEST(FalconDriver, FollowsAHand) {
  Bench bench;
  bench.emulator.plant.hand_stiffness = 400;
  bench.emulator.plant.hand = [](double t) {
    return kCentre + Vec3(0.03 * std::sin(9 * t), 0.02 * std::sin(7 * t), 0.02 * std::sin(5 * t));
  };
  double worst = 0, farthest = 0;
  for (int i = 0; i < 3000; ++i) {
    const Vec3 before = bench.true_position();
    const DriverReading& reading = bench.tick();
    ASSERT_EQ(reading.trouble, servo::DeviceTrouble::none);
    worst = std::max(worst, glm::length(reading.position - before));
    farthest = std::max(farthest, glm::length(reading.position));
  }
  EXPECT_GT(farthest, 0.02);
  EXPECT_LT(worst, 1.2e-3);  // one tick old, and a count
  EXPECT_EQ(bench.driver->counts().late, 0U);
}

TEST(FalconDriver, CommandsTheWantedForce) {
  for (const Vec3& force : {Vec3(1, 0, 0), Vec3(0, 2, 0), Vec3(0, 0, -1.5), Vec3(1, -1, 1)}) {
    Bench bench;
    bench.emulator.plant.hand_stiffness = 2000;  // holds it there
    for (int i = 0; i < 5; ++i) bench.tick([&](const Vec3&) { return force; });
    EXPECT_LT(glm::length(to_world(bench.emulator.force()) - force), 0.03)
        << force.x << ' ' << force.y << ' ' << force.z;
  }
}

TEST(FalconDriver, ASaturatedForceKeepsItsDirection) {
  Bench bench;
  bench.emulator.plant.hand_stiffness = 50000;
  bench.emulator.plant.hand_damping = 200;
  const Vec3 wanted(30, -20, 10);
  for (int i = 0; i < 5; ++i) bench.tick([&](const Vec3&) { return wanted; });
  const Vec3 shown = to_world(bench.emulator.force());
  EXPECT_EQ(bench.emulator.largest_count(), kMaxCount);
  EXPECT_GT(bench.driver->counts().saturated, 0U);
  EXPECT_GT(glm::dot(glm::normalize(shown), glm::normalize(wanted)), 0.99999);
  EXPECT_LT(glm::length(shown), glm::length(wanted));
  EXPECT_GT(glm::length(shown), guaranteed_force(kCountsPerTorque));
}

TEST(FalconDriver, AForceThatIsNotFiniteIsZero) {
  Bench bench;
  for (const double bad :
       {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    for (int i = 0; i < 3; ++i) bench.tick([&](const Vec3&) { return Vec3(0, bad, 1); });
  }
  EXPECT_EQ(bench.emulator.largest_count(), 0);
}

TEST(FalconDriver, AWallHoldsTheHand) {
  Bench bench;
  // World z is up: a floor at z = -5 mm, the hand wants to go 30 mm below it.
  bench.emulator.plant.hand = [](double) { return kCentre + from_world({0, 0, -0.03}); };
  double lowest = 0, strongest = 0;
  const auto floor = [](const Vec3& p) {
    return Vec3(0, 0, p.z < -0.005 ? 1000 * (-0.005 - p.z) : 0);
  };
  for (int i = 0; i < 2000; ++i) {
    const DriverReading& reading = bench.tick(floor);
    lowest = std::min(lowest, reading.position.z);
    strongest = std::max(strongest, floor(reading.position).z);
  }
  // At rest: 80 N/m * (30 mm - x) = 1000 N/m * (x - 5 mm).
  const double rest = -(80 * 0.03 + 1000 * 0.005) / 1080;
  EXPECT_NEAR(bench.driver->reading().position.z, rest, 2e-4);
  EXPECT_NEAR(bench.true_position().z, rest, 2e-4);
  EXPECT_GT(lowest, -0.02);
  EXPECT_GT(strongest, 1.5);
}

TEST(FalconDriver, NoForceBeforeAllAxesAreHomed) {
  Bench bench(false);
  bench.emulator.plant.hand_stiffness = 400;
  bench.emulator.plant.hand_damping = 20;
  EXPECT_EQ(bench.driver->reading().trouble, servo::DeviceTrouble::not_homed);
  // Fully out, then in: each axis passes its index at its own time.
  bench.emulator.plant.hand = [](double t) {
    return kCentre + Vec3(0.01, 0.012, 0.035 * std::sin(4 * t));
  };
  bool some = false;
  int ticks = 0;
  for (; bench.emulator.homed() != 7 && ticks < 3000; ++ticks) {
    EXPECT_NE(bench.tick([](const Vec3&) { return Vec3(1, 1, 1); }).trouble,
              servo::DeviceTrouble::none);
    EXPECT_EQ(bench.emulator.leds(), 8U);  // red
    some = some || (bench.emulator.homed() != 0 && bench.emulator.homed() != 7);
  }
  EXPECT_TRUE(some) << "no axis was homed alone: the test does not provoke what it means to";
  EXPECT_LT(ticks, 3000);
  EXPECT_FALSE(bench.emulator.torque_before_homing());
  for (int i = 0; i < 5; ++i) bench.tick([](const Vec3&) { return Vec3(1, 1, 1); });
  EXPECT_EQ(bench.driver->reading().trouble, servo::DeviceTrouble::none);
  EXPECT_EQ(bench.emulator.leds(), 2U);  // green
  EXPECT_FALSE(bench.emulator.torque_is_zero());
}

TEST(FalconDriver, LostHomingGivesZeroForce) {
  Bench bench;
  const auto push = [](const Vec3&) { return Vec3(0, 0, 2); };
  for (int i = 0; i < 20; ++i) bench.tick(push);
  EXPECT_FALSE(bench.emulator.torque_is_zero());
  bench.emulator.lose_homing();
  // One tick notices it, the next sends zero.
  for (int i = 0; i < 3; ++i) bench.tick(push);
  EXPECT_EQ(bench.driver->reading().trouble, servo::DeviceTrouble::not_homed);
  EXPECT_TRUE(bench.emulator.torque_is_zero());
}

TEST(FalconDriver, SilenceIsDetected) {
  Bench bench;
  bench.emulator.faults.silent = true;
  EXPECT_EQ(bench.tick().trouble, servo::DeviceTrouble::none);
  for (int i = 0; i < 20; ++i) EXPECT_EQ(bench.tick().trouble, servo::DeviceTrouble::late) << i;
  for (int i = 0; i < 10; ++i) bench.tick();
  EXPECT_EQ(bench.driver->reading().trouble, servo::DeviceTrouble::silent);
  EXPECT_GT(bench.driver->counts().late, 10U);
  EXPECT_GT(bench.driver->counts().resent, 3U);
  bench.emulator.faults.silent = false;
  for (int i = 0; i < 10; ++i) bench.tick();
  EXPECT_EQ(bench.driver->reading().trouble, servo::DeviceTrouble::none);
}

TEST(FalconDriver, ToleratesSplitShortAndLateReplies) {
  Bench bench;
  bench.emulator.plant.hand_stiffness = 400;
  bench.emulator.plant.hand = [](double t) { return kCentre + Vec3(0, 0, 0.02 * std::sin(5 * t)); };
  bench.emulator.faults.short_every = 37;
  bench.emulator.faults.split_every = 11;
  bench.emulator.faults.late_every = 53;
  for (int i = 0; i < 3000; ++i) ASSERT_TRUE(bench.tick().usable()) << i;
  EXPECT_GT(bench.driver->counts().malformed, 30U);
  EXPECT_GT(bench.driver->counts().resent, 30U);
  EXPECT_GT(bench.driver->counts().late, 100U);
  EXPECT_EQ(bench.driver->counts().implausible, 0U);
  EXPECT_EQ(bench.emulator.malformed(), 0U);
}

TEST(FalconDriver, APositionThatJumpsIsImplausible) {
  Bench bench;
  bench.tick();
  const Vec3 before = bench.driver->reading().position;
  bench.emulator.place(kCentre + Vec3(0.03, 0, 0));
  bench.emulator.plant.hand = [](double) { return kCentre + Vec3(0.03, 0, 0); };
  bench.tick();
  for (int i = 0; i < 3; ++i) {
    const DriverReading& reading = bench.tick();
    EXPECT_EQ(reading.trouble, servo::DeviceTrouble::late);
    EXPECT_EQ(reading.position, before);
  }
  bool lost = false;
  for (int i = 0; i < 10; ++i)
    lost = lost || bench.tick().trouble == servo::DeviceTrouble::implausible;
  EXPECT_TRUE(lost);
  EXPECT_GE(bench.driver->counts().implausible, 4U);
}

TEST(FalconDriver, UnpluggedAndReopened) {
  Bench bench;
  const auto push = [](const Vec3&) { return Vec3(0, 0, 2); };
  for (int i = 0; i < 5; ++i) bench.tick(push);
  bench.line->unplugged = true;
  EXPECT_EQ(bench.tick(push).trouble, servo::DeviceTrouble::unplugged);
  EXPECT_FALSE(bench.driver->halt());
  EXPECT_THROW(bench.driver->reopen(), TransportError);
  bench.line->unplugged = false;
  bench.driver->reopen();
  EXPECT_EQ(bench.line->reopened, 1);
  bench.driver->reopen();
  EXPECT_EQ(bench.line->reopened, 1) << "one that is well is left alone";
  EXPECT_EQ(bench.driver->reading().trouble, servo::DeviceTrouble::none);
  EXPECT_TRUE(bench.emulator.torque_is_zero());  // restart leaves no torque
}

TEST(FalconDriver, LeavesTheMotorsWithoutTorque) {
  for (const int fault : {0, 1, 2}) {
    Bench bench;
    for (int i = 0; i < 5; ++i) bench.tick([](const Vec3&) { return Vec3(0, 0, 3); });
    ASSERT_FALSE(bench.emulator.torque_is_zero());
    bench.emulator.faults.short_every = fault == 1 ? 1 : 0;
    bench.emulator.faults.silent = fault == 2;
    bench.driver.reset();
    EXPECT_TRUE(bench.emulator.torque_is_zero()) << fault;
  }
}

TEST(FalconDriver, ReadsTheButtons) {
  Bench bench;
  bench.emulator.buttons = 0b0101;
  bench.tick();
  EXPECT_EQ(bench.tick().buttons, 0b0101);
}

TEST(FalconDevice, SensesThreeDegreesOfFreedom) {
  Emulator emulator;
  emulator.preload(true);
  emulator.plant.hand_stiffness = 2000;
  auto transport = std::make_unique<FakeTransport>(emulator);
  FakeTransport& line = *transport;
  line.control(request::kLatency, 1);
  FalconDevice device(std::make_unique<FalconDriver>(std::move(transport), DriverSettings{}));
  EXPECT_EQ(device.capabilities().name, "falcon");
  EXPECT_EQ(device.capabilities().sensed_freedom, 3);
  EXPECT_GT(device.capabilities().max_force, 2);
  EXPECT_LT(device.capabilities().max_force, 6.2);
  for (int i = 0; i < 4; ++i) {
    line.wait(kTick);
    const servo::DeviceReading reading = device.read();
    EXPECT_FALSE(reading.lost);
    EXPECT_EQ(reading.stylus.tip, reading.stylus.tail);
    device.write({1, 0, 0}, {0, 0, 1});
  }
  EXPECT_LT(glm::length(to_world(emulator.force()) - Vec3(1, 0, 1)), 0.03);
}

}  // namespace
}  // namespace palpate::runner::devices::falcon
