// Whatever ends the runner, the device receives zero force within 20 ms, by its own record.

#include <gtest/gtest.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <functional>
#include <glm/geometric.hpp>
#include <memory>
#include <stdexcept>
#include <thread>

#include "runner/safety/fault_signals.h"
#include "runner/safety/guarded_device.h"
#include "runner/servo/servo_thread.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/primitives.h"
#include "tests/runner/recording_device.h"
#include "tests/runner/safety/guard_stage.h"

namespace palpate::runner::safety {
namespace {

using runner::testing::DeviceRecord;
using runner::testing::RecordingDevice;
using testing::nap;
using testing::no_rights;
using testing::Shared;
using testing::Stage;
using testing::visiting;

constexpr std::int64_t kLimit_ns = 20'000'000;

/// A session's thread and a servo's. Ends once `end` returns or a signal requests the end. Restarts
/// trials until one has had force for a while, because a busy machine may trip one; afterwards it
/// clears no fault.
void feel_a_cube(Shared& shared, servo::Device& device, FaultSignals& signals,
                 const std::function<void(servo::ServoThread&)>& end) {
  const rendering::Scene scene({{std::make_shared<const stimuli::ConvexMesh>(stimuli::cube(0.06)),
                                 Pose{}, stimuli::Material{}, 0, nullptr}},
                               false);
  servo::RealClock clock;
  servo::ServoSettings settings;
  settings.realtime = {0, false, -1};
  settings.ring = 1 << 17;
  servo::ServoThread servo(device, clock, settings);
  signals.watch(&servo);
  int felt = 0;
  while (felt < 100) {
    servo.clear_fault();
    servo.prepare(scene, rendering::point_renderer(), {0.062, 0.05, 0.005});
    std::uint32_t faults = 0;
    for (felt = 0; felt < 100 && !(faults & servo::servo_fault::kTripped);) {
      const servo::Sample& sample = servo.next();
      faults = sample.faults & ~servo::servo_fault::kTripped;
      if (sample.tick > 0) faults = sample.faults;
      felt = glm::length(sample.device1) > 0.3 ? felt + 1 : 0;
    }
  }
  shared.felt = true;
  end(servo);
  while (signals.end_requested() == 0) nap(1);
  signals.watch(static_cast<servo::ServoThread*>(nullptr));
}

/// The runner: a session's thread, a servo's, a guard.
void run(Shared& shared, const std::function<void(servo::ServoThread&)>& end) {
  FaultSignals signals;
  GuardedDevice device(
      [&shared] { return std::make_unique<RecordingDevice>(shared.record, visiting); },
      no_rights());
  signals.watch(&device);
  feel_a_cube(shared, device, signals, end);
  signals.watch(static_cast<GuardedDevice*>(nullptr));
}

struct Outcome {
  std::int64_t zero_after_ns = 0;  ///< time of the last force after the event
  std::int64_t late_ns = 0;        ///< longest oversleeping of this process in that time
  int zeros = 0;                   ///< number of zero commands since
};

/// Waits for force, causes the event, and looks at the record for `for_ms` after it.
Outcome after(const Shared& shared, const std::function<void()>& event, int for_ms) {
  while (!shared.felt) nap(1);
  const DeviceRecord& record = shared.record;
  servo::RealClock clock;
  const std::int64_t began = clock.now_ns();
  event();
  Outcome out;
  for (std::int64_t due = began; due < began + for_ms * 1'000'000LL; due += 1'000'000) {
    clock.wait_until(due);
    out.late_ns = std::max(out.late_ns, clock.now_ns() - due);
  }
  const std::uint32_t count = record.count;
  for (std::uint32_t i = 0; i < count; ++i) {
    const DeviceRecord::Write& write = record.writes[i];
    if (write.time_ns < began) continue;
    if (write.force > 0) {
      out.zeros = 0;
    } else if (out.zeros++ == 0) {
      out.zero_after_ns = write.time_ns - began;
    }
  }
  return out;
}

struct End {
  const char* name;
  int signal;  ///< sent from outside; 0: none
  std::function<void(servo::ServoThread&)> by_itself;
  int dies_of;  ///< signal
};

void PrintTo(const End& end, std::ostream* out) { *out << end.name; }

class RunnerEnds : public ::testing::TestWithParam<End> {};

TEST_P(RunnerEnds, ZeroForceWithin20ms) {
  Stage stage;
  const DeviceRecord& record = stage.shared->record;
  const int runner = fork();
  if (runner == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    try {
      run(*stage.shared, [&](servo::ServoThread& servo) {
        if (!GetParam().by_itself) return;
        while (!stage.shared->go) nap(1);
        GetParam().by_itself(servo);
      });
    } catch (const std::exception&) {
    }
    _exit(0);
  }
  const Outcome outcome = after(
      *stage.shared,
      [&] {
        stage.shared->go = true;
        if (GetParam().signal != 0) kill(runner, GetParam().signal);
      },
      200);
  kill(runner, SIGKILL);
  int status = 0;
  waitpid(runner, &status, 0);
  EXPECT_LE(outcome.zero_after_ns, kLimit_ns + outcome.late_ns)
      << "this machine was up to " << outcome.late_ns << " ns late";
  EXPECT_GT(outcome.zeros, 0);
  RecordProperty("zero_after_ns", std::to_string(outcome.zero_after_ns));
  if (GetParam().dies_of != 0) {
    ASSERT_TRUE(WIFSIGNALED(status));
    EXPECT_EQ(WTERMSIG(status), GetParam().dies_of);
  }
  for (int i = 0; i < 5000 && !record.closed; ++i) nap(1);
  EXPECT_TRUE(record.closed) << "the guard lets go of the device when its runner has gone";
  EXPECT_EQ(record.last_force(), 0);
}

INSTANTIATE_TEST_SUITE_P(
    All, RunnerEnds,
    ::testing::Values(
        End{"sigkill", SIGKILL, nullptr, SIGKILL}, End{"sigstop", SIGSTOP, nullptr, SIGKILL},
        End{"sigterm", SIGTERM, nullptr, 0}, End{"sigint", SIGINT, nullptr, 0},
        End{"sigsegv", SIGSEGV, nullptr, SIGSEGV},
        End{"segmentation_fault", 0,
            [](servo::ServoThread&) {
              volatile int* volatile nowhere = nullptr;
              *nowhere = 1;
            },
            SIGSEGV},
        End{"failed_assert", 0, [](servo::ServoThread&) { std::abort(); }, SIGABRT},
        End{"uncaught_exception", 0,
            [](servo::ServoThread&) {
              std::thread([] { throw std::runtime_error("nobody catches this"); }).join();
            },
            SIGABRT},
        End{"caught_exception", 0,
            [](servo::ServoThread&) { throw std::runtime_error("the database is full"); }, 0},
        End{"emergency_key", 0, [](servo::ServoThread& servo) { servo.emergency_zero(); },
            SIGKILL}),
    [](const auto& end) { return std::string(end.param.name); });

// Without a guard, only the servo's own thread can send zero force: a failing thread must wait for
// it.
TEST(FaultSignals, AFailingThreadWaitsForTheServosZeroForce) {
  Stage stage;
  const int runner = fork();
  if (runner == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    FaultSignals signals;
    RecordingDevice device(stage.shared->record, visiting);
    feel_a_cube(*stage.shared, device, signals, [](servo::ServoThread&) { std::abort(); });
    _exit(0);
  }
  int status = 0;
  waitpid(runner, &status, 0);
  ASSERT_TRUE(WIFSIGNALED(status));
  EXPECT_EQ(WTERMSIG(status), SIGABRT);
  EXPECT_EQ(stage.shared->record.last_force(), 0);
}

TEST(Guard, ARunnerThatWasStoppedGivesNoForceUntilCleared) {
  Stage stage;
  const DeviceRecord& record = stage.shared->record;
  const int runner = fork();
  if (runner == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    run(*stage.shared, [](servo::ServoThread&) {});
    _exit(0);
  }
  const Outcome stopped = after(
      *stage.shared, [&] { kill(runner, SIGSTOP); }, 100);
  EXPECT_LE(stopped.zero_after_ns, kLimit_ns + stopped.late_ns);
  EXPECT_GT(stopped.zeros, 10) << "again and again";
  const std::uint32_t before = record.count;
  kill(runner, SIGCONT);
  for (int i = 0; i < 5000 && record.count < before + 500; ++i) nap(1);
  for (std::uint32_t i = before; i < record.count; ++i) ASSERT_EQ(record.writes[i].force, 0);
  kill(runner, SIGTERM);
  int status = 0;
  waitpid(runner, &status, 0);
  EXPECT_TRUE(WIFEXITED(status));
}

}  // namespace
}  // namespace palpate::runner::safety
