// The servo: forces begin as specified, stay within their limits, and end at any fault.

#include "runner/servo/servo.h"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <limits>

#include "stimuli/convex_mesh.h"
#include "stimuli/primitives.h"
#include "tests/runner/fake_device.h"

namespace palpate::runner::servo {
namespace {

using runner::testing::FakeDevice;

rendering::Scene cube_scene() {
  return rendering::Scene({{std::make_shared<const stimuli::ConvexMesh>(stimuli::cube(0.06)),
                            Pose{}, stimuli::Material{}, 0, nullptr}},
                          false);
}

DeviceReading stylus_at(double z) { return {{{0, 0, z}, {0, 0, z + 0.12}}, 0, false}; }

/// Rests at 0.1 m for 0.6 s, then moves down to `floor` at 0.1 m/s.
DeviceReading come_down(int tick, double floor) {
  return stylus_at(tick < 600 ? 0.1 : std::max(floor, 0.1 - 1e-4 * (tick - 600)));
}

TEST(Servo, ForcesBeginAfterARestAtHome) {
  FakeDevice device([](int tick) { return come_down(tick, 0.029); });
  VirtualClock clock;
  Servo servo(device, clock, 1000, ForceLimits{});
  servo.prepare(cube_scene(), rendering::point_renderer(), HomeZone{});
  int zero_tick = -1;
  for (int tick = 0; tick < 3000; ++tick) {
    const Sample& sample = servo.tick();
    if (sample.phase == Phase::feeling && zero_tick < 0) {
      zero_tick = tick;
      EXPECT_EQ(sample.tick, 0u);
    }
  }
  EXPECT_EQ(zero_tick, 499);  // the 500th tick at rest
  EXPECT_NEAR(device.force.z, 800 * 0.001, 1e-9);
  const ServoQuality quality = servo.stop();
  EXPECT_EQ(quality.ticks, 3000u - 499u);
  EXPECT_EQ(quality.missed_ticks, 0u);
  EXPECT_EQ(quality.longest_period_ns, 1'000'000);
  EXPECT_NEAR(quality.max_force, 0.8, 1e-9);
  EXPECT_EQ(device.force, Vec3(0));
}

TEST(Servo, KeepingWarmChangesNoTick) {
  const auto slide = [](int tick) {
    DeviceReading reading = come_down(tick, 0.028);
    reading.stylus.tip.x = reading.stylus.tail.x = 0.01 * std::sin(0.005 * tick);
    return reading;
  };
  FakeDevice device(slide), other_device(slide);
  stimuli::Material rough;  // the place of sticking is carried from tick to tick
  rough.damping = 1;
  rough.friction_static = 0.6;
  rough.friction_dynamic = 0.4;
  const rendering::Scene scene({{std::make_shared<const stimuli::ConvexMesh>(stimuli::cube(0.06)),
                                 Pose{}, rough, 0, nullptr}});
  VirtualClock clock, other_clock;
  Servo servo(device, clock, 1000, ForceLimits{}), other(other_device, other_clock, 1000, {});
  other.keep_warm();
  for (int trial = 0; trial < 2; ++trial) {
    servo.prepare(scene, rendering::ray_renderer(), HomeZone{});
    other.prepare(scene, rendering::ray_renderer(), HomeZone{});
    bool touched = false;
    for (int tick = 0; tick < 3000; ++tick) {
      const Sample& sample = servo.tick();
      const Sample& warm = other.tick();
      ASSERT_EQ(warm.phase, sample.phase);
      ASSERT_EQ(warm.rendering.force, sample.rendering.force);
      ASSERT_EQ(warm.rendering.torque, sample.rendering.torque);
      ASSERT_EQ(warm.device1, sample.device1);
      ASSERT_EQ(warm.faults, sample.faults);
      touched = touched || sample.rendering.contacts > 0;
    }
    EXPECT_EQ(touched, trial == 0);
    EXPECT_EQ(servo.stop().ticks, other.stop().ticks);
  }
}

TEST(Servo, NoForceBeforeTheStylusHasRested) {
  // Pressed into the cube from the start: never in the home zone.
  FakeDevice device([](int) { return stylus_at(0.02); });
  VirtualClock clock;
  Servo servo(device, clock, 1000, ForceLimits{});
  servo.prepare(cube_scene(), rendering::point_renderer(), HomeZone{});
  for (int tick = 0; tick < 2000; ++tick) {
    ASSERT_EQ(servo.tick().phase, Phase::homing);
    ASSERT_EQ(device.force, Vec3(0));
  }
  // Outside, but never still.
  FakeDevice restless([](int tick) { return stylus_at(0.1 + 0.01 * std::sin(0.02 * tick)); });
  Servo other(restless, clock, 1000, ForceLimits{});
  other.prepare(cube_scene(), rendering::point_renderer(), HomeZone{});
  for (int tick = 0; tick < 5000; ++tick) ASSERT_EQ(other.tick().phase, Phase::homing);
}

TEST(Servo, LimitsRampsAndRecordsForce) {
  for (const double device_limit : {8.0, 2.0}) {
    // 20 mm into the cube: 16 N rendered.
    FakeDevice device([](int tick) { return come_down(tick, 0.01); });
    device.limit(device_limit);
    VirtualClock clock;
    Servo servo(device, clock, 1000, ForceLimits{});
    servo.prepare(cube_scene(), rendering::point_renderer(), HomeZone{});
    Vec3 last(0);
    bool cut = false;
    for (int tick = 0; tick < 3000; ++tick) {
      const Sample& sample = servo.tick();
      ASSERT_LE(glm::length(device.last1), std::min(6.0, device_limit) + 1e-12);
      ASSERT_LE(glm::length(device.last1 - last), 0.5 + 1e-12);
      ASSERT_EQ(sample.device1, device.last1) << "what was commanded";
      cut = cut || (sample.faults & servo_fault::kForceLimited) != 0;
      last = device.last1;
    }
    EXPECT_TRUE(cut);
    EXPECT_NEAR(device.last1.z, std::min(6.0, device_limit), 1e-9);
    EXPECT_NEAR(servo.tick().rendering.device1.z, 16, 1e-9) << "what was rendered";
  }
  // In contact from time zero on: forces ramp up over 200 ms.
  FakeDevice pressed([](int tick) { return stylus_at(tick < 500 ? 0.1 : 0.0275); });
  VirtualClock clock;
  Servo servo(pressed, clock, 1000, ForceLimits{});
  servo.prepare(cube_scene(), rendering::point_renderer(), HomeZone{});
  int onset = -1;
  for (int tick = 0; tick < 1000; ++tick) {
    const Sample& sample = servo.tick();
    if (sample.phase == Phase::feeling && onset < 0) onset = tick;
    if (tick < 500) continue;
    ASSERT_NEAR(pressed.force.z, std::min(2.0, 2.0 * (tick - onset + 1) / 200), 1e-9) << tick;
  }
}

TEST(Servo, AnEmergencyIsZeroWithinTheTickAndUntilCleared) {
  FakeDevice device([](int tick) { return come_down(tick, 0.029); });
  VirtualClock clock;
  Servo servo(device, clock, 1000, ForceLimits{});
  servo.prepare(cube_scene(), rendering::point_renderer(), HomeZone{});
  for (int tick = 0; tick < 2000; ++tick) servo.tick();
  ASSERT_GT(device.force.z, 0.5);
  servo.emergency_zero();
  EXPECT_TRUE(servo.tick().faults & servo_fault::kEmergency);
  EXPECT_EQ(device.force, Vec3(0));
  servo.stop();
  servo.prepare(cube_scene(), rendering::point_renderer(), HomeZone{});
  for (int tick = 0; tick < 2000; ++tick) {
    EXPECT_TRUE(servo.tick().faults & servo_fault::kTripped);
    ASSERT_EQ(device.force, Vec3(0)) << "a new trial does not clear it";
  }
  servo.clear_fault();
  EXPECT_EQ(servo.tick().faults & servo_fault::kTripped, 0u);
}

TEST(Servo, TroubleOfTheDeviceIsRecorded) {
  for (const DeviceTrouble trouble :
       {DeviceTrouble::unplugged, DeviceTrouble::not_homed, DeviceTrouble::guard_lost}) {
    FakeDevice device([trouble](int tick) {
      DeviceReading reading = come_down(tick, 0.029);
      if (tick == 2000) {
        reading.lost = true;
        reading.trouble = trouble;
      }
      return reading;
    });
    VirtualClock clock;
    Servo servo(device, clock, 1000, ForceLimits{});
    servo.prepare(cube_scene(), rendering::point_renderer(), HomeZone{});
    for (int tick = 0; tick < 2000; ++tick) servo.tick();
    const Sample& sample = servo.tick();
    EXPECT_EQ(sample.trouble, trouble);
    EXPECT_TRUE(sample.faults & servo_fault::kDeviceLost);
    EXPECT_EQ(device.force, Vec3(0));
    EXPECT_STRNE(advice(trouble), "");
    for (int tick = 0; tick < 100; ++tick) servo.tick();
    EXPECT_EQ(device.force, Vec3(0)) << "plugged in again: still zero";
  }
}

struct DeviceFault {
  const char* name;
  DeviceReading reading;
  std::uint32_t bit;
};

void PrintTo(const DeviceFault& fault, std::ostream* out) { *out << fault.name; }

class ServoFault : public ::testing::TestWithParam<DeviceFault> {};

TEST_P(ServoFault, GivesZeroForceFromThenOn) {
  constexpr int kFaultTick = 2000;  // in contact
  FakeDevice device(
      [](int tick) { return tick == kFaultTick ? GetParam().reading : come_down(tick, 0.029); });
  VirtualClock clock;
  Servo servo(device, clock, 1000, ForceLimits{});
  servo.prepare(cube_scene(), rendering::point_renderer(), HomeZone{});
  for (int tick = 0; tick < kFaultTick; ++tick) servo.tick();
  ASSERT_GT(device.force.z, 0.5);
  const Sample& sample = servo.tick();
  EXPECT_EQ(device.force, Vec3(0)) << "at once";
  EXPECT_TRUE(sample.faults & GetParam().bit);
  EXPECT_TRUE(sample.faults & servo_fault::kTripped);
  for (int tick = 0; tick < 1000; ++tick) {
    servo.tick();
    ASSERT_EQ(device.force, Vec3(0)) << "for good";
  }
}

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

INSTANTIATE_TEST_SUITE_P(All, ServoFault,
                         ::testing::Values(DeviceFault{"nan_tip",
                                                       {{{0, kNaN, 0.029}, {0, 0, 0.15}}, 0, false},
                                                       rendering::render_fault::kNonFinite},
                                           DeviceFault{"nan_tail",
                                                       {{{0, 0, 0.029}, {0, 0, kNaN}}, 0, false},
                                                       rendering::render_fault::kNonFinite},
                                           DeviceFault{
                                               "infinite",
                                               {{{0, 0, -kInfinity}, {0, 0, 0.15}}, 0, false},
                                               rendering::render_fault::kNonFinite},
                                           DeviceFault{"lost",
                                                       {{{0, 0, 0.029}, {0, 0, 0.15}}, 0, true},
                                                       servo_fault::kDeviceLost}),
                         [](const auto& fault) { return std::string(fault.param.name); });

/// Stalls once for some ticks.
class StallingClock final : public Clock {
 public:
  StallingClock(std::int64_t at_ns, std::int64_t for_ns) : at_(at_ns), for_(for_ns) {}
  std::int64_t now_ns() noexcept override { return now_; }
  void wait_until(std::int64_t when_ns) noexcept override {
    now_ = std::max(now_, when_ns);
    if (now_ >= at_ && for_ > 0) {
      now_ += for_;
      for_ = 0;
    }
  }

 private:
  std::int64_t now_ = 0, at_, for_;
};

TEST(Servo, FiveMissedTicksEndTheForce) {
  for (const int missed : {1, 4, 5, 50}) {
    FakeDevice device([](int tick) { return come_down(tick, 0.029); });
    StallingClock clock(2'000'000'000, missed * 1'000'000);
    Servo servo(device, clock, 1000, ForceLimits{});
    servo.prepare(cube_scene(), rendering::point_renderer(), HomeZone{});
    std::uint32_t faults = 0;
    for (int tick = 0; tick < 2500; ++tick) faults |= servo.tick().faults;
    EXPECT_EQ((faults & servo_fault::kMissedTicks) != 0, missed >= 5) << missed;
    EXPECT_EQ(device.force.z == 0, missed >= 5) << missed;
    const ServoQuality quality = servo.stop();
    EXPECT_EQ(quality.missed_ticks, static_cast<std::uint64_t>(missed));
    EXPECT_EQ(quality.longest_period_ns, (missed + 1) * 1'000'000);
  }
}

TEST(Servo, LimitsTheTotalForceOfThreeAxes) {
  // The stylus lies on the cube's upper face, centred: each end gets half.
  const auto lie_down = [](double floor) {
    return [floor](int tick) {
      const double z = tick < 600 ? 0.1 : std::max(floor, 0.1 - 1e-4 * (tick - 600));
      return DeviceReading{{{-0.06, 0, z}, {0.06, 0, z}}, 0, false};
    };
  };
  for (const bool controlled : {false, true}) {
    for (const int driven : {3, 5}) {
      for (const double floor : {0.026, 0.01}) {  // 4 mm deep, 3.2 N; 20 mm deep, 16 N
        FakeDevice device(lie_down(floor), driven);
        VirtualClock clock;
        Servo servo(device, clock, 1000, ForceLimits{});
        if (controlled) servo.control_passivity();
        servo.prepare(cube_scene(), rendering::ray_renderer(), HomeZone{});
        Vec3 last(0);
        for (int tick = 0; tick < 3000; ++tick) {
          const Sample& sample = servo.tick();
          if (driven == 5) continue;
          ASSERT_EQ(device.last2, Vec3(0));
          ASSERT_LE(glm::length(device.force), 6 + 1e-12);
          ASSERT_LE(glm::length(device.force - last), 0.5 + 1e-12);
          ASSERT_EQ(sample.device1, device.force) << "what was commanded";
          last = device.force;
        }
        const bool deep = floor < 0.02;
        const double whole = deep ? (driven == 3 ? 6 : 12) : 3.2;
        EXPECT_NEAR(device.force.z, whole, 1e-6) << driven << " " << floor;
        EXPECT_NEAR(device.last1.z, driven == 3 ? whole : whole / 2, 1e-6);
      }
    }
  }
}

TEST(Servo, ScalesForceAndTorqueTogether) {
  for (const double middle : {-0.05, 0.0, 0.05}) {  // of the stylus beside that of the face, m
    const auto lie_down = [middle](int tick) {
      const double z = tick < 600 ? 0.1 : std::max(0.01, 0.1 - 1e-4 * (tick - 600));
      return DeviceReading{{{middle - 0.06, 0, z}, {middle + 0.06, 0, z}}, 0, false};
    };
    FakeDevice device(lie_down);
    device.drive_at_grip(0.2);
    VirtualClock clock;
    Servo servo(device, clock, 1000, ForceLimits{});
    servo.prepare(cube_scene(), rendering::ray_renderer(), HomeZone{});
    for (int tick = 0; tick < 3000; ++tick) {
      const Sample& sample = servo.tick();
      ASSERT_LE(glm::length(device.force), 6 + 1e-12);
      ASSERT_LE(0.12 * glm::length(device.last2), 0.2 + 1e-12) << "N m about the tip";
      ASSERT_EQ(sample.device2, device.last2) << "what was commanded";
    }
    const Sample sample = servo.tick();
    // At the right end of the face the force is the limit, otherwise the torque.
    const double share = sample.rendering.device2.z / sample.rendering.force.z;
    EXPECT_NEAR(0.12 * device.last2.z, std::min(0.2, 0.12 * share * 6), 1e-9);
    EXPECT_EQ(0.12 * share * 6 < 0.2, middle > 0);
    EXPECT_NEAR(device.last1.z / device.last2.z,
                sample.rendering.device1.z / sample.rendering.device2.z, 1e-9);
    EXPECT_TRUE(sample.faults & servo_fault::kForceLimited);
  }
}

TEST(Servo, WithoutMotorsMissedTicksAreOnlyReported) {
  for (const int missed : {4, 5, 50, 2000}) {
    FakeDevice device([](int tick) { return come_down(tick, 0.029); });
    device.take_motors_away();
    StallingClock clock(2'000'000'000, missed * std::int64_t{1'000'000});
    Servo servo(device, clock, 1000, ForceLimits{});
    servo.prepare(cube_scene(), rendering::point_renderer(), HomeZone{});
    std::uint32_t faults = 0;
    for (int tick = 0; tick < 2500; ++tick) faults |= servo.tick().faults;
    EXPECT_EQ(faults & servo_fault::kTripped, 0u) << missed;
    EXPECT_NEAR(device.force.z, 0.8, 1e-9) << "what is shown goes on: " << missed;
    const ServoQuality quality = servo.stop();
    EXPECT_EQ((quality.faults & servo_fault::kMissedTicks) != 0, missed >= 5) << missed;
    EXPECT_EQ(quality.missed_ticks, static_cast<std::uint64_t>(missed));
    EXPECT_EQ(quality.longest_period_ns, (missed + 1) * std::int64_t{1'000'000});
  }
}

TEST(Servo, ANanPoseEndsTheTrialWithoutMotorsToo) {
  FakeDevice device([](int tick) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    return tick == 2000 ? DeviceReading{{{0, nan, 0.029}, {0, 0, 0.15}}, 0, false}
                        : come_down(tick, 0.029);
  });
  device.take_motors_away();
  VirtualClock clock;
  Servo servo(device, clock, 1000, ForceLimits{});
  servo.prepare(cube_scene(), rendering::point_renderer(), HomeZone{});
  Sample sample;
  for (int tick = 0; tick <= 2000; ++tick) sample = servo.tick();
  EXPECT_TRUE(sample.faults & servo_fault::kTripped);
}

TEST(Servo, TheWorkspaceMapMovesAndScales) {
  // Twice as large in the virtual world, seen from (0, 0, 0.05).
  FakeDevice device([](int tick) {
    DeviceReading r = come_down(tick, 0.029);
    r.stylus.tip = 0.5 * r.stylus.tip + Vec3(0, 0, 0.05);
    r.stylus.tail = 0.5 * r.stylus.tail + Vec3(0, 0, 0.05);
    return r;
  });
  VirtualClock clock;
  Servo servo(device, clock, 1000, ForceLimits{}, {{0, 0, 0.05}, 2});
  servo.prepare(cube_scene(), rendering::point_renderer(), HomeZone{});
  for (int tick = 0; tick < 3000; ++tick) servo.tick();
  EXPECT_NEAR(device.force.z, 0.8, 1e-9);
}

TEST(Servo, AReachStretchesTheStylusAndConservesWork) {
  // The real stylus stays 0.4 m above: its tip is 0.48 m nearer to the cube, at twice its height.
  FakeDevice device([](int tick) {
    DeviceReading r = come_down(tick, 0.029);
    r.stylus.tip.z += 0.48;
    r.stylus.tail.z += 0.48;
    return r;
  });
  VirtualClock clock;
  const rendering::Reach by_tail{.factor = 5, .fraction = 1};
  Servo servo(device, clock, 1000, ForceLimits{}, {{}, 1, by_tail});
  servo.prepare(cube_scene(), rendering::point_renderer(), HomeZone{});
  Sample sample;
  for (int tick = 0; tick < 3000; ++tick) sample = servo.tick();
  EXPECT_NEAR(sample.probe.tip.z, 0.029, 1e-12);
  EXPECT_NEAR(sample.probe.tail.z, 0.629, 1e-12);
  EXPECT_NEAR(device.last1.z, 5 * 0.8, 1e-9);
  EXPECT_NEAR(device.last2.z, -4 * 0.8, 1e-9);
  EXPECT_NEAR(sample.rendering.force.z, 0.8, 1e-9);
}

TEST(Servo, TheWholeToolMustBeInTheHomeZone) {
  rendering::Tool hook{{{{0, 0, 0}, {0, 0, 0.12}}, {{0, 0, 0}, {0, 0, -0.05}}}};
  const auto first_force = [&](const rendering::Tool& tool, double height) {
    FakeDevice device([&](int) { return stylus_at(height); });
    VirtualClock clock;
    Servo servo(device, clock, 1000, ForceLimits{});
    const rendering::Scene scene({{std::make_shared<const stimuli::ConvexMesh>(stimuli::cube(0.06)),
                                   Pose{}, stimuli::Material{}, 0, nullptr}},
                                 true, tool);
    servo.prepare(scene, rendering::ray_renderer(), HomeZone{});
    for (int tick = 0; tick < 1000; ++tick)
      if (servo.tick().phase == Phase::feeling) return tick;
    return -1;
  };
  EXPECT_EQ(first_force({}, 0.1), 499);
  EXPECT_EQ(first_force(hook, 0.1), -1);  // its hook reaches down to 0.05 m, and the zone to 0.062
  EXPECT_EQ(first_force(hook, 0.112), 499);
}

TEST(Servo, NanStylusIsNotAtHome) {
  rendering::Tool one{{{{0, 0, 0}, {0, 0, 0.12}}}}, two = one;
  two.segments.push_back({{0, 0, 0}, {0.01, 0, 0.02}});
  const rendering::LineProbe far{{0, 0, 0.5}, {0, 0, 0.62}};
  for (const rendering::Tool& tool : {rendering::Tool{}, one, two}) {
    for (int coordinate = 0; coordinate < 6; ++coordinate) {
      rendering::LineProbe bad = far;
      (coordinate < 3 ? bad.tip : bad.tail)[coordinate % 3] = kNaN;
      FakeDevice device([&](int) { return DeviceReading{bad, 0, false}; });
      VirtualClock clock;
      Servo servo(device, clock, 1000, ForceLimits{});
      const rendering::Scene scene(
          {{std::make_shared<const stimuli::ConvexMesh>(stimuli::cube(0.06)), Pose{},
            stimuli::Material{}, 0, nullptr}},
          true, tool);
      servo.prepare(scene, rendering::ray_renderer(), HomeZone{.rest = 0});
      for (int tick = 0; tick < 10; ++tick)
        ASSERT_EQ(servo.tick().phase, Phase::homing) << tool.segments.size() << ' ' << coordinate;
    }
  }
}

TEST(ForceLimiter, RampsUpAndLimitsSizeAndChange) {
  ForceLimiter limiter({6, 0.5, 0.2}, 1e-3);
  DeviceForces out;
  Vec3 last(0);
  for (int tick = 1; tick <= 400; ++tick) {
    out = limiter.apply({0, 0, 2}, {0, 0, 0});
    ASSERT_NEAR(out.device1.z, 2 * std::min(1.0, tick / 200.0), 1e-12);
  }
  for (int tick = 0; tick < 100; ++tick) {
    last = out.device1;
    out = limiter.apply({0, 0, 12}, {6, 0, 0});
    ASSERT_LE(glm::length(out.device1 - last), 0.5 + 1e-12);
    ASSERT_TRUE(out.limited);
  }
  EXPECT_NEAR(out.device1.z, 6, 1e-9);
  EXPECT_NEAR(out.device2.x, 3, 1e-9) << "both scaled together";
}

TEST(ForceLimiter, TheLimitsAreExactWithinRounding) {
  for (int ulps = -6; ulps <= 6; ++ulps) {
    double size = 6;
    for (int i = 0; i < std::abs(ulps); ++i) size = std::nextafter(size, ulps < 0 ? 0 : 9);
    ForceLimiter limiter({6, kInfinity, 1e-3}, 1e-3);
    const DeviceForces out = limiter.apply({0, size, 0}, {0, 0, 0});
    EXPECT_EQ(out.limited, size > 6) << ulps;
    EXPECT_EQ(out.device1, Vec3(0, std::min(size, 6 / size * size), 0)) << ulps;
    ForceLimiter slow({kInfinity, 6, 1e-3}, 1e-3);
    EXPECT_EQ(slow.apply({0, 0, 0}, {size, 0, 0}).limited, size > 6) << ulps;
  }
}

TEST(ForceLimiter, NotFiniteIsZeroUntilCleared) {
  for (const double bad : {kNaN, kInfinity, -kInfinity}) {
    ForceLimiter limiter({6, 0.5, 0.2}, 1e-3);
    for (int tick = 0; tick < 300; ++tick) limiter.apply({0, 0, 2}, {0, 0, 0});
    EXPECT_EQ(limiter.apply({0, 0, 1}, {0, bad, 0}).device1, Vec3(0));
    EXPECT_TRUE(limiter.tripped());
    EXPECT_EQ(limiter.apply({0, 0, 2}, {0, 0, 0}).device1, Vec3(0));
    limiter.clear();
    EXPECT_NEAR(limiter.apply({0, 0, 2}, {0, 0, 0}).device1.z, 0.01, 1e-12) << "a new ramp";
  }
}

}  // namespace
}  // namespace palpate::runner::servo
