// The hand that explores, without a device: it stands where it wants to be.

#include "runner/participants/explorer.h"

#include <gtest/gtest.h>

#include <cmath>

namespace palpate::runner {
namespace {

constexpr double kFromTip = 0.06, kLength = 0.12;  // m, of the grip and of the stylus
constexpr double kPeriod = 1e-3;                   // s
constexpr double kStiffness = 800;                 // N/m

rendering::LineProbe held_at(const HandTarget& target) {
  return {target.grip - kFromTip * target.axis, target.grip + (kLength - kFromTip) * target.axis};
}

bool same(const HandTarget& a, const HandTarget& b) {
  return a.grip == b.grip && a.velocity == b.velocity && a.axis == b.axis;
}

// What was felt at one tick changes the motion exactly a reaction delay later.
TEST(Explorer, ActsOnContactAfterTheReactionDelay) {
  for (const int ticks : {1, 2, 37, 150}) {
    SimulatedSettings settings = load_simulated_settings("");
    settings.motor.reaction_delay = ticks * kPeriod;
    Explorer touching(settings, kFromTip, kStiffness, kPeriod),
        free(settings, kFromTip, kStiffness, kPeriod);
    HandTarget target = touching.begin(stimuli::Random(5));
    ASSERT_TRUE(same(target, free.begin(stimuli::Random(5))));
    constexpr int kTouch = 20;
    for (int tick = 0; tick < kTouch + ticks; ++tick) {
      TouchState felt;
      if (tick >= kTouch) felt = {true, Vec3(0, 0, 1), held_at(target).tip, 0};
      const HandTarget other = free.step({}, held_at(target));
      target = touching.step(felt, held_at(target));
      ASSERT_TRUE(same(target, other)) << "delay " << ticks << ", tick " << tick;
    }
    const rendering::LineProbe stylus = held_at(target);
    EXPECT_FALSE(same(touching.step({}, stylus), free.step({}, stylus))) << "delay " << ticks;
  }
}

}  // namespace
}  // namespace palpate::runner
