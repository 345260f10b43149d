// A tick of the servo's thread must not allocate, lock, or make system calls other than its sleep.

#include <gtest/gtest.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cmath>
#include <csignal>
#include <cstddef>
#include <cstdlib>
#include <cstring>

#include "runner/evidence/tick_meters.h"
#include "runner/servo/servo_thread.h"
#include "stimuli/convex_mesh.h"
#include "stimuli/primitives.h"

namespace palpate::runner::servo {
namespace {

/// Slides over an object from tick 300 on; calls `hook` from the servo's thread.
class SlidingDevice final : public Device {
 public:
  explicit SlidingDevice(void (*hook)(int tick)) : hook_(hook) {
    capabilities_.max_force = 8;
    capabilities_.max_rate = 10000;
  }
  const DeviceCapabilities& capabilities() const override { return capabilities_; }
  DeviceReading read() noexcept override {
    const int tick = tick_.fetch_add(1);
    hook_(tick);
    const double z = tick < 300 ? 0.1 : std::max(0.0285, 0.1 - 1e-3 * (tick - 300));
    const double x = 0.01 * std::sin(tick * 0.01);
    return {{{x, 0, z}, {x, 0.02, z + 0.11}}, 0, false};
  }
  void write(const Vec3&, const Vec3&) noexcept override {}
  int tick() const { return tick_; }

 private:
  void (*hook_)(int);
  std::atomic<int> tick_{0};
  DeviceCapabilities capabilities_;
};

rendering::Scene ball() {
  return rendering::Scene(
      {{std::make_shared<const stimuli::ConvexMesh>(stimuli::icosphere(0.03, 3)), Pose{},
        stimuli::Material{}, 0, nullptr}});
}

/// Two trials; the second begins and ends while the thread is watched. \return force was felt
bool two_trials(SlidingDevice& device) {
  RealClock clock;
  ServoSettings settings;
  settings.rate = 2000;
  settings.realtime = {0, false, -1};
  settings.ring = 256;  // overflows
  const rendering::Scene scene = ball();
  ServoThread servo(device, clock, settings);
  bool felt = false;
  servo.prepare(scene, rendering::ray_renderer(), {0.05, 0.002, 0.005});
  const auto wait = [&](int until) {
    Sample sample;
    while (device.tick() < until) {
      usleep(1000);
      servo.clear_fault();  // a busy machine makes ticks late
      if (servo.latest(sample)) felt = felt || sample.rendering.contacts > 0;
    }
  };
  wait(600);
  servo.stop();
  servo.prepare(scene, rendering::ray_renderer(), {0.05, 0.002, 0.005});
  servo.next();
  wait(900);
  servo.stop();
  wait(1000);
  return felt;
}

std::atomic<std::uint64_t> allocated_at_20{0}, allocated_at_1000{1};

TEST(ServoTick, AllocatesNothing) {
  if (!evidence::counts_allocations())
    GTEST_SKIP() << "allocations are not counted under sanitizers";
  SlidingDevice device([](int tick) {
    if (tick == 20) allocated_at_20 = evidence::allocations();
    if (tick == 950) allocated_at_1000 = evidence::allocations();
  });
  EXPECT_TRUE(two_trials(device));
  EXPECT_EQ(allocated_at_1000, allocated_at_20);
}

/// From now on any system call of this thread kills the process, except those that a tick needs
/// (sleep; the time, if it needs a call) and those that end the thread.
void allow_only_sleep() {
  constexpr std::array kAllowed = {
      SYS_clock_nanosleep, SYS_clock_gettime, SYS_rt_sigreturn, SYS_exit,
      SYS_exit_group,      SYS_madvise,       SYS_munmap,       SYS_rt_sigprocmask};
  std::array<sock_filter, kAllowed.size() + 3> filter;
  filter[0] = BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr));
  for (std::size_t i = 0; i < kAllowed.size(); ++i) {
    filter[i + 1] = BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, static_cast<unsigned>(kAllowed[i]),
                             static_cast<unsigned char>(kAllowed.size() - i), 0);
  }
  filter[kAllowed.size() + 1] = BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_KILL_PROCESS);
  filter[kAllowed.size() + 2] = BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW);
  // The thread's end frees memory; let the allocator initialise itself for this thread first.
  void* volatile first = std::malloc(64);
  std::free(first);
  const sock_fprog program{static_cast<unsigned short>(filter.size()), filter.data()};
  if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 ||
      prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) != 0)
    _exit(77);
}

/// Runs it in a separate process. \return its wait status
int run_watched(void (*hook)(int tick)) {
  const int child = fork();
  if (child == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    SlidingDevice device(hook);
    _exit(two_trials(device) ? 0 : 1);
  }
  int status = 0;
  waitpid(child, &status, 0);
  return status;
}

TEST(ServoTick, CallsTheSystemOnlyToSleep) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "the sanitizers call the system";
#endif
  const int status = run_watched([](int tick) {
    if (tick == 20) allow_only_sleep();
  });
  ASSERT_TRUE(WIFEXITED(status)) << "killed by " << strsignal(WTERMSIG(status));
  if (WEXITSTATUS(status) == 77) GTEST_SKIP() << "no seccomp here";
  EXPECT_EQ(WEXITSTATUS(status), 0);
  const int caught = run_watched([](int tick) {
    if (tick == 20) allow_only_sleep();
    if (tick == 700) getppid();
  });
  EXPECT_TRUE(WIFSIGNALED(caught)) << "the test itself sees one call";
}

}  // namespace
}  // namespace palpate::runner::servo
