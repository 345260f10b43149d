#include <gtest/gtest.h>

#include <cmath>
#include <memory>

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
  Bench() {
    emulator.preload(false);
    emulator.plant.hand_stiffness = 400;
    emulator.plant.hand_damping = 20;
    auto transport = std::make_unique<FakeTransport>(emulator);
    line = transport.get();
    line->control(request::kLatency, 1);
    device = std::make_unique<FalconDevice>(
        std::make_unique<FalconDriver>(std::move(transport), DriverSettings{}));
  }
};

TEST(FalconHoming, AsksTheExperimenterAndWaits) {
  Bench bench;
  bench.emulator.plant.hand = [](double t) {
    return kCentre + Vec3(0, 0, 0.035 * std::sin(4 * t));
  };
  LineClock clock(*bench.line);
  ScriptedGuide guide([](int) { return true; });
  wait_until_homed(*bench.device, clock, guide);
  EXPECT_EQ(bench.emulator.homed(), 7U);
  ASSERT_EQ(guide.said.size(), 1U);
  EXPECT_NE(guide.said[0].find("FAKE0001"), std::string::npos);
  EXPECT_NE(guide.said[0].find("pull the grip fully out"), std::string::npos);
  EXPECT_LT(bench.emulator.last_torque_ns(), 0);
}

TEST(FalconHoming, StopsWhenAskedOrUnplugged) {
  Bench bench;
  LineClock clock(*bench.line);
  ScriptedGuide guide([](int) { return false; });
  guide.ask("");
  EXPECT_THROW(wait_until_homed(*bench.device, clock, guide), GuideError);
  ScriptedGuide patient([](int) { return true; });
  bench.line->unplugged = true;
  EXPECT_THROW(wait_until_homed(*bench.device, clock, patient), GuideError);
}

}  // namespace
}  // namespace palpate::runner::devices::falcon
