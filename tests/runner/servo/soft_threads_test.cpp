// Soft bodies stepped beside the servo: forces do not depend on the speed of their threads, except
// in ticks marked as late; if a thread does not answer, forces end.

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdint>
#include <glm/geometric.hpp>
#include <limits>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include "data/base/random.h"
#include "rendering/bodies/soft/soft_build.h"
#include "rendering/bodies/soft/soft_object.h"
#include "rendering/bodies/soft/soft_scene.h"
#include "rendering/renderer.h"
#include "runner/evidence/tick_meters.h"
#include "runner/servo/servo_thread.h"
#include "tests/runner/fake_device.h"

namespace palpate::runner::servo {
namespace {

using rendering::Rendering;
namespace render_fault = rendering::render_fault;

const RealtimeSettings kPlainThread{0, false, -1};

rendering::Scene soft_cubes(int count) {
  std::vector<std::shared_ptr<const rendering::SoftObject>> soft;
  for (int i = 0; i < count; ++i) {
    stimuli::ObjectSpec spec;
    spec.shape = stimuli::ShapeKind::cube;
    spec.edge = 0.05;
    spec.soft = stimuli::Soft{.young = 20000.0 * (i + 1), .points = {}, .resolution = 3 + 2 * i};
    Pose pose;
    pose.position.x = 0.052 * i;
    soft.push_back(rendering::build_soft_object(spec, pose, {0.002, Vec3(0), i}));
  }
  return rendering::soft_scene(rendering::Scene({}, true), {}, std::move(soft), true, {});
}

struct PathTick {
  rendering::LineProbe probe;
  double dt = 0;  ///< s
};

/// A path in and out of both cubes and across them; periods jitter, some are long.
std::vector<PathTick> rough_path(int ticks) {
  constexpr std::uint64_t kSeed = 23;
  Random random(kSeed);
  std::vector<PathTick> path;
  for (int i = 0; i < ticks; ++i) {
    const double t = 0.001 * i;
    const double x = 0.026 + 0.03 * std::sin(5 * t), z = 0.0285 - 0.006 * std::sin(17 * t);
    double dt = 0.001 * (0.6 + 0.8 * random.unit());
    if (i % 97 == 50) dt = 0.013;
    path.push_back({{{x, 0.001, z}, {x + 0.01, 0.001, z + 0.12}}, i > 0 ? dt : 0.001});
  }
  return path;
}

bool equal(const Rendering& a, const Rendering& b) {
  return a.force == b.force && a.torque == b.torque && a.device1 == b.device1 &&
         a.faults == b.faults && a.contacts == b.contacts && a.deepest.depth == b.deepest.depth;
}

TEST(SoftThreads, ReplaysWithoutThreads) {
  const rendering::Scene scene = soft_cubes(2);
  SoftThreads threads(scene, kPlainThread);
  ASSERT_EQ(threads.size(), 2U);
  rendering::RenderState live = scene.initial_state(), again = scene.initial_state();
  threads.attach(live);
  pace_by_tick(again);
  int late = 0, felt = 0;
  const std::vector<PathTick> path = rough_path(1500);
  for (std::size_t i = 0; i < path.size(); ++i) {
    threads[0].stall(i % 300 > 280);
    // Without a sleep a tick takes microseconds, and every step is late.
    if (i % 500 > 50) std::this_thread::sleep_for(std::chrono::microseconds(300));
    const Rendering r = rendering::ray_renderer().tick(scene, live, path[i].probe, path[i].dt);
    const bool was_late = (r.faults & render_fault::kSoftLate) != 0;
    hold_steps(again, was_late);
    const Rendering s = rendering::ray_renderer().tick(scene, again, path[i].probe, path[i].dt);
    ASSERT_TRUE(equal(r, s)) << i;
    late += was_late;
    felt += r.contacts > 0;
  }
  EXPECT_GT(late, 0);
  EXPECT_LT(late, 1400);
  EXPECT_GT(felt, 300);
}

TEST(SoftThreads, AStalledThreadIsToleratedForAWhileThenForcesEnd) {
  const rendering::Scene scene = soft_cubes(1);
  SoftThreads threads(scene, kPlainThread);
  rendering::RenderState state = scene.initial_state();
  threads.attach(state);
  const auto tick = [&](int i) {
    const double z = std::max(0.024, 0.029 - 2e-5 * i);
    std::this_thread::sleep_for(std::chrono::microseconds(300));
    return rendering::ray_renderer().tick(scene, state, {{0, 0, z}, {0, 0, z + 0.12}}, 0.001);
  };
  Rendering before;
  for (int i = 0; i < 400; ++i) before = tick(i);
  ASSERT_GT(before.force.z, 0.1);
  threads[0].stall(true);
  int held = 0;
  Rendering r;
  for (int i = 0; i < 300 && (r.faults & render_fault::kSoftStalled) == 0; ++i, ++held) {
    r = tick(400);
    if ((r.faults & render_fault::kSoftStalled) != 0) break;
    EXPECT_NEAR(r.force.z, before.force.z, 0.2 * before.force.z);
  }
  EXPECT_GT(held, 90);  // a tenth of a second
  EXPECT_LT(held, 120);
  EXPECT_EQ(r.force, Vec3(0));
  EXPECT_EQ(r.device1 + r.device2, Vec3(0));
  threads[0].stall(false);
  for (int i = 0; i < 2000 && r.contacts == 0; ++i) r = tick(400);
  EXPECT_NEAR(r.force.z, before.force.z, 0.2 * before.force.z);
}

/// A body that has failed.
class Broken final : public rendering::SoftStepper {
 public:
  void ask(std::span<const rendering::NodeForce>) noexcept override {}
  bool ready() const noexcept override { return true; }
  bool take(rendering::SoftView&) noexcept override { return ++taken_ < 20; }

 private:
  int taken_ = 0;
};

TEST(SoftThreads, AFailedBodyGivesNoForce) {
  const rendering::Scene scene = soft_cubes(1);
  rendering::RenderState state = scene.initial_state();
  Broken broken;
  rendering::SoftStepper* const steppers[] = {&broken};
  step_elsewhere(state, steppers);
  bool felt = false, failed = false;
  for (int i = 0; i < 400; ++i) {
    const double z = std::max(0.024, 0.028 - 5e-4 * i);
    const Rendering r =
        rendering::ray_renderer().tick(scene, state, {{0, 0, z}, {0, 0, z + 0.12}}, 0.001);
    failed = failed || (r.faults & render_fault::kNonFinite) != 0;
    felt = felt || r.force.z > 0;
    if (!failed) continue;
    ASSERT_EQ(r.force, Vec3(0));
    ASSERT_NE(r.faults & render_fault::kNonFinite, 0U);
  }
  EXPECT_TRUE(felt);
  EXPECT_TRUE(failed);
}

TEST(SoftThreads, ANanOrDistantStepIsAFailure) {
  const rendering::Scene scene = soft_cubes(1);
  const rendering::SoftObject& object = *rendering::soft_objects(scene)[0];
  for (const double wrong : {std::numeric_limits<double>::quiet_NaN(), 1e6}) {
    rendering::SoftObjectState state = rendering::initial_state(object);
    EXPECT_TRUE(step_and_look(object, state.body, {}, state.view));
    state.body.x[state.body.x.size() - 1].x = wrong;
    EXPECT_FALSE(step_and_look(object, state.body, {}, state.view));
  }
}

TEST(SoftThreads, TicksDoNotAllocate) {
  const rendering::Scene scene = soft_cubes(2);
  SoftThreads threads(scene, kPlainThread);
  rendering::RenderState state = scene.initial_state();
  threads.attach(state);
  const std::vector<PathTick> path = rough_path(600);
  // A thread's initial allocations are finished after its first step.
  for (std::size_t made = 0, i = 0; made < threads.size(); ++i) {
    rendering::ray_renderer().tick(scene, state, path[i % path.size()].probe, 0.001);
    std::this_thread::sleep_for(std::chrono::microseconds(200));
    SoftSnapshot snapshot;
    if (threads[made].latest(snapshot) && snapshot.steps > 0) ++made;
  }
  const std::uint64_t before = evidence::allocations();
  for (const PathTick& tick : path)
    rendering::ray_renderer().tick(scene, state, tick.probe, tick.dt);
  EXPECT_EQ(evidence::allocations(), before);
}

/// Virtual time with a short real sleep in each tick.
class SlowClock final : public Clock {
 public:
  std::int64_t now_ns() noexcept override { return now_; }
  void wait_until(std::int64_t when_ns) noexcept override {
    std::this_thread::sleep_for(std::chrono::microseconds(300));
    now_ = std::max(now_, when_ns);
  }

 private:
  std::int64_t now_ = 0;
};

TEST(SoftThreads, TheServoTripsIfTheyStallAndSnapshotsShowTheSurface) {
  runner::testing::FakeDevice device([](int tick) {
    const double z = std::max(0.024, 0.1 - 1e-4 * tick);
    return DeviceReading{{{0, 0, z}, {0, 0, z + 0.12}}, 0, false};
  });
  SlowClock clock;
  ServoSettings settings;
  settings.realtime = kPlainThread;
  ServoThread servo(device, clock, settings);
  servo.prepare(soft_cubes(1), rendering::ray_renderer(), {.radius = 0, .rest = 0});
  SoftThreads* const threads = servo.soft_threads();
  ASSERT_NE(threads, nullptr);
  ASSERT_EQ(threads->size(), 1U);
  Sample sample;
  for (int i = 0; i < 1500; ++i) sample = servo.next();
  EXPECT_GT(sample.device1.z + sample.device2.z, 0.1);
  SoftSnapshot snapshot;
  ASSERT_TRUE((*threads)[0].latest(snapshot));
  const std::vector<Vec3> rest = rendering::soft_objects(soft_cubes(1))[0]->rest;
  double moved = 0;
  for (std::size_t i = 0; i < rest.size(); ++i)
    moved = std::max(moved, glm::distance(rest[i], snapshot.now[i]));
  EXPECT_GT(moved, 0.001);
  (*threads)[0].stall(true);
  for (int i = 0; i < 1000 && (sample.faults & servo_fault::kTripped) == 0; ++i)
    sample = servo.next();
  EXPECT_NE(sample.faults & render_fault::kSoftStalled, 0U);
  EXPECT_EQ(sample.device1 + sample.device2, Vec3(0));
  (*threads)[0].stall(false);
  // It trips again if the fault is cleared before the body has answered.
  for (int i = 0; i < 3000 && (sample.faults & render_fault::kSoftStalled) != 0; ++i)
    sample = servo.next();
  servo.clear_fault();
  for (int i = 0; i < 3000 && !(sample.device1.z + sample.device2.z > 0.1); ++i)
    sample = servo.next();
  EXPECT_GT(sample.device1.z + sample.device2.z, 0.1);
  EXPECT_NE(servo.stop().faults & render_fault::kSoftStalled, 0U);
}

TEST(SoftThreads, WithoutMotorsAStallIsOnlyReported) {
  runner::testing::FakeDevice device([](int tick) {
    const double z = std::max(0.024, 0.1 - 1e-4 * tick);
    return DeviceReading{{{0, 0, z}, {0, 0, z + 0.12}}, 0, false};
  });
  device.take_motors_away();
  SlowClock clock;
  ServoSettings settings;
  settings.realtime = kPlainThread;
  ServoThread servo(device, clock, settings);
  servo.prepare(soft_cubes(1), rendering::ray_renderer(), {.radius = 0, .rest = 0});
  Sample sample;
  for (int i = 0; i < 1500; ++i) sample = servo.next();
  (*servo.soft_threads())[0].stall(true);
  for (int i = 0; i < 1000 && (sample.faults & render_fault::kSoftStalled) == 0; ++i)
    sample = servo.next();
  EXPECT_NE(sample.faults & render_fault::kSoftStalled, 0U);
  EXPECT_EQ(sample.faults & servo_fault::kTripped, 0U);
  (*servo.soft_threads())[0].stall(false);
  for (int i = 0; i < 3000 && !(sample.device1.z + sample.device2.z > 0.1); ++i)
    sample = servo.next();
  EXPECT_GT(sample.device1.z + sample.device2.z, 0.1) << "it comes back by itself";
  EXPECT_EQ(sample.faults & servo_fault::kTripped, 0U);
}

}  // namespace
}  // namespace palpate::runner::servo
