// A session's record of its servo, from known ticks.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "runner/servo/servo_thread.h"

namespace palpate::runner::servo {
namespace {

constexpr std::int64_t kPeriod_ns = 500'000;  // 2 kHz

Sample tick_at(std::int64_t due_ns, std::int64_t lateness_ns, std::int64_t compute_ns) {
  Sample sample;
  sample.time_ns = due_ns + lateness_ns;
  sample.lateness_ns = lateness_ns;
  sample.compute_ns = compute_ns;
  sample.period_ns = kPeriod_ns + lateness_ns;
  return sample;
}

TEST(ServoHealth, TheRecordHasCountsTimesAndFaults) {
  ServoHealth health;
  // 98 ticks in time; then one late by less than a period and one by more than two periods.
  std::int64_t due_ns = 7'000'000;
  for (int i = 0; i < 98; ++i, due_ns += kPeriod_ns) health.add(tick_at(due_ns, 8, 4), kPeriod_ns);
  Sample late = tick_at(due_ns, 400'000, 12);
  late.faults = servo_fault::kForceLimited;
  health.add(late, kPeriod_ns);
  due_ns += kPeriod_ns;
  late = tick_at(due_ns, 1'100'000, 4);
  late.faults = servo_fault::kOldReading;
  health.add(late, kPeriod_ns);
  health.add_lost_sample();
  health.add_lost_sample();

  const auto json = nlohmann::json::parse(to_json_text(health, 2000))["servo"];
  EXPECT_EQ(json["rate_hz"], 2000);
  EXPECT_EQ(json["ticks"], 100);
  EXPECT_EQ(json["missed_ticks"], 2);
  EXPECT_EQ(json["elapsed_ns"], 99 * kPeriod_ns + 1'100'000);
  EXPECT_EQ(json["late_by_a_period_share"], 0.01);
  EXPECT_EQ(json["lost_samples"], 2);
  EXPECT_EQ(json["faults"],
            servo_fault::kForceLimited | servo_fault::kOldReading | servo_fault::kSamplesLost);
  EXPECT_EQ(json["longest_period_ns"], 1'600'000);
  EXPECT_EQ(json["lateness_ns"]["median"], 8);
  EXPECT_EQ(json["lateness_ns"]["max"], 1'100'000);
  EXPECT_EQ(json["compute_ns"]["median"], 4);
  EXPECT_EQ(json["compute_ns"]["p99"], 4);
  EXPECT_EQ(json["compute_ns"]["p99.9"], 12);
  EXPECT_EQ(json["compute_ns"]["max"], 12);
  EXPECT_EQ(json["compute_ns"]["up_to_and_count"], nlohmann::json({{4, 99}, {12, 1}}));
  // Of 100 ticks, 99 were at most as late as the late one: the quantile is within an eighth above
  // it.
  const std::int64_t p99 = json["lateness_ns"]["p99"];
  EXPECT_GE(p99, 400'000);
  EXPECT_LE(p99, 450'000);
}

TEST(ServoHealth, MissesNoTickWhileTheClockStandsStill) {
  ServoHealth health;
  constexpr std::int64_t kNow_ns = 7'000'000;
  for (int i = 0; i < 5; ++i) {  // each tick is due a period later than the clock says
    const std::int64_t due_ns = kNow_ns + i * kPeriod_ns;
    health.add(tick_at(due_ns, kNow_ns - due_ns, 4), kPeriod_ns);
  }
  EXPECT_EQ(health.missed_ticks(), 0u);
}

}  // namespace
}  // namespace palpate::runner::servo
