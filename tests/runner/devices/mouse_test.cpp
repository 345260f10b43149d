#include "runner/devices/mouse.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <random>
#include <thread>
#include <utility>

namespace palpate::runner::display {
namespace {

constexpr double kLength = 0.12;

double length_of(const rendering::LineProbe& stylus) {
  return glm::length(stylus.tail - stylus.tip);
}

TEST(MouseStylus, RestsOutsideOfTheHomeZoneUntilItIsMoved) {
  devices::MouseStylus device(kLength, 1000);
  const rendering::LineProbe start = device.read().stylus;
  for (int i = 0; i < 1000; ++i) {
    const servo::DeviceReading reading = device.read();
    EXPECT_EQ(reading.stylus.tip, start.tip);
    EXPECT_FALSE(reading.lost);
  }
  // The nearest point of the segment to the origin.
  const Vec3 axis = start.tail - start.tip;
  const double along = std::clamp(-glm::dot(start.tip, axis) / glm::dot(axis, axis), 0.0, 1.0);
  EXPECT_GT(glm::length(start.tip + along * axis), 0.08);
}

TEST(MouseStylus, FollowsWithoutJumpAndKeepsItsLength) {
  for (const double rate : {1000.0, 4000.0}) {
    devices::MouseStylus device(kLength, rate);
    devices::StylusTarget hand = device.initial_target();
    rendering::LineProbe before = device.read().stylus;
    hand.move({-0.12, -0.08, -0.04});
    hand.turn(M_PI - 0.1, -1.4);
    device.set_target(hand.stylus());
    for (int i = 0; i < static_cast<int>(rate); ++i) {
      const rendering::LineProbe now = device.read().stylus;
      ASSERT_LE(glm::length(now.tip - before.tip), 1.0001 / rate);
      ASSERT_LE(glm::length(now.tail - before.tail), 6 / rate);
      ASSERT_NEAR(length_of(now), kLength, 1e-12);
      before = now;
    }
    EXPECT_LT(glm::length(before.tip - hand.tip), 1e-6);
    EXPECT_LT(glm::length(before.tail - hand.stylus().tail), 1e-6);
  }
}

TEST(MouseStylus, EveryTargetGivesAFinitePose) {
  devices::MouseStylus device(kLength, 1000);
  constexpr std::uint32_t kSeed = 7;
  std::mt19937 random(kSeed);  // NOLINT(cert-msc32-c,cert-msc51-cpp): any sequence will do
  std::uniform_real_distribution<double> far(-10, 10);
  devices::StylusTarget hand = device.initial_target();
  for (int i = 0; i < 20000; ++i) {
    hand.move({far(random), far(random), far(random)});
    hand.turn(far(random), far(random));
    device.set_target(hand.stylus());
    const rendering::LineProbe now = device.read().stylus;
    ASSERT_NEAR(length_of(now), kLength, 1e-9);
    ASSERT_LT(glm::length(now.tip), 1);
  }
  // The tail moves straight through the tip: the axis is undefined there but must not be lost.
  const rendering::LineProbe at = device.read().stylus;
  device.set_target({at.tail, at.tip});
  for (int i = 0; i < 2000; ++i) ASSERT_NEAR(length_of(device.read().stylus), kLength, 1e-9);
}

TEST(MouseStylus, TakesTargetsFromAnotherThread) {
  devices::MouseStylus device(kLength, 1000);
  std::thread window([&device] {
    devices::StylusTarget hand = device.initial_target();
    for (int i = 0; i < 20000; ++i) {
      hand.move({-1e-5, 0, 0});
      device.set_target(hand.stylus());
    }
  });
  for (int i = 0; i < 20000; ++i) ASSERT_NEAR(length_of(device.read().stylus), kLength, 1e-9);
  window.join();
  for (int i = 0; i < 2000; ++i) device.read();
  EXPECT_NEAR(device.read().stylus.tip.x, device.initial_target().tip.x - 0.2, 1e-6);
}

TEST(StylusTarget, StaysInReachAndTurnsFiveDegreesOfFreedom) {
  devices::StylusTarget hand{{}, kLength, 0, 0};
  EXPECT_NEAR(glm::length(hand.axis() - Vec3(0, -1, 0)), 0, 1e-12) << "towards the viewer";
  hand.turn(M_PI / 2, 0);
  EXPECT_NEAR(glm::length(hand.axis() - Vec3(1, 0, 0)), 0, 1e-12);
  hand.turn(0, 100);
  EXPECT_GT(hand.axis().z, 0.99) << "z is up";
  hand.move({5, -5, 0.1});
  EXPECT_EQ(hand.tip, Vec3(0.25, -0.25, 0.1));
}

TEST(StylusTarget, TakesThePoseOfAnotherStylus) {
  devices::StylusTarget hand{{}, kLength, 0, 0};
  for (const auto& [yaw, pitch] : {std::pair{0.3, 0.8}, {-2.9, -1.2}, {1.6, 0.0}, {3.0, 1.4}}) {
    const devices::StylusTarget other{{0.05, -0.1, 0.02}, kLength, yaw, pitch};
    hand.point(other.stylus());
    EXPECT_LT(glm::length(hand.stylus().tip - other.stylus().tip), 1e-12);
    EXPECT_LT(glm::length(hand.stylus().tail - other.stylus().tail), 1e-12);
  }
  hand.point({{1, 0, 0}, {1, 0, 0}});
  EXPECT_EQ(hand.tip, Vec3(0.25, 0, 0)) << "within reach";
}

}  // namespace
}  // namespace palpate::runner::display
