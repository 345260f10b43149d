#include "runner/display/timeline.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>

namespace palpate::runner::display {
namespace {

SceneMoment moment_at(int milliseconds) {
  SceneMoment out;
  out.sample.time_ns = std::int64_t{1'000'000} * milliseconds;
  return out;
}

Timeline of(int first, int last) {
  Timeline out;
  for (int t = first; t <= last; ++t) out.add(moment_at(t));
  return out;
}

TEST(TimelineTest, WithoutMomentsNothingIsShown) {
  Timeline line;
  line.step(3);
  line.seek(1);
  line.play();
  line.advance(1);
  EXPECT_EQ(line.shown(), nullptr);
  EXPECT_EQ(line.now(), 0);
}

TEST(TimelineTest, TheNewestIsFollowedUntilItIsPaused) {
  Timeline line = of(1, 10);
  EXPECT_DOUBLE_EQ(line.now(), 0.010);
  line.add(moment_at(11));
  EXPECT_DOUBLE_EQ(line.now(), 0.011);
  line.pause();
  line.add(moment_at(12));
  line.advance(5);
  EXPECT_DOUBLE_EQ(line.now(), 0.011);
  line.follow();
  EXPECT_DOUBLE_EQ(line.now(), 0.012);
}

TEST(TimelineTest, AStepIsOneMomentAndStaysInRange) {
  Timeline line = of(1, 10);
  line.step(-1);
  EXPECT_EQ(line.state(), Timeline::State::paused);
  EXPECT_DOUBLE_EQ(line.now(), 0.009);
  line.step(-100);
  EXPECT_DOUBLE_EQ(line.now(), 0.001);
  line.step(2);
  EXPECT_DOUBLE_EQ(line.now(), 0.003);
  line.step(100);
  EXPECT_DOUBLE_EQ(line.now(), 0.010);
}

TEST(TimelineTest, SeekFindsTheLastMomentNotAfterTheTime) {
  Timeline line;
  for (const int t : {10, 20, 40}) line.add(moment_at(t));
  line.seek(0.0399);
  EXPECT_DOUBLE_EQ(line.now(), 0.020);
  line.seek(0);
  EXPECT_DOUBLE_EQ(line.now(), 0.010);
  line.seek(9);
  EXPECT_DOUBLE_EQ(line.now(), 0.040);
}

TEST(TimelineTest, FaultsAreCountedWhileTheirMomentsAreKept) {
  Timeline line;
  EXPECT_TRUE(line.faults().empty());
  for (int t = 0; t <= 50'000; t += 10) {
    SceneMoment moment = moment_at(t);
    if (t == 1000 || t == 20'000) moment.sample.faults = 4;
    if (t == 1000) moment.sample.faults |= 0x80000000U;
    line.add(moment);
  }
  std::vector<Timeline::Fault> faults = line.faults();
  ASSERT_EQ(faults.size(), 2U);
  EXPECT_EQ(faults[0].bit, 4U);
  EXPECT_EQ(faults[0].count, 2U);
  EXPECT_DOUBLE_EQ(faults[0].last, 20);
  EXPECT_EQ(faults[1].bit, 0x80000000U);
  line.add(moment_at(70'000));  // the first of them is more than a minute ago
  faults = line.faults();
  ASSERT_EQ(faults.size(), 1U);
  EXPECT_EQ(faults[0].count, 1U);
  line.clear();
  EXPECT_TRUE(line.faults().empty());
}

TEST(TimelineTest, SlowMotionShowsEveryMoment) {
  Timeline line = of(0, 1000);
  line.seek(0.5);
  line.play();
  line.set_speed(0.1);
  for (int frame = 0; frame < 60; ++frame) line.advance(1.0 / 60);
  EXPECT_NEAR(line.now(), 0.6, 0.0011);
  line.set_speed(1);
  line.advance(5);
  EXPECT_DOUBLE_EQ(line.now(), 1);
  EXPECT_EQ(line.state(), Timeline::State::paused) << "at the end it stops";
  line.play();
  EXPECT_DOUBLE_EQ(line.now(), 0) << "and begins anew";
}

TEST(TimelineTest, AMinuteIsKeptAndTheMomentShownStays) {
  Timeline line = of(0, 30'000);
  line.seek(25);
  for (int t = 30'001; t <= 80'000; ++t) line.add(moment_at(t));
  EXPECT_DOUBLE_EQ(line.last() - line.first(), Timeline::kSpan);
  EXPECT_DOUBLE_EQ(line.now(), 25);
  for (int t = 80'001; t <= 90'000; ++t) line.add(moment_at(t));
  EXPECT_DOUBLE_EQ(line.now(), line.first()) << "what was shown is too old: the oldest instead";
}

TEST(TimelineTest, ATimeThatIsNotLaterRestartsTheTimeline) {
  Timeline line = of(5, 10);
  line.add(moment_at(2));
  EXPECT_EQ(line.moments().size(), 1U);
  EXPECT_DOUBLE_EQ(line.now(), 0.002);
}

TEST(TimelineTest, AnInvalidSpeedIsIgnored) {
  Timeline line;
  line.set_speed(0.5);
  line.set_speed(std::nan(""));
  EXPECT_DOUBLE_EQ(line.speed(), 0.5);
  line.set_speed(1e9);
  EXPECT_DOUBLE_EQ(line.speed(), Timeline::kFastest);
}

}  // namespace
}  // namespace palpate::runner::display
