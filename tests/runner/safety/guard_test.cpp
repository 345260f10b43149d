// Whatever ends the runner, zero force is at the device within 20 ms, by the device's own record.

#include <gtest/gtest.h>
#include <sys/mman.h>
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
#include "stimuli/primitives.h"
#include "tests/runner/recording_device.h"

namespace palpate::runner {
namespace {

using testing::DeviceRecord;
using testing::RecordingDevice;

constexpr std::int64_t kLimit_ns = 20'000'000;

DeviceReading stylus_at(double z) { return {{{0, 0, z}, {0, 0, z + 0.12}}, 0, false}; }
/// At rest outside for 0.15 s at 1 kHz, then down into the cube, for a second in all.
DeviceReading visiting(int tick) {
  const int at = tick % 1000;
  return stylus_at(at < 150 ? 0.1 : std::max(0.029, 0.1 - 4e-4 * (at - 150)));
}

/// Shared with the runner's process.
struct Shared {
  DeviceRecord record;
  std::atomic<bool> felt{false};  ///< there has been force for a while, and is
  std::atomic<bool> go{false};    ///< the runner is to do what ends it
};
struct Stage {
  Stage()
      : shared(new (mmap(nullptr, sizeof(Shared), PROT_READ | PROT_WRITE,
                         MAP_SHARED | MAP_ANONYMOUS, -1, 0)) Shared) {}
  ~Stage() { munmap(shared, sizeof(Shared)); }
  Shared* shared;
};

void nap(int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }

GuardSettings no_rights() {
  GuardSettings settings;
  settings.linger = 0.3;
  settings.priority = 0;
  return settings;
}

/// A session's thread and a servo's. Once `end` returns, or a signal has asked for the end, it is
/// over. Trials are begun again until one has had force for a while, since a busy machine may make
/// one trip; then no fault is cleared any more.
void feel_a_cube(Shared& shared, Device& device, FaultSignals& signals,
                 const std::function<void(ServoThread&)>& end) {
  const rendering::Scene scene({{std::make_shared<const stimuli::ConvexMesh>(stimuli::cube(0.06)),
                                 Pose{}, stimuli::Material{}, 0, nullptr}},
                               false);
  RealClock clock;
  ServoSettings settings;
  settings.realtime = {0, false, -1};
  settings.ring = 1 << 17;
  ServoThread servo(device, clock, settings);
  signals.watch(&servo);
  int felt = 0;
  while (felt < 100) {
    servo.clear_fault();
    servo.prepare(scene, rendering::point_renderer(), {0.062, 0.05, 0.005});
    std::uint32_t faults = 0;
    for (felt = 0; felt < 100 && !(faults & servo_fault::kTripped);) {
      const Sample& sample = servo.next();
      faults = sample.faults & ~servo_fault::kTripped;
      if (sample.tick > 0) faults = sample.faults;
      felt = glm::length(sample.device1) > 0.3 ? felt + 1 : 0;
    }
  }
  shared.felt = true;
  end(servo);
  while (signals.end_requested() == 0) nap(1);
  signals.watch(static_cast<ServoThread*>(nullptr));
}

/// The runner: a session's thread, a servo's, a guard.
void run(Shared& shared, const std::function<void(ServoThread&)>& end) {
  FaultSignals signals;
  GuardedDevice device(
      [&shared] { return std::make_unique<RecordingDevice>(shared.record, visiting); },
      no_rights());
  signals.watch(&device);
  feel_a_cube(shared, device, signals, end);
  signals.watch(static_cast<GuardedDevice*>(nullptr));
}

struct Outcome {
  std::int64_t zero_after_ns = 0;  ///< the last force came so long after the event
  std::int64_t late_ns = 0;        ///< longest oversleeping of this process meanwhile
  int zeros = 0;                   ///< zero commands since
};

/// Waits for force, causes the event, and looks at the record for `for_ms` after it.
Outcome after(const Shared& shared, const std::function<void()>& event, int for_ms) {
  while (!shared.felt) nap(1);
  const DeviceRecord& record = shared.record;
  RealClock clock;
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
  std::function<void(ServoThread&)> by_itself;
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
      run(*stage.shared, [&](ServoThread& servo) {
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
            [](ServoThread&) {
              volatile int* volatile nowhere = nullptr;
              *nowhere = 1;
            },
            SIGSEGV},
        End{"failed_assert", 0, [](ServoThread&) { std::abort(); }, SIGABRT},
        End{"uncaught_exception", 0,
            [](ServoThread&) {
              std::thread([] { throw std::runtime_error("nobody catches this"); }).join();
            },
            SIGABRT},
        End{"caught_exception", 0,
            [](ServoThread&) { throw std::runtime_error("the database is full"); }, 0},
        End{"emergency_key", 0, [](ServoThread& servo) { servo.emergency_zero(); }, SIGKILL}),
    [](const auto& end) { return std::string(end.param.name); });

// Without a guard, nobody but the servo's own thread can send the zero: whoever dies must wait.
TEST(FaultSignals, ADyingThreadWaitsForTheServosZeroForce) {
  Stage stage;
  const int runner = fork();
  if (runner == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    FaultSignals signals;
    RecordingDevice device(stage.shared->record, visiting);
    feel_a_cube(*stage.shared, device, signals, [](ServoThread&) { std::abort(); });
    _exit(0);
  }
  int status = 0;
  waitpid(runner, &status, 0);
  ASSERT_TRUE(WIFSIGNALED(status));
  EXPECT_EQ(WTERMSIG(status), SIGABRT);
  EXPECT_EQ(stage.shared->record.last_force(), 0);
}

TEST(Guard, AStoppedRunnerThatGoesOnFeelsNothingUntilCleared) {
  Stage stage;
  const DeviceRecord& record = stage.shared->record;
  const int runner = fork();
  if (runner == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    run(*stage.shared, [](ServoThread&) {});
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

TEST(Guard, WhatTheDeviceSaysComesThrough) {
  Stage stage;
  GuardedDevice device(
      [&] {
        return std::make_unique<RecordingDevice>(stage.shared->record, [](int tick) {
          DeviceReading reading = stylus_at(0.001 * tick);
          reading.buttons = static_cast<std::uint8_t>(tick);
          if (tick == 3) {
            reading.lost = true;
            reading.trouble = DeviceTrouble::not_homed;
          }
          return reading;
        });
      },
      no_rights());
  EXPECT_EQ(device.capabilities().name, "recording");
  EXPECT_EQ(device.capabilities().serial, "R-1");
  EXPECT_EQ(device.capabilities().max_rate, 10000);
  bool homing_lost = false;
  for (int i = 0; i < 20; ++i) {
    const DeviceReading reading = device.read();
    if (reading.trouble == DeviceTrouble::not_homed) homing_lost = reading.lost;
    if (reading.trouble != DeviceTrouble::none) continue;
    EXPECT_NEAR(reading.stylus.tip.z, 0.001 * reading.buttons, 1e-12) << "one whole reading";
    device.write(Vec3(0), Vec3(0));
  }
  EXPECT_TRUE(homing_lost);
}

TEST(Guard, OpeningWaitsForATrueReading) {
  Stage stage;
  GuardedDevice device(
      [&] {
        return std::make_unique<RecordingDevice>(stage.shared->record, [](int tick) {
          nap(tick == 0 ? 100 : 0);
          return stylus_at(0.1);
        });
      },
      no_rights());
  EXPECT_EQ(device.read().stylus.tip.z, 0.1) << "no reading is late before there was one";
  const auto dying = [&] {
    return std::make_unique<RecordingDevice>(stage.shared->record,
                                             [](int) -> DeviceReading { _exit(1); });
  };
  EXPECT_THROW(GuardedDevice(dying, no_rights()), std::runtime_error);
  const auto hanging = [&] {
    return std::make_unique<RecordingDevice>(stage.shared->record, [](int) {
      nap(100'000);
      return stylus_at(0);
    });
  };
  GuardSettings hasty = no_rights();
  hasty.patience = 0.1;
  EXPECT_THROW(GuardedDevice(hanging, hasty), std::runtime_error);
}

TEST(Guard, NoForceBeforeAZeroCommandAndNoneAfterAnEmergency) {
  Stage stage;
  GuardSettings settings = no_rights();
  settings.silence = 60;  // only what is asked for
  GuardedDevice device(
      [&] { return std::make_unique<RecordingDevice>(stage.shared->record, visiting); }, settings);
  const auto command = [&](double force) {
    const std::uint32_t before = stage.shared->record.count;
    device.write({0, 0, force}, Vec3(0));
    while (stage.shared->record.count == before) nap(1);
    return stage.shared->record.last_force();
  };
  EXPECT_EQ(command(1), 0) << "forces begin with a zero";
  EXPECT_EQ(command(0), 0);
  EXPECT_EQ(command(1), 1);
  device.emergency_zero();
  while (stage.shared->record.last_force() != 0) nap(1);
  EXPECT_EQ(command(1), 0);
  EXPECT_EQ(command(0), 0);
  EXPECT_EQ(command(1), 0) << "the runner has not yet heard of it";
  DeviceReading reading;
  do reading = device.read();
  while (reading.trouble == DeviceTrouble::late);
  EXPECT_TRUE(reading.lost);
  EXPECT_EQ(reading.trouble, DeviceTrouble::guarded);
  EXPECT_EQ(command(1), 0);
  EXPECT_EQ(command(0), 0);
  EXPECT_EQ(command(1), 1);
}

TEST(Guard, WhyADeviceCannotBeOpenedIsSaid) {
  const auto factory = []() -> std::unique_ptr<Device> {
    throw std::runtime_error("the Falcon is asleep");
  };
  try {
    GuardedDevice device(factory, no_rights());
    FAIL();
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "the Falcon is asleep");
  }
  const auto dying = []() -> std::unique_ptr<Device> { _exit(1); };
  EXPECT_THROW(GuardedDevice(dying, no_rights()), std::runtime_error);
  const auto hanging = []() -> std::unique_ptr<Device> {
    nap(100'000);
    return nullptr;
  };
  GuardSettings hasty = no_rights();
  hasty.patience = 0.05;
  EXPECT_THROW(GuardedDevice(hanging, hasty), std::runtime_error);
}

TEST(Guard, AGuardThatHasEndedIsALostDevice) {
  Stage stage;
  GuardedDevice device(
      [&] { return std::make_unique<RecordingDevice>(stage.shared->record, visiting); },
      no_rights());
  device.read();
  kill(device.guard_process(), SIGKILL);
  DeviceReading reading;
  for (int i = 0; i < 1000 && !reading.lost; ++i) {
    reading = device.read();
    device.write(Vec3(0), Vec3(0));
  }
  EXPECT_TRUE(reading.lost);
  EXPECT_EQ(reading.trouble, DeviceTrouble::guard_lost);
}

/// Reads and commands zero until the reading is as wished; the last one.
template <class Wished>
DeviceReading read_until(GuardedDevice& device, Wished wished) {
  DeviceReading reading = device.read();
  for (int i = 0; i < 20'000 && !wished(reading); ++i) {
    device.write(Vec3(0), Vec3(0));
    reading = device.read();
  }
  return reading;
}

bool is_lost(const DeviceReading& reading) { return reading.lost; }
bool is_well(const DeviceReading& reading) {
  return !reading.lost && reading.trouble == DeviceTrouble::none;
}

TEST(Guard, ALateGuardIsALostDeviceOnlyUntilItIsBack) {
  Stage stage;
  GuardedDevice device(
      [&] { return std::make_unique<RecordingDevice>(stage.shared->record, visiting); },
      no_rights());
  for (int i = 0; i < 3; ++i) {
    EXPECT_TRUE(is_well(read_until(device, is_well)));
    kill(device.guard_process(), SIGSTOP);
    EXPECT_EQ(read_until(device, is_lost).trouble, DeviceTrouble::guard_late);
    kill(device.guard_process(), SIGCONT);
  }
  EXPECT_TRUE(is_well(read_until(device, is_well)));
}

TEST(Guard, AGuardThatHangsForGoodCountsAsEnded) {
  Stage stage;
  GuardSettings settings = no_rights();
  settings.given_up = 0.2;
  GuardedDevice device(
      [&] { return std::make_unique<RecordingDevice>(stage.shared->record, visiting); }, settings);
  kill(device.guard_process(), SIGSTOP);
  RealClock clock;
  const std::int64_t began = clock.now_ns();
  EXPECT_EQ(read_until(device, is_lost).trouble, DeviceTrouble::guard_late);
  const DeviceReading last = read_until(device, [](const DeviceReading& reading) {
    return reading.trouble == DeviceTrouble::guard_lost;
  });
  EXPECT_EQ(last.trouble, DeviceTrouble::guard_lost);
  EXPECT_GE(clock.now_ns() - began, 190'000'000);
}

/// Pulled out and put in again by whoever has the stage.
class Plug final : public Device {
 public:
  explicit Plug(Stage& stage) : stage_(stage), recording_(stage.shared->record, visiting) {}
  const DeviceCapabilities& capabilities() const override { return recording_.capabilities(); }
  DeviceReading read() noexcept override {
    open_ = open_ && !stage_.shared->go;
    DeviceReading reading = recording_.read();
    reading.lost = !open_;
    reading.trouble = open_ ? DeviceTrouble::none : DeviceTrouble::unplugged;
    return reading;
  }
  void write(const Vec3& device1, const Vec3& device2) noexcept override {
    recording_.write(device1, device2);
  }
  void reopen() override {
    nap(60);
    if (stage_.shared->go) throw std::runtime_error("nothing is plugged in");
    open_ = true;
  }

 private:
  Stage& stage_;
  RecordingDevice recording_;
  bool open_ = true;
};

TEST(Guard, WhatWasUnpluggedIsOpenedAgainWhenAsked) {
  Stage stage;
  GuardedDevice device([&] { return std::make_unique<Plug>(stage); }, no_rights());
  const auto reopened = [&device](const DeviceReading&) { return !device.reopening(); };
  for (int i = 0; i < 3; ++i) {
    stage.shared->go = true;
    EXPECT_EQ(read_until(device, is_lost).trouble, DeviceTrouble::unplugged);
    device.ask_to_reopen();
    EXPECT_TRUE(device.reopening());
    EXPECT_EQ(read_until(device,
                         [](const DeviceReading& reading) {
                           return reading.trouble == DeviceTrouble::reopening;
                         })
                  .trouble,
              DeviceTrouble::reopening);
    EXPECT_TRUE(read_until(device, reopened).lost);
    EXPECT_EQ(device.reopen_trouble(), "nothing is plugged in");
    stage.shared->go = false;
    nap(10);
    EXPECT_TRUE(read_until(device, is_lost).lost) << "not before it is asked";
    device.ask_to_reopen();
    read_until(device, reopened);
    EXPECT_EQ(device.reopen_trouble(), "");
    EXPECT_TRUE(is_well(read_until(device, is_well)));
  }
}

TEST(Guard, OpeningAgainTakesTheForceOffFirst) {
  Stage stage;
  GuardSettings settings = no_rights();
  settings.silence = 60;  // only what is asked for
  GuardedDevice device([&] { return std::make_unique<Plug>(stage); }, settings);
  const auto command = [&](double force) {
    const std::uint32_t before = stage.shared->record.count;
    device.write({0, 0, force}, Vec3(0));
    while (stage.shared->record.count == before) nap(1);
    return stage.shared->record.last_force();
  };
  command(0);
  EXPECT_EQ(command(1), 1);
  device.ask_to_reopen();
  while (device.reopening()) nap(1);
  EXPECT_EQ(stage.shared->record.last_force(), 0);
  EXPECT_EQ(command(0), 0);
  EXPECT_EQ(command(1), 0) << "the runner has not yet heard of it";
}

}  // namespace
}  // namespace palpate::runner
