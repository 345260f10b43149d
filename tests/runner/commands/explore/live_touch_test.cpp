// A scene touched by a hand, with and without a responsive display.

#include "runner/touch/live_touch.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <thread>
#include <utility>

#include "runner/servo/sample.h"
#include "tests/runner/fake_device.h"

namespace palpate::runner::commands {
namespace {

using std::chrono::steady_clock;

/// A clock of 1 kHz whose ticks really are some hundred times as fast. It stands still until
/// started, so that the hand moves only once there is an object to touch.
class FastClock final : public servo::Clock {
 public:
  /// \param ticks  between two sleeps of 0.1 ms
  explicit FastClock(std::uint64_t ticks = 64) : between_naps_(ticks) {}
  void start() { started_.store(true); }
  std::int64_t now_ns() noexcept override { return now_; }
  void wait_until(std::int64_t when_ns) noexcept override {
    while (!started_.load()) std::this_thread::sleep_for(std::chrono::microseconds(100));
    if (++ticks_ % between_naps_ == 0) std::this_thread::sleep_for(std::chrono::microseconds(100));
    now_ = std::max(now_, when_ns);
  }

 private:
  std::atomic<bool> started_{false};
  std::int64_t now_ = 0;
  std::uint64_t ticks_ = 0;
  const std::uint64_t between_naps_;
};

/// A hand that moves down onto the cube's upper face and stays 3 mm deep.
servo::DeviceReading pressing(int tick) {
  const double y = std::max(0.022, 0.05 - 1e-4 * tick);
  servo::DeviceReading reading;
  reading.stylus = {{0, y, 0}, {0, y + 0.12, 0}};
  return reading;
}

touch::LiveTouch::Settings settings_of() {
  touch::LiveTouch::Settings out;
  out.scene_path = "scene.json";
  stimuli::ObjectSpec cube;
  cube.shape = stimuli::ShapeKind::cube;
  cube.edge = 0.05;
  cube.material.stiffness = 500;
  out.spec.objects = {cube};
  out.renderer = &rendering::ray_renderer();
  out.servo.realtime = {0, false, -1, false};
  out.servo.ring = 1 << 17;  // at this rate a recorder that is not scheduled falls far behind
  return out;
}

/// Times out only if it hangs.
template <class Condition>
bool comes_true(Condition condition) {
  const auto end = steady_clock::now() + std::chrono::seconds(60);
  while (!condition()) {
    if (steady_clock::now() > end) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return true;
}

class LiveTouchTest : public ::testing::Test {
 protected:
  runner::testing::FakeDevice device_{pressing};
  FastClock clock_;
};

// Five seconds of ticks in which the display takes no samples.
TEST_F(LiveTouchTest, AStalledDisplayNeitherDelaysNorLosesTicks) {
  touch::LiveTouch touch(device_, clock_, settings_of());
  clock_.start();
  ASSERT_TRUE(comes_true([&] { return touch.recorded() >= 5000; }));
  std::vector<display::SceneMoment> moments;
  touch.take(moments);
  ASSERT_GE(moments.size(), 5000U);
  for (std::size_t i = 0; i < moments.size(); ++i) {
    const servo::Sample& sample = moments[i].sample;
    ASSERT_EQ(sample.lateness_ns, 0) << i;
    ASSERT_EQ(sample.faults & (servo::servo_fault::kSamplesLost | servo::servo_fault::kMissedTicks),
              0U)
        << i;
    const std::int64_t before = i > 0 ? moments[i - 1].sample.time_ns : sample.time_ns - 1'000'000;
    ASSERT_EQ(sample.time_ns - before, 1'000'000) << i;
  }
  EXPECT_NEAR(moments.back().sample.device1.y + moments.back().sample.device2.y, 500 * 0.003, 1e-9);
  ASSERT_EQ(moments.back().contacts.size(), 1U);
  EXPECT_NEAR(moments.back().contacts[0].place.y, 0.025, 1e-9);
}

/// Keeps what it is sent.
class Kept final : public session::MarkerSink {
 public:
  /// \param count  of `markers`, for another thread
  Kept(std::vector<session::Marker>& markers, std::atomic<std::size_t>& count)
      : markers_(markers), count_(count) {}
  bool send(const session::Marker& marker) noexcept override {
    markers_.push_back(marker);
    count_.store(markers_.size());
    return true;
  }

 private:
  std::vector<session::Marker>& markers_;
  std::atomic<std::size_t>& count_;
};

TEST_F(LiveTouchTest, EachSceneIsATrialForOtherRecorders) {
  std::vector<session::Marker> kept;
  std::atomic<std::size_t> count{0};
  {
    std::vector<std::unique_ptr<session::MarkerSink>> sinks;
    sinks.push_back(std::make_unique<Kept>(kept, count));
    session::Markers markers(std::move(sinks));
    touch::LiveTouch::Settings settings = settings_of();
    settings.markers = &markers;
    touch::LiveTouch touch(device_, clock_, settings);
    clock_.start();
    ASSERT_TRUE(comes_true([&] { return count.load() >= 2; }));
    std::vector<stimuli::ObjectSpec> other = settings.spec.objects;
    other[0].edge = 0.04;
    touch.show(other);
    ASSERT_TRUE(comes_true([&] { return count.load() >= 3; }));
  }
  using Kind = session::Marker::Kind;
  ASSERT_GE(kept.size(), 3U);
  EXPECT_EQ(kept[0].kind, Kind::trial_start);
  EXPECT_EQ(kept[1].kind, Kind::first_contact);
  EXPECT_EQ(kept[2].kind, Kind::trial_start);
  EXPECT_EQ(kept[2].trial, 2);
  EXPECT_EQ(kept[2].renderer, "ray");
  EXPECT_GT(kept[1].time_ns, kept[0].time_ns);
}

/// A cube that drifts with 10 mm/s, far from the hand.
touch::LiveTouch::Settings with_drifting_cube() {
  touch::LiveTouch::Settings settings = settings_of();
  stimuli::ObjectSpec drifting;
  drifting.shape = stimuli::ShapeKind::cube;
  drifting.edge = 0.02;
  drifting.pose.position = {0.2, 0, 0};
  drifting.body.emplace().mass = 0.3;
  drifting.body->velocity = {0, 0, 0.01};
  settings.spec.objects.push_back(drifting);
  return settings;
}

/// Every moment has the poses of moving objects, and objects follow a pull.
TEST_F(LiveTouchTest, MovingObjectsAreShownAndCanBePulled) {
  touch::LiveTouch touch(device_, clock_, with_drifting_cube());
  clock_.start();
  ASSERT_TRUE(comes_true([&] { return touch.recorded() >= 1000; }));
  std::vector<display::SceneMoment> moments;
  touch.take(moments);
  for (std::size_t i = 0; i < 1000; ++i) {
    ASSERT_EQ(moments[i].poses.size(), 2U) << i;
    EXPECT_EQ(moments[i].poses[0].position, Vec3(0)) << i;
    // The first tick is as long as the others.
    EXPECT_NEAR(moments[i].poses[1].position.z, 1e-5 * static_cast<double>(i + 1), 1e-9) << i;
  }
  const Vec3 corner(0.21, 0.01, 0.01), to(0.25, 0.03, 0);
  touch.pull({.object = 1, .on_object = corner, .to = to});
  display::SceneMoment last = moments.back();
  const auto newest = [&] {
    moments.clear();
    touch.take(moments);
    if (!moments.empty()) last = moments.back();
    return last;
  };
  EXPECT_TRUE(comes_true([&] {
    const Pose pose = newest().poses.at(1);
    return glm::distance(pose.orientation * (corner - Vec3(0.2, 0, 0)) + pose.position, to) < 1e-3;
  }));
  touch.pull({});
  EXPECT_EQ(last.sample.faults, 0U);
}

TEST_F(LiveTouchTest, TheLastPartOfALongStallIsKept) {
  touch::LiveTouch touch(device_, clock_, settings_of());
  clock_.start();
  ASSERT_TRUE(comes_true([&] { return touch.recorded() >= 70'000; }));
  std::vector<display::SceneMoment> moments;
  touch.take(moments);
  EXPECT_LE(moments.size(), 60'001U);
  EXPECT_GE(moments.size(), 45'000U);
  for (std::size_t i = 1; i < moments.size(); ++i)
    ASSERT_EQ(moments[i].sample.time_ns - moments[i - 1].sample.time_ns, 1'000'000) << i;
}

TEST_F(LiveTouchTest, AfterAnEmergencyForcesStayOffUntilCleared) {
  touch::LiveTouch touch(device_, clock_, settings_of());
  clock_.start();
  const auto newest = [&] {
    std::vector<display::SceneMoment> moments;
    touch.take(moments);
    return moments.empty() ? servo::Sample() : moments.back().sample;
  };
  ASSERT_TRUE(comes_true([&] { return newest().device1.y > 1; }));
  touch.emergency_zero();
  ASSERT_TRUE(comes_true([&] { return (newest().faults & servo::servo_fault::kTripped) != 0; }));
  const servo::Sample off = newest();
  EXPECT_EQ(off.device1, Vec3(0));
  EXPECT_EQ(off.device2, Vec3(0));
  touch.clear_fault();
  EXPECT_TRUE(comes_true([&] { return newest().device1.y > 1; }));
}

TEST_F(LiveTouchTest, AHeldSceneGivesNoForceAndDoesNotChange) {
  touch::LiveTouch touch(device_, clock_, settings_of());
  clock_.start();
  std::vector<display::SceneMoment> moments;
  ASSERT_TRUE(comes_true([&] { return touch.recorded() > 600; }));
  touch.hold(true);
  std::uint64_t before = 0;
  ASSERT_TRUE(comes_true([&] {
    return std::exchange(before, touch.recorded()) == touch.recorded() &&
           touch.servo().forces_are_off();
  }));
  touch.hold(false);
  EXPECT_TRUE(comes_true([&] { return touch.recorded() > before + 100; })) << "it goes on";
}

/// Each moment is a tick after the previous one, in time and in the objects' motion.
void expect_no_gap(const std::vector<display::SceneMoment>& moments) {
  for (std::size_t i = 1; i < moments.size(); ++i) {
    ASSERT_EQ(moments[i].sample.time_ns - moments[i - 1].sample.time_ns, 1'000'000) << i;
    ASSERT_NEAR(moments[i].poses.at(1).position.z - moments[i - 1].poses.at(1).position.z, 1e-5,
                1e-10)
        << i;
  }
}

TEST_F(LiveTouchTest, APauseKeepsMovingObjectsAndStepsContinueFromIt) {
  FastClock clock(1);  // no minute may pass while the test is not scheduled
  touch::LiveTouch touch(device_, clock, with_drifting_cube());
  clock.start();
  std::vector<display::SceneMoment> moments;
  ASSERT_TRUE(comes_true([&] { return touch.recorded() > 600; }));
  touch.hold(true);
  std::uint64_t before = 0;
  ASSERT_TRUE(comes_true([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    return std::exchange(before, touch.recorded()) == touch.recorded();
  }));
  touch.take(moments);
  ASSERT_EQ(moments.size(), before);
  for (const int steps : {1, 1, 7}) {
    touch.step(steps);
    before += static_cast<std::uint64_t>(steps);
    ASSERT_TRUE(comes_true([&] { return touch.recorded() >= before; }));
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    EXPECT_EQ(touch.recorded(), before) << "and no more than " << steps;
  }
  touch.take(moments);
  // The full force on the hand; actually the ramp of the forces had just begun.
  EXPECT_NEAR(moments.back().sample.device1.y + moments.back().sample.device2.y, 500 * 0.003, 1e-9);
  touch.hold(false);
  ASSERT_TRUE(comes_true([&] { return touch.recorded() > before + 300; }));
  touch.take(moments);
  expect_no_gap(moments);
  const double seconds = 1e-3 * static_cast<double>(moments.size());
  EXPECT_NEAR(moments.back().poses.at(1).position.z, 0.01 * seconds, 1e-8);
}

/// The hand has moved away: no force and no motion until it is back.
TEST_F(LiveTouchTest, AfterAPauseTheSceneResumesOnceTheHandIsBack) {
  std::atomic<double> aside{0};
  runner::testing::FakeDevice device([&](int tick) {
    servo::DeviceReading reading = pressing(tick);
    reading.stylus.tip.x += aside.load();
    reading.stylus.tail.x += aside.load();
    return reading;
  });
  FastClock clock(1);
  touch::LiveTouch touch(device, clock, with_drifting_cube());
  clock.start();
  ASSERT_TRUE(comes_true([&] { return touch.recorded() > 600; }));
  touch.hold(true);
  ASSERT_TRUE(comes_true([&] { return touch.servo().forces_are_off(); }));
  aside = 0.04;
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  const std::uint64_t before = touch.recorded();
  touch.hold(false);
  ASSERT_TRUE(comes_true([&] { return touch.away() > 0; }));
  EXPECT_NEAR(touch.away(), 0.04, 1e-9);
  EXPECT_TRUE(touch.servo().forces_are_off());
  EXPECT_EQ(touch.recorded(), before);
  aside = 0.003;
  ASSERT_TRUE(comes_true([&] { return touch.recorded() > before + 300; }));
  EXPECT_EQ(touch.away(), 0);
  EXPECT_EQ(touch.trouble(), "");
  std::vector<display::SceneMoment> moments;
  touch.take(moments);
  expect_no_gap(moments);
}

/// The hand stays in the cube.
TEST_F(LiveTouchTest, AnotherMaterialIsFeltByARamp) {
  touch::LiveTouch touch(device_, clock_, settings_of());
  clock_.start();
  std::vector<double> stiffness;
  const auto becomes = [&](double wanted) {
    return comes_true([&] {
      std::vector<display::SceneMoment> moments;
      touch.take(moments);
      for (const display::SceneMoment& moment : moments) {
        const rendering::Rendering& r = moment.sample.rendering;
        if (r.deepest.depth < 0.003 - 1e-9) continue;
        stiffness.push_back(glm::length(r.force) / r.deepest.depth);
      }
      return !stiffness.empty() && std::abs(stiffness.back() - wanted) < 1e-6;
    });
  };
  ASSERT_TRUE(becomes(500));
  std::vector<stimuli::ObjectSpec> softer = settings_of().spec.objects;
  softer[0].material.stiffness = 200;
  touch.show(softer);
  ASSERT_TRUE(becomes(200));
  EXPECT_EQ(touch.trouble(), "");
  for (std::size_t i = 1; i < stiffness.size(); ++i)
    ASSERT_LE(std::abs(stiffness[i] - stiffness[i - 1]), 300 * 0.001 / 0.2 + 1e-6) << i;
}

/// Of layers more changes than a number.
TEST_F(LiveTouchTest, AnotherMaterialActsOnceTheHandHasLeft) {
  // Down and up again, so that the hand leaves the object.
  runner::testing::FakeDevice device([](int tick) {
    const double y = 0.03 - 0.008 * std::sin(0.002 * tick);
    servo::DeviceReading reading;
    reading.stylus = {{0, y, 0}, {0, y + 0.12, 0}};
    return reading;
  });
  touch::LiveTouch touch(device, clock_, settings_of());
  clock_.start();
  const auto stiffness_becomes = [&](double wanted) {
    return comes_true([&] {
      std::vector<display::SceneMoment> moments;
      touch.take(moments);
      for (const display::SceneMoment& moment : moments) {
        const rendering::Rendering& r = moment.sample.rendering;
        if (r.contacts == 1 &&
            std::abs(glm::length(r.force) - wanted * r.deepest.depth) < 1e-9 * wanted)
          return true;
      }
      return false;
    });
  };
  ASSERT_TRUE(stiffness_becomes(500));
  std::vector<stimuli::ObjectSpec> softer = settings_of().spec.objects;
  softer[0].material.stiffness = 200;
  touch.show(softer);
  EXPECT_TRUE(stiffness_becomes(200));
  EXPECT_EQ(touch.trouble(), "");
  softer[0].material.layers = {{0.04, 100, 0}};
  touch.show(softer);
  EXPECT_TRUE(comes_true([&] { return !touch.trouble().empty(); }))
      << "a layer deeper than the cube";
}

}  // namespace
}  // namespace palpate::runner::commands
