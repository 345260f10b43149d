// The servo in its own thread: every sample in order, and no thread waits for another.

#include "runner/servo/servo_thread.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <glm/geometric.hpp>
#include <limits>
#include <thread>

#include "runner/servo/realtime.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/primitives.h"
#include "tests/runner/fake_device.h"

namespace palpate::runner::servo {
namespace {

using runner::testing::FakeDevice;

rendering::Scene cube_scene() {
  return rendering::Scene({{std::make_shared<const stimuli::ConvexMesh>(stimuli::cube(0.06)),
                            Pose{}, stimuli::Material{}, 0, nullptr}},
                          false);
}

DeviceReading stylus_at(double z) { return {{{0, 0, z}, {0, 0, z + 0.12}}, 0, false}; }

/// Virtual time with a short real sleep in each tick: a busy machine makes no tick late.
class UnhurriedClock final : public Clock {
 public:
  std::int64_t now_ns() noexcept override { return now_; }
  void wait_until(std::int64_t when_ns) noexcept override {
    std::this_thread::sleep_for(std::chrono::microseconds(200));
    now_ = std::max(now_, when_ns);
  }

 private:
  std::int64_t now_ = 0;
};

const RealtimeSettings kNoRights{0, false, -1};

ServoSettings fast(std::size_t ring = 1 << 15) {
  ServoSettings settings;
  settings.rate = 2000;
  settings.realtime = kNoRights;
  settings.ring = ring;
  return settings;
}

HomeZone quick_home() { return {0.062, 0.01, 0.005}; }

/// Moves from the home zone into the cube when the session is ready.
FakeDevice falling_device() {
  return FakeDevice([](int tick) { return stylus_at(std::max(0.029, 0.1 - 1e-4 * tick / 4)); });
}

TEST(ServoThread, EverySampleArrivesInOrderWhateverTheSessionDoes) {
  FakeDevice device([](int) { return stylus_at(0.1); });
  UnhurriedClock clock;
  ServoThread servo(device, clock, fast());
  servo.prepare(cube_scene(), rendering::point_renderer(), quick_home());
  std::uint32_t expected = 0;
  for (int i = 0; i < 1000; ++i) {
    if (i == 500) std::this_thread::sleep_for(std::chrono::milliseconds(300));
    const Sample& sample = servo.next();
    if (sample.phase != Phase::feeling) continue;
    ASSERT_EQ(sample.tick, expected++);
    ASSERT_GE(sample.lateness_ns, 0);
    ASSERT_GE(sample.compute_ns, 0);
  }
  EXPECT_GT(expected, 900u);
  const ServoQuality quality = servo.stop();
  EXPECT_GE(quality.ticks, expected);
  EXPECT_EQ(servo.health().lost_samples(), 0u);
  EXPECT_EQ(quality.faults & servo_fault::kSamplesLost, 0u);
}

TEST(ServoThread, TicksFollowTheMachinesClock) {
  FakeDevice device([](int) { return stylus_at(0.1); });
  RealClock clock;
  ServoThread servo(device, clock, fast());
  Sample first;
  while (!servo.latest(first)) std::this_thread::yield();
  while (servo.health().ticks() < 400) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  Sample newest;
  ASSERT_TRUE(servo.latest(newest));
  const std::int64_t periods = (newest.time_ns - first.time_ns) / 500'000;
  const auto counted =
      static_cast<std::int64_t>(servo.health().ticks() + servo.health().missed_ticks());
  const std::string text = to_json_text(servo.health(), 2000);
  EXPECT_NE(text.find("\"missed_ticks\""), std::string::npos) << text;
  EXPECT_LE(periods, counted + 1) << "a period without a tick is counted as missed";
  EXPECT_GT(periods, 0);
}

TEST(ServoThread, TicksAndMissedTicksAddUpToTheElapsedTime) {
  FakeDevice device([](int tick) {
    if (tick % 50 == 0) std::this_thread::sleep_for(std::chrono::microseconds(1700));
    return stylus_at(0.1);
  });
  RealClock clock;
  const std::int64_t before = clock.now_ns();
  TimeKept kept;
  {
    ServoThread servo(device, clock, fast());
    while (servo.health().ticks() < 300) {
      std::this_thread::sleep_for(std::chrono::milliseconds(3));
      kept = servo.health().time_kept();
      if (kept.ticks == 0) continue;
      ASSERT_EQ(kept.elapsed_ns / 500'000,
                static_cast<std::int64_t>(kept.ticks - 1 + kept.missed_ticks));
    }
  }
  EXPECT_GE(kept.missed_ticks, 2 * (kept.ticks / 50)) << "more than three periods each time";
  EXPECT_GT(kept.elapsed_ns, 0);
  EXPECT_LT(kept.elapsed_ns, clock.now_ns() - before);
}

TEST(ServoThread, ItsTicksStayAwayFromTheKernels) {
  for (const std::int64_t start_ns : {500'000'000, 500'100'000, 500'250'000, 500'499'999}) {
    FakeDevice device([](int) { return stylus_at(0.1); });
    UnhurriedClock clock;
    clock.wait_until(start_ns);
    ServoThread servo(device, clock, fast());
    servo.prepare(cube_scene(), rendering::point_renderer(), quick_home());
    for (int i = 0; i < 20; ++i) {
      const Sample& sample = servo.next();
      const std::int64_t due = sample.time_ns - sample.lateness_ns;
      ASSERT_GT(due, start_ns - 250'000);
      ASSERT_GE(due % 500'000, 125'000);
      ASSERT_LE(due % 500'000, 375'000);
    }
  }
}

TEST(ServoThread, AFullRingIsARecordedFaultAndTheServoContinues) {
  FakeDevice device([](int) { return stylus_at(0.1); });
  UnhurriedClock clock;
  ServoThread servo(device, clock, fast(64));
  servo.prepare(cube_scene(), rendering::point_renderer(), quick_home());
  Sample newest;
  while (!servo.latest(newest) || newest.tick < 500)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  std::uint32_t faults = 0;
  for (int i = 0; i < 64 + 1; ++i) faults |= servo.next().faults;
  EXPECT_TRUE(faults & servo_fault::kSamplesLost) << "the first sample after the gap says so";
  EXPECT_FALSE(faults & servo_fault::kTripped);
  EXPECT_TRUE(servo.stop().faults & servo_fault::kSamplesLost);
  EXPECT_GT(servo.health().lost_samples(), 300u);
}

TEST(ServoThread, AStalledDisplayHasNoEffect) {
  FakeDevice device([](int) { return stylus_at(0.1); });
  UnhurriedClock clock;
  ServoThread servo(device, clock, fast(1 << 16));
  servo.prepare(cube_scene(), rendering::point_renderer(), quick_home());
  std::atomic<bool> done{false};
  std::uint64_t during_stalls = 0;
  std::jthread display([&] {
    Sample seen;
    std::uint32_t last = 0;
    while (!done) {
      const std::uint64_t before = servo.health().ticks();
      std::this_thread::sleep_for(std::chrono::milliseconds(700));
      during_stalls = std::max(during_stalls, servo.health().ticks() - before);
      if (!servo.latest(seen) || seen.phase != Phase::feeling) continue;
      EXPECT_GT(seen.tick, last) << "newer than the last one, and whole";
      EXPECT_EQ(seen.probe.tip.z, 0.1);
      last = seen.tick;
    }
  });
  std::uint32_t expected = 0;
  const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(2200);
  while (std::chrono::steady_clock::now() < end) {
    const Sample& sample = servo.next();
    if (sample.phase != Phase::feeling) continue;
    ASSERT_EQ(sample.tick, expected++) << "none is missing for the display's sake";
  }
  done = true;
  display.join();
  EXPECT_GT(during_stalls, 100u);
  EXPECT_EQ(servo.health().lost_samples(), 0u);
}

TEST(ServoThread, StopsAndBeginsAgain) {
  FakeDevice device([](int) { return stylus_at(0.1); });
  UnhurriedClock clock;
  ServoThread servo(device, clock, fast());
  for (int trial = 0; trial < 5; ++trial) {
    servo.prepare(cube_scene(), rendering::point_renderer(), quick_home());
    EXPECT_EQ(servo.next().phase, Phase::homing) << "nothing is left of the trial before";
    while (servo.next().phase != Phase::feeling) {
    }
    if (trial == 2) continue;  // the next prepare stops it
    EXPECT_GT(servo.stop().ticks, 0u);
  }
}

TEST(ServoThread, EmergencyZeroHoldsUntilCleared) {
  FakeDevice device = falling_device();
  UnhurriedClock clock;
  ServoThread servo(device, clock, fast());
  servo.prepare(cube_scene(), rendering::point_renderer(), quick_home());
  while (glm::length(servo.next().device1) < 0.75) {
  }
  EXPECT_FALSE(servo.forces_are_off());
  servo.emergency_zero();
  while (!(servo.next().faults & servo_fault::kEmergency)) {
  }
  EXPECT_TRUE(servo.forces_are_off());
  for (int i = 0; i < 100; ++i) {
    const Sample& sample = servo.next();
    ASSERT_EQ(sample.device1, Vec3(0));
    ASSERT_NEAR(sample.rendering.device1.z, 0.8, 1e-9) << "what was rendered is on record beside";
  }
  servo.stop();
  servo.prepare(cube_scene(), rendering::point_renderer(), quick_home());
  EXPECT_TRUE(servo.next().faults & servo_fault::kTripped) << "a new trial does not clear it";
  servo.clear_fault();
  while (servo.next().faults & servo_fault::kTripped) {
  }
}

// A failure in the servo's thread cannot wait for it; one in another thread must.
TEST(ServoThread, KnowsWhetherTheCallerIsItsThread) {
  std::atomic<const ServoThread*> servo_now{nullptr};
  std::atomic<int> asked_inside{0}, answered_yes{0};
  FakeDevice device([&](int) {
    if (const ServoThread* const servo = servo_now) {
      ++asked_inside;
      answered_yes += servo->in_this_thread();
    }
    return stylus_at(0.1);
  });
  UnhurriedClock clock;
  ServoThread servo(device, clock, fast());
  servo_now = &servo;
  while (asked_inside < 3) std::this_thread::yield();
  EXPECT_FALSE(servo.in_this_thread());
  servo_now = nullptr;
  servo.prepare(cube_scene(), rendering::point_renderer(), quick_home());
  servo.next();
  EXPECT_EQ(answered_yes, asked_inside);
}

/// Blocks the servo in its transfer until released.
class HangingDevice final : public Device {
 public:
  explicit HangingDevice(int motors = 5) { capabilities_.actuated_freedom = motors; }
  const DeviceCapabilities& capabilities() const override { return capabilities_; }
  DeviceReading read() noexcept override {
    hangs.wait(true);
    return stylus_at(0.1);
  }
  void write(const Vec3&, const Vec3&) noexcept override {}
  std::atomic<bool> hangs{false};

 private:
  DeviceCapabilities capabilities_{"hanging", 5, 5, 8, 3000, 2000, 0.2, 0, true};
};

TEST(ServoThread, AHangingDeviceEndsTheTrialNotTheSession) {
  HangingDevice device;
  UnhurriedClock clock;
  ServoThread servo(device, clock, fast());
  servo.prepare(cube_scene(), rendering::point_renderer(), quick_home());
  while (servo.next().phase != Phase::feeling) {
  }
  device.hangs = true;
  std::uint32_t faults = 0;
  while (!(faults & servo_fault::kTripped)) faults = servo.next().faults;
  EXPECT_TRUE(faults & servo_fault::kStalled);
  EXPECT_TRUE(servo.stop().faults & servo_fault::kStalled);
  device.hangs = false;
  device.hangs.notify_all();
}

TEST(ServoThread, WithoutMotorsASilenceOf1500MsIsTolerated) {
  HangingDevice device(0);
  UnhurriedClock clock;
  ServoThread servo(device, clock, fast());
  servo.prepare(cube_scene(), rendering::point_renderer(), quick_home());
  while (servo.next().phase != Phase::feeling) {
  }
  device.hangs = true;
  std::jthread later([&device] {
    std::this_thread::sleep_for(std::chrono::milliseconds(1500));
    device.hangs = false;
    device.hangs.notify_all();
  });
  std::uint32_t faults = 0;
  while (device.hangs) faults |= servo.next().faults;
  for (int i = 0; i < 100; ++i) faults |= servo.next().faults;
  EXPECT_EQ(faults & (servo_fault::kStalled | servo_fault::kTripped), 0u);
  EXPECT_EQ(servo.stop().faults & servo_fault::kStalled, 0u);
}

TEST(TimeHistogram, QuantilesAreWithinAnEighth) {
  TimeHistogram histogram;
  for (std::int64_t ns = 1; ns <= 100'000; ++ns) histogram.add(ns);
  EXPECT_EQ(histogram.count(), 100'000u);
  EXPECT_EQ(histogram.longest(), 100'000);
  for (const double p : {0.001, 0.5, 0.99, 0.999}) {
    const auto exact = static_cast<std::int64_t>(p * 100'000);
    EXPECT_GE(histogram.quantile(p), exact);
    EXPECT_LE(histogram.quantile(p), exact + exact / 8 + 1);
  }
  EXPECT_EQ(histogram.quantile(1), 100'000);
  EXPECT_NEAR(histogram.fraction_above(50'000), 0.5, 0.07);
  std::uint64_t counted = 0;
  for (const auto& [up_to, count] : histogram.steps()) counted += count;
  EXPECT_EQ(counted, 100'000u);
  histogram.add(-5);  // a clock that went back
  histogram.add(std::numeric_limits<std::int64_t>::max());
  EXPECT_EQ(histogram.longest(), std::numeric_limits<std::int64_t>::max());
}

}  // namespace
}  // namespace palpate::runner::servo
