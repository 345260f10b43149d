#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <memory>
#include <string>

#include "runner/devices/falcon/driver.h"
#include "runner/devices/falcon/falcon.h"
#include "runner/devices/falcon/stylus_from_ends.h"
#include "tests/runner/devices/falcon/emulator.h"
#include "tests/runner/devices/falcon/fake_transport.h"
#include "tests/runner/devices/falcon/scripted_guide.h"

namespace palpate::runner::devices::falcon {
namespace {

using testing::Emulator;
using testing::FakeTransport;
using testing::ScriptedGuide;

constexpr double kLength = 0.12;

/// Two devices in an arbitrary relative pose; a stiff hand moves the stylus between them.
struct Bench {
  Emulator tip_emulator, tail_emulator;
  FakeTransport *tip_line = nullptr, *tail_line = nullptr;
  std::unique_ptr<FalconDriver> tip, tail;
  Pose tail_in_tip{{0.002, -0.003, kLength + 0.001}, glm::normalize(Quat(1, 0.05, -0.03, 0.9))};

  Bench() {
    const auto driver = [](Emulator& emulator, FakeTransport*& line, const char* serial) {
      emulator.preload(true);
      emulator.plant.hand_stiffness = 5000;
      emulator.plant.hand_damping = 50;
      auto transport = std::make_unique<FakeTransport>(emulator, serial);
      line = transport.get();
      line->control(request::kLatency, 1);
      return std::make_unique<FalconDriver>(std::move(transport), DriverSettings{});
    };
    tip = driver(tip_emulator, tip_line, "TIP");
    tail = driver(tail_emulator, tail_line, "TAIL");
  }

  /// Both ends, in the tip's world frame, m.
  void hold(const Vec3& tip_at, const Vec3& tail_at) {
    const Vec3 in_tail = glm::conjugate(tail_in_tip.orientation) * (tail_at - tail_in_tip.position);
    const Vec3 a = kCentre + from_world(tip_at), b = kCentre + from_world(in_tail);
    tip_emulator.plant.hand = [a](double) { return a; };
    tail_emulator.plant.hand = [b](double) { return b; };
  }
  void hold_stylus(const Vec3& tip_at, const Vec3& axis) {
    hold(tip_at, tip_at + kLength * glm::normalize(axis));
  }
  /// Forces of both emulated devices in the tip's world frame, N.
  Vec3 tip_force() const { return to_world(tip_emulator.force()); }
  Vec3 tail_force() const { return tail_in_tip.orientation * to_world(tail_emulator.force()); }
  void wait() {
    tip_line->wait(1'000'000);
    tail_line->wait(1'000'000);
  }

  Falcon2Device device() {
    return {std::move(tip), std::move(tail), StylusFromEnds(tail_in_tip, kLength)};
  }
};

servo::DeviceReading run(Bench& bench, Falcon2Device& device, int ticks,
                         const Vec3& force1 = Vec3(0), const Vec3& force2 = Vec3(0)) {
  servo::DeviceReading reading;
  for (int i = 0; i < ticks; ++i) {
    bench.wait();
    reading = device.read();
    device.write(force1, force2);
  }
  return reading;
}

TEST(Falcon2, SensesTheStylus) {
  Bench bench;
  Falcon2Device device = bench.device();
  EXPECT_EQ(device.capabilities().name, "falcon2");
  EXPECT_EQ(device.capabilities().sensed_freedom, 5);
  for (const Vec3& axis : {Vec3(0, 0, 1), Vec3(0.2, 0, 1), Vec3(-0.1, 0.15, 1)}) {
    bench.hold_stylus({0.005, -0.01, 0.002}, axis);
    const servo::DeviceReading reading = run(bench, device, 600);
    EXPECT_FALSE(reading.lost);
    EXPECT_LT(glm::length(reading.stylus.tip - Vec3(0.005, -0.01, 0.002)), 2e-4);
    const Vec3 seen = glm::normalize(reading.stylus.tail - reading.stylus.tip);
    EXPECT_GT(glm::dot(seen, glm::normalize(axis)), std::cos(0.003));
    EXPECT_NEAR(device.stylus().stretch(), 0, 5e-4);
  }
}

TEST(Falcon2, CommandsEachEndItsForce) {
  Bench bench;
  Falcon2Device device = bench.device();
  bench.hold_stylus({0, 0, 0}, {0.1, 0, 1});
  run(bench, device, 600);
  run(bench, device, 20, {0.5, -1, 0.3}, {-0.5, 0.4, 1});
  EXPECT_LT(glm::length(bench.tip_force() - Vec3(0.5, -1, 0.3)), 0.03);
  EXPECT_LT(glm::length(bench.tail_force() - Vec3(-0.5, 0.4, 1)), 0.03);
}

TEST(Falcon2, AGripThatSlipsOffTheStylusGivesZeroForce) {
  Bench bench;
  Falcon2Device device = bench.device();
  bench.hold_stylus({0, 0, 0}, {0, 0, 1});
  run(bench, device, 600);
  EXPECT_FALSE(run(bench, device, 20, {1, 0, 0}, {1, 0, 0}).lost);
  EXPECT_FALSE(bench.tip_emulator.torque_is_zero());
  bench.hold({0, 0, 0}, {0, 0, kLength + 0.012});
  EXPECT_TRUE(run(bench, device, 300, {1, 0, 0}, {1, 0, 0}).lost);
  EXPECT_TRUE(bench.tip_emulator.torque_is_zero());
  EXPECT_TRUE(bench.tail_emulator.torque_is_zero());
  EXPECT_NEAR(device.stylus().stretch(), 0.012, 1e-3);
}

TEST(Falcon2, EitherDeviceLostGivesZeroForceAtBoth) {
  for (const bool at_tip : {true, false}) {
    Bench bench;
    Falcon2Device device = bench.device();
    bench.hold_stylus({0, 0, 0}, {0, 0, 1});
    run(bench, device, 600);
    run(bench, device, 20, {1, 0, 0}, {0, 1, 0});
    (at_tip ? bench.tip_line : bench.tail_line)->unplugged = true;
    EXPECT_TRUE(run(bench, device, 3, {1, 0, 0}, {0, 1, 0}).lost);
    const Emulator& other = at_tip ? bench.tail_emulator : bench.tip_emulator;
    EXPECT_TRUE(other.torque_is_zero()) << at_tip;
    EXPECT_THROW(device.reopen(), TransportError);
    (at_tip ? bench.tip_line : bench.tail_line)->unplugged = false;
    device.reopen();
    EXPECT_TRUE(bench.tip_emulator.torque_is_zero() && bench.tail_emulator.torque_is_zero());
    EXPECT_FALSE(run(bench, device, 20).lost);
    run(bench, device, 20, {1, 0, 0}, {0, 1, 0});
    EXPECT_FALSE(bench.tip_emulator.torque_is_zero() || bench.tail_emulator.torque_is_zero());
  }
}

TEST(Falcon2, ReadsTheButtonsOfBothGrips) {
  Bench bench;
  bench.tip_emulator.buttons = 4;
  bench.tail_emulator.buttons = 1;
  Falcon2Device device = bench.device();
  EXPECT_EQ(run(bench, device, 3).buttons, 0x14);
}

/// Advances the time of both lines.
class BenchClock final : public servo::Clock {
 public:
  explicit BenchClock(Bench& bench) : bench_(bench) {}
  std::int64_t now_ns() noexcept override { return bench_.tip_line->now_ns(); }
  void wait_until(std::int64_t when_ns) noexcept override {
    const std::int64_t left = when_ns - now_ns();
    if (left <= 0) return;
    bench_.tip_line->wait(left);
    bench_.tail_line->wait(left);
  }

 private:
  Bench& bench_;
};

/// The grips are pinned together, or `offset` apart in a jig.
PairRegistration registration(Bench& bench, const Vec3& offset, const std::function<bool(int)>& act,
                              int points = 8) {
  ScriptedGuide guide([&](int question) {
    const double a = 0.8 * question;
    const Vec3 place = 0.018 * Vec3(std::cos(a), std::sin(a), question % 3 - 1.0);
    bench.hold(place, place + offset);
    return act(question);
  });
  BenchClock clock(bench);
  FalconDevice tip(std::move(bench.tip)), tail(std::move(bench.tail));
  return register_pair(tip, tail, clock, guide, {kLength, offset, points, 0.3});
}

TEST(FalconRegistration, FindsTheRelativePoseOfTheDevices) {
  for (const Vec3& offset : {Vec3(0), Vec3(0, 0, kLength)}) {
    Bench bench;
    if (offset == Vec3(0)) bench.tail_in_tip.position = {0.003, -0.005, 0.004};
    const auto pair = registration(bench, offset, [](int) { return true; });
    EXPECT_LT(glm::length(pair.tail_in_tip.position - bench.tail_in_tip.position), 2e-4);
    EXPECT_GT(std::abs(glm::dot(pair.tail_in_tip.orientation, bench.tail_in_tip.orientation)),
              std::cos(0.005));
    EXPECT_LT(pair.residual, 1e-4);
    EXPECT_GT(pair.residual, 0);
    EXPECT_EQ(pair.points, 8);
    EXPECT_EQ(pair.tip_serial, "TIP");
    EXPECT_EQ(pair.tail_serial, "TAIL");
    EXPECT_TRUE(bench.tip_emulator.last_torque_ns() < 0) << "no force is shown";
  }
}

TEST(FalconRegistration, GripsThatComeApartAreDetected) {
  Bench bench;
  bench.tail_in_tip.position = {0.003, -0.005, 0.004};
  try {
    registration(bench, Vec3(0), [&bench](int question) {
      if (question == 4) bench.tail_emulator.plant.hand = [](double) { return kCentre; };
      return true;
    });
    ADD_FAILURE();
  } catch (const GuideError& error) {
    EXPECT_NE(std::string(error.what()).find("fit only within"), std::string::npos) << error.what();
  }
}

TEST(FalconRegistration, APointTakenTwiceIsAskedForAgain) {
  Bench bench;
  bench.tail_in_tip.position = {0.003, -0.005, 0.004};
  ScriptedGuide guide([&bench](int question) {
    const double a = 0.8 * (question - (question > 2 ? 1 : 0));  // the third is the second again
    const Vec3 place = 0.02 * Vec3(std::cos(a), std::sin(a), (question % 3) - 1.0);
    if (question != 2) bench.hold(place, place);
    return question < 6;
  });
  BenchClock clock(bench);
  FalconDevice tip(std::move(bench.tip)), tail(std::move(bench.tail));
  EXPECT_THROW(register_pair(tip, tail, clock, guide, {kLength, Vec3(0), 8, 0.3}), GuideError);
  const auto near = std::count_if(guide.said.begin(), guide.said.end(), [](const auto& text) {
    return text.find("too near") != std::string::npos;
  });
  EXPECT_GE(near, 1);
}

}  // namespace
}  // namespace palpate::runner::devices::falcon
