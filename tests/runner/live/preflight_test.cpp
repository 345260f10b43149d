#include "runner/preflight.h"

#include <gtest/gtest.h>

namespace palpate {
namespace {

using Step = Preflight::Step;

Sample sample(const Vec3& tip, unsigned buttons = 0, bool lost = false) {
  Sample out;
  out.probe.tip = tip;
  out.buttons = static_cast<std::uint8_t>(buttons);
  out.faults = lost ? servo_fault::kDeviceLost : 0;
  return out;
}

void home(Preflight& preflight) {
  for (int i = 0; i < 20; ++i) preflight.add(sample({0, 0, 0}));
}

TEST(Preflight, NothingNeededIsDoneOnceHomed) {
  Preflight preflight({});
  for (int i = 0; i < 100; ++i) preflight.add(sample({0, 0, 0}, 0, true));
  EXPECT_EQ(preflight.step(), Step::homing);
  preflight.skip();
  EXPECT_EQ(preflight.step(), Step::homing) << "it cannot be left out";
  EXPECT_NE(preflight.instruction().find("home the device"), std::string::npos);
  home(preflight);
  EXPECT_EQ(preflight.step(), Step::done);
  EXPECT_EQ(preflight.instruction(), "");
}

TEST(Preflight, EverySideMustBeReached) {
  Preflight preflight({0.03, 0});
  home(preflight);
  const Vec3 sides[] = {{-0.03, 0, 0}, {0.03, 0, 0}, {0, -0.03, 0}, {0, 0.03, 0}, {0, 0, -0.03}};
  for (const Vec3& side : sides) {
    preflight.add(sample(side));
    EXPECT_EQ(preflight.step(), Step::range);
  }
  EXPECT_NE(preflight.instruction().find("30 mm from the centre; still to come: towards you "),
            std::string::npos);
  preflight.add(sample({0, 0, 0.0299}));
  EXPECT_EQ(preflight.step(), Step::range);
  preflight.add(sample({0, 0, 0.03}));
  EXPECT_EQ(preflight.step(), Step::done);
}

TEST(Preflight, ButtonsMustBeUpAndThenDown) {
  Preflight preflight({0, 2});
  home(preflight);
  for (const unsigned buttons : {1u, 1u, 3u, 1u}) preflight.add(sample({0, 0, 0}, buttons));
  EXPECT_EQ(preflight.step(), Step::buttons) << "button 1 is stuck";
  EXPECT_EQ(preflight.instruction().substr(0, 14), "press button 1");
  preflight.add(sample({0, 0, 0}, 0));
  preflight.add(sample({0, 0, 0}, 1));
  EXPECT_EQ(preflight.step(), Step::done);
}

TEST(Preflight, WhatIsLeftOutIsOnRecord) {
  Preflight preflight({0.03, 2});
  home(preflight);
  preflight.skip();
  preflight.skip();
  EXPECT_EQ(preflight.step(), Step::done);
  ASSERT_EQ(preflight.findings().size(), 3u);
  EXPECT_NE(preflight.findings()[1].find("range NOT checked"), std::string::npos);
  EXPECT_NE(preflight.findings()[2].find("NOT checked"), std::string::npos);
}

TEST(Preflight, ADeviceThatIsLostMeanwhileIsHomedAgain) {
  Preflight preflight({0.03, 0});
  home(preflight);
  preflight.add(sample({0, 0, 0}, 0, true));
  EXPECT_EQ(preflight.step(), Step::homing);
}

}  // namespace
}  // namespace palpate
