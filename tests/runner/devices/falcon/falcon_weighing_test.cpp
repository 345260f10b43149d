#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>

#include "runner/devices/falcon/calibration.h"
#include "runner/devices/falcon/driver.h"
#include "runner/devices/falcon/falcon.h"
#include "tests/runner/devices/falcon/emulator.h"
#include "tests/runner/devices/falcon/fake_transport.h"
#include "tests/runner/devices/falcon/line_clock.h"
#include "tests/runner/devices/falcon/scripted_guide.h"

namespace palpate::runner::devices::falcon {
namespace {

using testing::Emulator;
using testing::FakeTransport;
using testing::LineClock;
using testing::ScriptedGuide;

struct Bench {
  Emulator emulator;
  FakeTransport* line = nullptr;
  std::unique_ptr<FalconDevice> device;
  WeighingSettings settings;
  std::vector<std::string> asked;

  explicit Bench(double counts_per_torque, double friction = 0.2) {
    emulator.preload(true);
    emulator.plant.counts_per_torque = counts_per_torque;
    emulator.plant.friction = friction;
    auto transport = std::make_unique<FakeTransport>(emulator);
    line = transport.get();
    line->control(request::kLatency, 1);
    device = std::make_unique<FalconDevice>(
        std::make_unique<FalconDriver>(std::move(transport), DriverSettings{}));
    settings.weights = {0.1, 0.2, 0.3};
    settings.settle = 2;
    settings.cycles = 1;
  }

  /// Holds the grip at first, then releases it and hangs one weight after another.
  ForceCalibration weigh_all(const std::vector<double>& hung) {
    const double floating = 0.3;  // N, weight of the arms
    ScriptedGuide guide([&, this](int question) {
      emulator.plant.hand_stiffness = question == 0 ? 200 : 0;
      emulator.plant.hand_damping = question == 0 ? 6 : 0.5;
      const double mass = question <= 1 ? 0 : hung.at(static_cast<std::size_t>(question - 2));
      emulator.plant.mass = 0.15 + mass;
      emulator.plant.load = {0, -(9.80665 * mass + floating), 0};
      return true;
    });
    LineClock clock(*line);
    ForceCalibration force = weigh(*device, clock, guide, settings);
    asked = guide.asked;
    return force;
  }
  std::string failure(const std::vector<double>& hung) {
    try {
      weigh_all(hung);
    } catch (const GuideError& error) {
      return error.what();
    }
    return "";
  }
};

TEST(FalconWeighing, FindsTheTrueScale) {
  for (const double truth : {-1e4, -5e3, -2.5e3, -1.3e4}) {
    Bench bench(truth);
    const ForceCalibration force = bench.weigh_all({0.1, 0.2, 0.3});
    EXPECT_NEAR(force.counts_per_torque / truth, 1, 0.02) << truth;
    EXPECT_LT(force.residual, 0.05);
    EXPECT_LT(force.sideways, 0.02);
    EXPECT_NEAR(force.arm_weight, 0.3, 0.05);
    EXPECT_EQ(force.serial, "FAKE0001");
    EXPECT_EQ(bench.asked.size(), 5U);
    EXPECT_TRUE(bench.emulator.torque_is_zero());
  }
}

TEST(FalconWeighing, FrictionCancels) {
  Bench smooth(-5e3, 0), rough(-5e3, 0.5);
  const double a = smooth.weigh_all({0.1, 0.2, 0.3}).counts_per_torque;
  const double b = rough.weigh_all({0.1, 0.2, 0.3}).counts_per_torque;
  EXPECT_NEAR(b / a, 1, 0.03);
}

TEST(FalconWeighing, AWrongWeightIsDetected) {
  Bench bench(-5e3);
  const std::string failure = bench.failure({0.1, 0.3, 0.2});  // swapped
  EXPECT_NE(failure.find("off a straight line"), std::string::npos) << failure;
  EXPECT_TRUE(bench.emulator.torque_is_zero());
}

TEST(FalconWeighing, MissingWeightsAreDetected) {
  Bench bench(-5e3);
  const std::string failure = bench.failure({0, 0, 0});
  EXPECT_NE(failure.find("which is impossible"), std::string::npos) << failure;
}

TEST(FalconWeighing, TooHeavyWeightsEndWithoutForce) {
  Bench bench(-1e4);
  const std::string failure = bench.failure({3, 3, 3});
  EXPECT_NE(failure.find("lighter weights"), std::string::npos) << failure;
  EXPECT_TRUE(bench.emulator.torque_is_zero());
}

TEST(FalconWeighing, StoppingAndUnpluggingEndIt) {
  Bench stopped(-1e4);
  ScriptedGuide guide([](int question) { return question < 1; });
  LineClock clock(*stopped.line);
  EXPECT_THROW(weigh(*stopped.device, clock, guide, stopped.settings), GuideError);
  EXPECT_TRUE(stopped.emulator.torque_is_zero());

  Bench gone(-1e4);
  ScriptedGuide pulls([&gone](int question) {
    gone.line->unplugged = question == 1;
    return true;
  });
  LineClock its_clock(*gone.line);
  try {
    weigh(*gone.device, its_clock, pulls, gone.settings);
    ADD_FAILURE();
  } catch (const GuideError& error) {
    EXPECT_NE(std::string(error.what()).find("unplugged"), std::string::npos) << error.what();
  }
}

TEST(FalconWeighing, AGripFarFromTheCentreIsSentBack) {
  Bench bench(-1e4);
  ScriptedGuide guide([&bench](int question) {
    bench.emulator.plant.hand_stiffness = question <= 1 ? 300 : 0;
    bench.emulator.plant.hand_damping = 6;
    const Vec3 at = question == 0 ? Vec3(0.02, 0, 0) : Vec3(0);
    bench.emulator.plant.hand = [at](double) { return kCentre + at; };
    return question < 2;
  });
  LineClock clock(*bench.line);
  EXPECT_THROW(weigh(*bench.device, clock, guide, bench.settings), GuideError);  // stopped at 2
  ASSERT_EQ(guide.asked.size(), 3U);
  EXPECT_NE(guide.asked[1].find("-2 cm right"), std::string::npos) << guide.asked[1];
}

TEST(FalconWeighing, ASingleWeightIsRefused) {
  EXPECT_THROW(fit_scale({{0, {0, 0, 0.1}}}), GuideError);
  EXPECT_THROW(fit_scale({}), GuideError);
}

}  // namespace
}  // namespace palpate::runner::devices::falcon
