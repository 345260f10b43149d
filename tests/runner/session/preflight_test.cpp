#include "runner/session/preflight.h"

#include <gtest/gtest.h>

#include <functional>

#include "runner/servo/servo.h"

namespace palpate::runner::session {
namespace {

using Step = Preflight::Step;

servo::Sample sample(const Vec3& tip, unsigned buttons = 0, bool lost = false) {
  servo::Sample out;
  out.probe.tip = tip;
  out.buttons = static_cast<std::uint8_t>(buttons);
  out.faults = lost ? servo::servo_fault::kDeviceLost : 0;
  return out;
}

void home(Preflight& preflight) {
  for (int i = 0; i < 20; ++i) preflight.add(sample({0, 0, 0}));
}

TEST(Preflight, WithoutChecksItIsDoneOnceHomed) {
  Preflight preflight({});
  for (int i = 0; i < 100; ++i) preflight.add(sample({0, 0, 0}, 0, true));
  EXPECT_EQ(preflight.step(), Step::homing);
  preflight.skip();
  EXPECT_EQ(preflight.step(), Step::homing) << "it cannot be left out";
  EXPECT_NE(preflight.checklist().instruction.find("home the device"), std::string::npos);
  home(preflight);
  EXPECT_EQ(preflight.step(), Step::done);
  EXPECT_EQ(preflight.checklist().instruction, "");
}

TEST(Preflight, EverySideMustBeReached) {
  Preflight preflight({0.03, 0});
  home(preflight);
  const Vec3 sides[] = {{-0.03, 0, 0}, {0.03, 0, 0}, {0, -0.03, 0}, {0, 0.03, 0}, {0, 0, -0.03}};
  for (const Vec3& side : sides) {
    preflight.add(sample(side));
    EXPECT_EQ(preflight.step(), Step::range);
  }
  EXPECT_NE(
      preflight.checklist().instruction.find("30 mm from the centre; still to come: towards you"),
      std::string::npos);
  preflight.add(sample({0, 0, 0.0299}));
  EXPECT_EQ(preflight.step(), Step::range);
  preflight.add(sample({0, 0, 0.03}));
  EXPECT_EQ(preflight.step(), Step::done);
}

TEST(Preflight, AnEmergencyKeepsCompletedSteps) {
  Preflight preflight({0.03, 0});
  home(preflight);
  servo::Sample off = sample({0, 0, 0}, 0, true);
  off.trouble = servo::DeviceTrouble::guarded;
  preflight.add(off);
  EXPECT_EQ(preflight.step(), Step::range);
  off.trouble = servo::DeviceTrouble::unplugged;
  preflight.add(off);
  EXPECT_EQ(preflight.step(), Step::homing);
}

TEST(Preflight, ButtonsMustBeUpAndThenDown) {
  Preflight preflight({0, 2});
  home(preflight);
  for (const unsigned buttons : {1u, 1u, 3u, 1u}) preflight.add(sample({0, 0, 0}, buttons));
  EXPECT_EQ(preflight.step(), Step::buttons) << "button 1 is stuck";
  EXPECT_EQ(preflight.checklist().instruction.substr(0, 14), "press button 1");
  preflight.add(sample({0, 0, 0}, 0));
  preflight.add(sample({0, 0, 0}, 1));
  EXPECT_EQ(preflight.step(), Step::done);
}

TEST(Preflight, SkippedStepsAreRecorded) {
  Preflight preflight({0.03, 2});
  home(preflight);
  preflight.skip();
  preflight.skip();
  EXPECT_EQ(preflight.step(), Step::done);
  std::string states;
  for (const display::Checklist::Step& step : preflight.checklist().steps)
    states += step.words + std::to_string(static_cast<int>(step.state)) + " ";
  EXPECT_EQ(states, "Home the device2 Move to every side3 Press the buttons3 ");
  ASSERT_EQ(preflight.findings().size(), 3u);
  EXPECT_NE(preflight.findings()[1].find("range NOT checked"), std::string::npos);
  EXPECT_NE(preflight.findings()[2].find("NOT checked"), std::string::npos);
}

TEST(Preflight, ThePushIsAnnouncedGivenAndConfirmed) {
  const ForceDirectionCheck push({2.5, 0.5, 0.2}, 3);
  PreflightNeeds needs{0.03, 0};
  needs.push = &push;
  needs.device_limit = 2.5;
  Preflight preflight(needs);
  preflight.repeat();
  EXPECT_FALSE(preflight.push_due()) << "not before it is homed";
  home(preflight);
  EXPECT_EQ(preflight.step(), Step::limits);
  EXPECT_FALSE(preflight.push_due()) << "not before somebody holds the grip";
  EXPECT_NE(
      preflight.checklist().instruction.find(
          "forces of up to 2.5 N at the grip (the device's own limit: 2.5 N), 0.5 N of change "
          "a tick; hold the grip: a push of 1.0 N to the right"),
      std::string::npos)
      << preflight.checklist().instruction;
  preflight.skip();
  EXPECT_TRUE(preflight.push_due());
  preflight.pushed("7 N were commanded");
  EXPECT_FALSE(preflight.push_due());
  EXPECT_NE(preflight.checklist().instruction.find("7 N were commanded"), std::string::npos);
  preflight.skip();
  EXPECT_TRUE(preflight.push_due()) << "it cannot be left out";
  preflight.pushed("");
  EXPECT_EQ(preflight.step(), Step::limits);
  EXPECT_NE(preflight.checklist().instruction.find("felt?"), std::string::npos);
  preflight.repeat();
  EXPECT_TRUE(preflight.push_due());
  preflight.pushed("");
  preflight.skip();
  EXPECT_EQ(preflight.step(), Step::range);
  ASSERT_EQ(preflight.findings().size(), 2u);
  EXPECT_NE(preflight.findings()[1].find("a push of 1.0 N to the right was felt"),
            std::string::npos);
}

TEST(Preflight, HomesADeviceLostDuringThePush) {
  const ForceDirectionCheck push({6, 0.5, 0.2}, 3);
  PreflightNeeds needs{0, 0};
  needs.push = &push;
  Preflight preflight(needs);
  home(preflight);
  preflight.skip();
  preflight.pushed("");
  preflight.add(sample({0, 0, 0}, 0, true));
  EXPECT_EQ(preflight.step(), Step::homing);
  home(preflight);
  EXPECT_EQ(preflight.step(), Step::limits);
  preflight.skip();
  EXPECT_EQ(preflight.step(), Step::limits) << "it has not pushed since";
  EXPECT_TRUE(preflight.push_due());
}

/// Keeps every command.
class Grip final : public servo::Device {
 public:
  Grip(double limit, int driven) {
    able_.sensed_freedom = 5;
    able_.actuated_freedom = driven;
    able_.max_force = limit;
  }
  const servo::DeviceCapabilities& capabilities() const override { return able_; }
  servo::DeviceReading read() noexcept override { return {{{0, 0, 0}, {0, 0, 0.12}}}; }
  void write(const Vec3& device1, const Vec3& device2) noexcept override {
    commands.emplace_back(device1, device2);
  }
  std::vector<std::pair<Vec3, Vec3>> commands;

 private:
  servo::DeviceCapabilities able_;
};

TEST(ForceDirectionCheck, PushesToTheRightWithinTheLimitsAndReleases) {
  for (const int driven : {3, 5}) {
    for (const double limit : {6.0, 0.8}) {
      Grip grip(limit, driven);
      servo::VirtualClock clock;
      const servo::ForceLimits limits{limit, 0.5, 0.2};
      servo::Servo servo(grip, clock, 1000, limits);
      const ForceDirectionCheck push(limits, driven);
      EXPECT_EQ(push.force(), std::min(1.0, limit / 2));
      EXPECT_EQ(push.push(servo, [] { return false; }), "");
      double most = 0, before = 0;
      for (const auto& [tip, tail] : grip.commands) {
        EXPECT_EQ(Vec3(tip.x, 0, 0), tip);
        EXPECT_EQ(tail, driven == 5 ? tip : Vec3(0));
        EXPECT_LE(tip.x - before, 0.01) << "a ramp";
        before = tip.x;
        most = std::max(most, tip.x);
      }
      EXPECT_DOUBLE_EQ(most, push.force());
      EXPECT_GT(grip.commands.size(), 1000u);
      EXPECT_EQ(grip.commands.back().first, Vec3(0));
      EXPECT_EQ(grip.commands.back().second, Vec3(0));
    }
  }
}

/// A servo that exceeds its limits.
class WrongServo final : public servo::TickSource {
 public:
  explicit WrongServo(const std::function<void(servo::Sample&)>& spoil) : spoil_(spoil) {}
  void prepare(const rendering::Scene&, const rendering::Renderer&,
               const servo::HomeZone&) override {
    sample_.tick = ~0u;
  }
  const servo::Sample& next() noexcept override {
    sample_.phase = servo::Phase::feeling;
    sample_.time_ns += 1'000'000;
    ++sample_.tick;
    sample_.device1 = Vec3(std::min(1.0, 0.005 * sample_.tick), 0, 0);
    spoil_(sample_);
    return sample_;
  }
  servo::ServoQuality stop() noexcept override {
    stopped = true;
    return {};
  }
  bool stopped = false;

 private:
  const std::function<void(servo::Sample&)> spoil_;
  servo::Sample sample_;
};

TEST(ForceDirectionCheck, ReportsWrongCommands) {
  const ForceDirectionCheck push({2, 0.5, 0.2}, 5);
  const std::pair<std::string, std::function<void(servo::Sample&)>> cases[] = {
      {"", [](servo::Sample&) {}},
      {"above the limit of 2.00 N", [](servo::Sample& s) { s.device2.z = s.tick < 400 ? 0 : 2.1; }},
      {"for a push of 1.00 N", [](servo::Sample& s) { s.device1.x = 0.01 * s.tick; }},
      {"changed by 0.60 N in a tick", [](servo::Sample& s) { s.device1.x = s.tick < 9 ? 0 : 0.6; }},
      {"no more than 0.40 N", [](servo::Sample& s) { s.device1 *= 0.4; }},
      {"the forces went off",
       [](servo::Sample& s) { s.faults = s.tick > 9 ? servo::servo_fault::kTripped : 0; }}};
  for (const auto& [what, spoil] : cases) {
    WrongServo servo(spoil);
    const std::string said = push.push(servo, [] { return false; });
    EXPECT_NE(said.find(what), std::string::npos) << said;
    EXPECT_EQ(said.empty(), what.empty()) << said;
    EXPECT_TRUE(servo.stopped);
  }
  WrongServo servo([](servo::Sample&) {});
  EXPECT_NE(push.push(servo, [] { return true; }), "");
  EXPECT_TRUE(servo.stopped);
}

TEST(Preflight, ALostDeviceIsHomedAgain) {
  Preflight preflight({0.03, 0});
  home(preflight);
  preflight.add(sample({0, 0, 0}, 0, true));
  EXPECT_EQ(preflight.step(), Step::homing);
}

}  // namespace
}  // namespace palpate::runner::session
