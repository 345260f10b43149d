#include "runner/session/reach_measures.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "runner/participants/reacher.h"

namespace palpate::runner::session {
namespace {

constexpr double kPeriod = 1e-3, kLength = 0.1, kDuration = 0.5;
const Vec3 kTarget(0, kLength, 0);  // its left is -x
using Along = std::function<Vec3(double)>;

/// The place of a movement of least jerk, 0 to 1.
double least_jerk(double share) {
  const double s = std::clamp(share, 0.0, 1.0);
  return s * s * s * (10 + s * (6 * s - 15));
}

/// A movement of kDuration after 0.2 s at rest, and 0.1 s at rest after it.
/// \param aside, force  by the share of the time
std::vector<data::SampleRecord> movement(const std::function<double(double)>& aside,
                                         const std::function<Vec3(double)>& force) {
  std::vector<data::SampleRecord> out;
  for (int i = 0; i <= 800; ++i) {
    const double share = (i * kPeriod - 0.2) / kDuration;
    data::SampleRecord sample;
    sample.tick = static_cast<std::uint32_t>(i);
    sample.tip = {-aside(share), kLength * least_jerk(share), 0};
    const Vec3 f = force(share);
    sample.force = {f.x, f.y, f.z};
    out.push_back(sample);
  }
  return out;
}

double none(double) { return 0; }
Vec3 no_force(double) { return Vec3(0); }
Vec3 no_field(const data::SampleRecord&, const Vec3&) { return Vec3(0); }
/// b u x v, u = +z.
Vec3 curl(const data::SampleRecord&, const Vec3& v) { return 10.0 * Vec3(-v.y, v.x, 0); }

TEST(ReachMeasures, StraightMovementFollowsLeastJerk) {
  const data::ReachRecord reach = reach_measures(
      movement(none, no_force), protocols::ReachTrial::field, kTarget, kPeriod, no_field);
  EXPECT_EQ(reach.kind, "field");
  // 1.875 times the mean speed, less what a mean over 20 ms takes off the peak.
  EXPECT_NEAR(*reach.peak_speed, 1.875 * kLength / kDuration, 1e-3);
  EXPECT_EQ(*reach.deviation, 0);
  EXPECT_EQ(*reach.largest_deviation, 0);
  EXPECT_NEAR(*reach.path_ratio, 1, 1e-12);
  EXPECT_NEAR(*reach.endpoint_error, 0, 1e-12);
  // 30 s^2 (1 - s)^2 L / T = 0.02 m/s at s = 0.0615; the record ends 0.1 s after the movement.
  EXPECT_NEAR(*reach.duration, (1 - 0.0615) * kDuration + 0.1, 3e-3);
  EXPECT_FALSE(reach.adaptation);
}

TEST(ReachMeasures, DeviationIsPositiveToTheLeft) {
  constexpr double kAside = 0.01;
  const auto half_wave = [](double s) {
    return s > 0 && s < 1 ? kAside * std::sin(std::numbers::pi * s) : 0;
  };
  const data::ReachRecord left = reach_measures(
      movement(half_wave, no_force), protocols::ReachTrial::field, kTarget, kPeriod, no_field);
  // The line begins where the tip began to move, up to 2 mm aside.
  EXPECT_NEAR(*left.deviation, kAside, 2e-3);
  EXPECT_NEAR(*left.largest_deviation, kAside, 2e-3);
  EXPECT_GT(*left.path_ratio, 1.01);
  const auto right = [&](double s) { return -half_wave(s); };
  EXPECT_NEAR(*reach_measures(movement(right, no_force), protocols::ReachTrial::none, kTarget,
                              kPeriod, no_field)
                   .deviation,
              -*left.deviation, 1e-15);
}

TEST(ReachMeasures, SideOfALineIsItsLeft) {
  EXPECT_EQ(participants::side_of({0, 1, 0}), Vec3(-1, 0, 0));
  EXPECT_EQ(participants::side_of({1, 0, 0}), Vec3(0, 1, 0));
  EXPECT_EQ(participants::side_of({0, 0, 1}), Vec3(0, 1, 0));
}

TEST(ReachMeasures, PushOfTheFieldsForceIsAdaptationOne) {
  for (const double share : {0.0, 0.4, 1.0}) {
    std::vector<data::SampleRecord> samples = movement(none, no_force);
    for (std::size_t i = 10; i + 10 < samples.size(); ++i) {
      const double v = (samples[i + 10].tip[1] - samples[i - 10].tip[1]) / 0.02;
      samples[i].force = {share * -10 * v, 0, 0};
    }
    const data::ReachRecord reach =
        reach_measures(samples, protocols::ReachTrial::clamp, kTarget, kPeriod, curl);
    EXPECT_NEAR(*reach.adaptation, share, 1e-12);
    EXPECT_NEAR(*reach.side_force, share * 10 * *reach.peak_speed, 1e-9);
  }
}

TEST(ReachMeasures, AdaptationNeedsAFieldAndAClamp) {
  const auto samples = movement(none, no_force);
  EXPECT_FALSE(
      reach_measures(samples, protocols::ReachTrial::clamp, kTarget, kPeriod, no_field).adaptation);
  EXPECT_FALSE(
      reach_measures(samples, protocols::ReachTrial::field, kTarget, kPeriod, curl).adaptation);
}

TEST(ReachMeasures, RestHasNoMeasures) {
  const std::vector<data::SampleRecord> still(500);
  const data::ReachRecord reach =
      reach_measures(still, protocols::ReachTrial::field, kTarget, kPeriod, curl);
  EXPECT_FALSE(reach.duration);
  EXPECT_FALSE(reach.deviation);
  EXPECT_FALSE(reach_measures({}, protocols::ReachTrial::field, kTarget, kPeriod, curl).duration);
}

TEST(ReachMeasures, EndsWhereTheTipRestsInTheTarget) {
  RestInTarget rest(kTarget, 0.005, kPeriod);
  int ended = -1;
  const std::vector<data::SampleRecord> samples = movement(none, no_force);
  for (std::size_t i = 0; i < samples.size() && ended < 0; ++i) {
    const auto& tip = samples[i].tip;
    if (rest.rests({tip[0], tip[1], tip[2]})) ended = static_cast<int>(i);
  }
  // Slower than 20 mm/s from s = 0.9385 on, seen at the end of the 20 ms: about 0.68 s.
  EXPECT_NEAR(ended, 200 + 0.9385 * 500 + 10, 3);
}

TEST(ReachMeasures, PassingThroughTheTargetIsNoEnd) {
  RestInTarget rest(kTarget, 0.005, kPeriod);
  for (int i = 0; i < 400; ++i) EXPECT_FALSE(rest.rests({0, 5e-4 * i, 0}));
  RestInTarget beside(kTarget, 0.005, kPeriod);
  for (int i = 0; i < 100; ++i) EXPECT_FALSE(beside.rests({0.006, kLength, 0}));
}

TEST(MotorMemory, FollowsTheTwoRates) {
  const participants::ReacherSettings settings;
  participants::MotorMemory memory;
  double fast = 0, slow = 0;
  for (int trial = 0; trial < 100; ++trial) {
    const double error = 13 - memory.expected();
    memory.learn(error, settings);
    fast = 0.59 * fast + 0.21 * error;
    slow = 0.992 * slow + 0.02 * error;
    EXPECT_NEAR(memory.fast, fast, 1e-12);
    EXPECT_NEAR(memory.slow, slow, 1e-12);
  }
  // The fixed point: x = g b / (1 + g), g = sum of learning / (1 - retention).
  const double gain = 0.21 / 0.41 + 0.02 / 0.008;
  for (int trial = 0; trial < 3000; ++trial) memory.learn(13 - memory.expected(), settings);
  EXPECT_NEAR(memory.expected(), 13 * gain / (1 + gain), 1e-9);
}

}  // namespace
}  // namespace palpate::runner::session
