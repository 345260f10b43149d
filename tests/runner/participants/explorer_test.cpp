// The exploring hand, without a device: the stylus is always at the hand's target.

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>

#include "runner/participants/simulated.h"

namespace palpate::runner::participants {
namespace {

constexpr double kFromTip = 0.06, kLength = 0.12;  // m, of the grip and of the stylus
constexpr double kPeriod = 1e-3;                   // s
constexpr double kStiffness = 800;                 // N/m

rendering::LineProbe held_at(const devices::HandTarget& target) {
  return {target.grip - kFromTip * target.axis, target.grip + (kLength - kFromTip) * target.axis};
}

/// One tick of a hand whose stylus is at its target.
devices::HandTarget step(Explorer& hand, const TouchState& felt,
                         const rendering::LineProbe& stylus) {
  return hand.step(felt, stylus.tip, glm::normalize(stylus.tail - stylus.tip));
}

bool same(const devices::HandTarget& a, const devices::HandTarget& b) {
  return a.grip == b.grip && a.velocity == b.velocity && a.axis == b.axis;
}

// Contact at one tick changes the motion exactly one reaction delay later.
TEST(Explorer, ActsOnContactAfterTheReactionDelay) {
  constexpr std::uint64_t kSeed = 5;
  for (const int ticks : {1, 2, 37, 150}) {
    SimulatedSettings settings = load_simulated_settings("");
    settings.motor.reaction_delay = ticks * kPeriod;
    Explorer touching(settings, kFromTip, kStiffness, kPeriod),
        free(settings, kFromTip, kStiffness, kPeriod);
    devices::HandTarget target = touching.begin(Random(kSeed));
    ASSERT_TRUE(same(target, free.begin(Random(kSeed))));
    constexpr int kTouch = 20;
    for (int tick = 0; tick < kTouch + ticks; ++tick) {
      TouchState felt;
      if (tick >= kTouch) felt = {true, Vec3(0, 0, 1), held_at(target).tip, 0};
      const devices::HandTarget other = step(free, {}, held_at(target));
      target = step(touching, felt, held_at(target));
      ASSERT_TRUE(same(target, other)) << "delay " << ticks << ", tick " << tick;
    }
    const rendering::LineProbe stylus = held_at(target);
    EXPECT_FALSE(same(step(touching, {}, stylus), step(free, {}, stylus))) << "delay " << ticks;
  }
}

/// Contact with a horizontal surface at height zero, for a hand without reaction delay.
TouchState felt_below(const devices::HandTarget& target) {
  return {true, Vec3(0, 0, 1), held_at(target).tip, 0};
}

/// A hand that has slid for 0.1 s in contact and has known for one tick that contact was lost.
struct AfterLossOfContact {
  static constexpr std::uint64_t kSeed = 6;

  explicit AfterLossOfContact(const SimulatedSettings& settings)
      : hand(settings, kFromTip, kStiffness, kPeriod), target(hand.begin(Random(kSeed))) {
    for (int tick = 0; tick < 100; ++tick) target = step(hand, felt_below(target), held_at(target));
    slid = hand.heading();
    before = held_at(target).tip;
    target = step(hand, {}, held_at(target));  // known one tick later
    before = held_at(target).tip;
    target = step(hand, {}, held_at(target));
  }
  Explorer hand;
  devices::HandTarget target;
  Vec3 slid, before;
};

SimulatedSettings quick_hand(int version) {
  SimulatedSettings settings = load_simulated_settings("", version);
  settings.motor.reaction_delay = kPeriod;
  settings.motor.heading_time = 1e12;  // it hardly wanders
  settings.motor.mean_follow = 1e6;
  return settings;
}

TEST(Explorer, InVersion1PressesOnAfterALossOfContact) {
  const AfterLossOfContact at(quick_hand(1));
  const Vec3 expected = glm::normalize(Vec3(0, 0, -1) + 0.15 * glm::normalize(-at.before));
  EXPECT_LT(glm::length(at.target.velocity / 0.06 - expected), 1e-9);
}

TEST(Explorer, Version2TurnsBackAfterLostContact) {
  const SimulatedSettings settings = quick_hand(2);
  const AfterLossOfContact at(settings);
  const Vec3 way = at.target.velocity / settings.motor.slide_speed;
  EXPECT_NEAR(glm::length(way), 1, 1e-9);
  EXPECT_GT(glm::dot(way, at.slid), 0.99) << "15 a second: hardly turned after two ticks";
  EXPECT_GT(glm::dot(way, glm::normalize(-at.before)),
            glm::dot(at.slid, glm::normalize(-at.before)));
}

TEST(Explorer, TurnsToTheChosenHeadingInItsTime) {
  constexpr std::uint64_t kSeed = 7;
  for (const double angle : {0.5, -2.0, 3.0, 0.0}) {
    SimulatedSettings settings = quick_hand(2);
    settings.heading.chosen = true;
    Explorer hand(settings, kFromTip, kStiffness, kPeriod);
    devices::HandTarget target = hand.begin(Random(kSeed));
    int waited = 0;
    while (!hand.wants_heading()) {
      ASSERT_LT(++waited, 10) << "it slides from the second tick on";
      target = step(hand, felt_below(target), held_at(target));
    }
    const Vec3 from = hand.heading(), side = glm::cross(hand.known_normal(), from);
    const Vec3 goal = std::cos(angle) * from + std::sin(angle) * side;
    hand.turn_to(goal);
    EXPECT_FALSE(hand.wants_heading());
    for (int tick = 0; tick < 50; ++tick) target = step(hand, felt_below(target), held_at(target));
    const Vec3 half = std::cos(angle / 2) * from + std::sin(angle / 2) * side;
    EXPECT_LT(glm::length(hand.heading() - half), 1e-4) << angle;
    for (int tick = 50; tick < 299; ++tick) {
      target = step(hand, felt_below(target), held_at(target));
      EXPECT_FALSE(hand.wants_heading()) << "tick " << tick;
    }
    EXPECT_LT(glm::length(hand.heading() - goal), 1e-4) << angle;
    step(hand, felt_below(target), held_at(target));
    EXPECT_TRUE(hand.wants_heading()) << "0.3 s are over";
  }
}

TEST(Explorer, WantsNoHeadingWhileItWanders) {
  Explorer hand(quick_hand(2), kFromTip, kStiffness, kPeriod);
  constexpr std::uint64_t kSeed = 7;
  devices::HandTarget target = hand.begin(Random(kSeed));
  for (int tick = 0; tick < 1000; ++tick) {
    target = step(hand, felt_below(target), held_at(target));
    ASSERT_FALSE(hand.wants_heading());
  }
}

}  // namespace
}  // namespace palpate::runner::participants
