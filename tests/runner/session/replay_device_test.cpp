// A recorded trial played back: poses and buttons in order, at the recorded times, then the device
// is lost.

#include "runner/session/replay_device.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <vector>

#include "runner/session/replay.h"

namespace palpate::runner::session {
namespace {
namespace replaying {

std::vector<data::SampleRecord> three_samples() {
  std::vector<data::SampleRecord> samples(3);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const double at = 0.01 * static_cast<double>(i + 1);
    samples[i].tip = {at, 2 * at, 3 * at};
    samples[i].tail = {at, 2 * at, 3 * at + 0.12};
    samples[i].buttons = static_cast<std::uint8_t>(i);
    samples[i].period_ns = static_cast<std::int64_t>(1'000'000 + 100 * i);
  }
  return samples;
}

TEST(ReplayDevice, GivesSamplesInOrderAndThenIsLost) {
  const auto samples = three_samples();
  ReplayDevice device(samples, 1000);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const servo::DeviceReading reading = device.read();
    EXPECT_FALSE(reading.lost);
    for (int axis = 0; axis < 3; ++axis) {
      const auto k = static_cast<std::size_t>(axis);
      EXPECT_EQ(reading.stylus.tip[axis], samples[i].tip[k]) << i;
      EXPECT_EQ(reading.stylus.tail[axis], samples[i].tail[k]) << i;
    }
    EXPECT_EQ(reading.buttons, samples[i].buttons) << i;
  }
  EXPECT_TRUE(device.read().lost);
  EXPECT_TRUE(device.read().lost);
}

TEST(ReplayDevice, ItsClockFollowsTheRecordedPeriods) {
  const auto samples = three_samples();
  ReplayDevice device(samples, 1000);
  // The period before the first tick is not recorded: the clock jumps to the requested time.
  const std::int64_t begin = device.now_ns();
  device.wait_until(begin + 700'000);
  EXPECT_EQ(device.now_ns(), begin + 700'000);
  device.wait_until(begin);
  EXPECT_EQ(device.now_ns(), begin + 700'000) << "never back";
  device.read();
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const std::int64_t before = device.now_ns();
    device.wait_until(before + 5);
    EXPECT_EQ(device.now_ns() - before, samples[i].period_ns) << i;
    device.read();
  }
  const std::int64_t last = device.now_ns();
  device.wait_until(last + 250'000);
  EXPECT_EQ(device.now_ns(), last + 250'000) << "after the last sample";
}

TEST(ReplayDevice, AMissingPeriodIsTheNominalOne) {
  auto samples = three_samples();
  samples[1].period_ns = 0;
  ReplayDevice device(samples, 1000);
  device.read();
  const std::int64_t before = device.now_ns();
  device.wait_until(before + 1'000'000);
  EXPECT_EQ(device.now_ns(), before + 1'000'000);
}

TEST(ReplayDevice, LimitsNothing) {
  const auto samples = three_samples();
  const ReplayDevice device(samples, 500);
  EXPECT_EQ(device.capabilities().name, "replay");
  EXPECT_EQ(device.capabilities().sensed_freedom, 5);
  EXPECT_EQ(device.capabilities().actuated_freedom, 5);
  EXPECT_GT(device.capabilities().max_force, 1e6);
  EXPECT_GT(device.capabilities().max_stiffness, 1e9);
  EXPECT_EQ(device.capabilities().max_rate, 500);
}

}  // namespace replaying
}  // namespace
}  // namespace palpate::runner::session
