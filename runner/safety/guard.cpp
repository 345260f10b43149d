#include "runner/safety/guard.h"

#include <fcntl.h>
#include <linux/futex.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstring>
#include <ctime>
#include <exception>
#include <thread>

#include "runner/servo/realtime.h"

namespace palpate::runner::safety {
namespace {

constexpr std::int64_t kNsPerSecond = 1'000'000'000;

template <std::size_t kSize>
void keep(std::array<char, kSize>& to, const std::string& from) {
  to.fill('\0');
  std::copy_n(from.begin(), std::min(from.size(), kSize - 1), to.begin());
}

}  // namespace

GuardedReading::GuardedReading(const servo::DeviceReading& from, std::uint32_t request_,
                               std::uint32_t trips_)
    : tip_and_tail{from.stylus.tip.x,  from.stylus.tip.y,  from.stylus.tip.z,
                   from.stylus.tail.x, from.stylus.tail.y, from.stylus.tail.z},
      request(request_),
      trips(trips_),
      buttons(from.buttons),
      lost(from.lost),
      trouble(from.trouble) {}

servo::DeviceReading GuardedReading::reading() const {
  const auto& p = tip_and_tail;
  return {{{p[0], p[1], p[2]}, {p[3], p[4], p[5]}}, buttons, lost, trouble};
}

servo::DeviceCapabilities FixedCapabilities::numbers() const {
  return {name.data(),        sensed_freedom,   actuated_freedom, max_force, max_stiffness,
          max_rate,           workspace_radius, resolution,       simulated, serial.data(),
          calibration.data(), damping,          friction,         any_rate,  max_torque};
}

void FixedCapabilities::set(const servo::DeviceCapabilities& from) {
  keep(name, from.name);
  keep(serial, from.serial);
  keep(calibration, from.calibration);
  sensed_freedom = from.sensed_freedom;
  actuated_freedom = from.actuated_freedom;
  max_force = from.max_force;
  max_stiffness = from.max_stiffness;
  max_rate = from.max_rate;
  workspace_radius = from.workspace_radius;
  resolution = from.resolution;
  damping = from.damping;
  friction = from.friction;
  simulated = from.simulated;
  any_rate = from.any_rate;
  max_torque = from.max_torque;
}

void futex_wait(const std::atomic<std::uint32_t>& word, std::uint32_t value,
                std::int64_t for_ns) noexcept {
  if (for_ns <= 0) return;
  const timespec time{for_ns / kNsPerSecond, for_ns % kNsPerSecond};
  syscall(SYS_futex, &word, FUTEX_WAIT, value, &time, nullptr, 0);
}

void futex_wake(const std::atomic<std::uint32_t>& word) noexcept {
  syscall(SYS_futex, &word, FUTEX_WAKE, 1, nullptr, nullptr, 0);
}

namespace {

constexpr std::int64_t kZeroEvery_ns = 1'000'000;  // while the runner is silent
constexpr std::int64_t kSpin_ns = 20'000;  // busy wait: the command soon follows its reading

std::int64_t to_ns(double seconds) { return static_cast<std::int64_t>(seconds * 1e9); }

void keep(GuardChannel& channel, const char* message) {
  std::strncpy(channel.message.data(), message, channel.message.size() - 1);
}

class Guard {
 public:
  Guard(GuardChannel& channel, servo::Device& device, const GuardSettings& settings, int runner)
      : channel_(channel),
        device_(device),
        silence_ns_(to_ns(std::max(settings.silence, 5 / settings.rate))),
        linger_ns_(to_ns(settings.linger)),
        runner_(runner),
        spins_(std::thread::hardware_concurrency() > 1) {}

  void run() noexcept {
    calls_ = channel_.calls.load();
    heard_ns_ = clock_.now_ns();
    while (!channel_.quit.load()) {
      wait();
      if (channel_.zeros.load() != zeros_) zero_on_demand();
      if (channel_.reopens.load() != channel_.reopened.load()) reopen();
      const std::uint32_t calls = channel_.calls.load(std::memory_order_acquire);
      const std::int64_t now = clock_.now_ns();
      if (calls != calls_) {
        calls_ = calls;
        heard_ns_ = now;
        answer();
        obey();
      } else if (now - heard_ns_ >= silence_ns_) {
        cut_off();
        device_.read();  // keep its replies flowing
        device_.write(Vec3(0), Vec3(0));
        if (getppid() != runner_ && now - heard_ns_ >= linger_ns_) break;
      }
    }
    device_.write(Vec3(0), Vec3(0));
  }

 private:
  void wait() noexcept {
    const std::int64_t now = clock_.now_ns();
    if (spins_ && answered_last_) {
      while (channel_.calls.load(std::memory_order_acquire) == calls_ &&
             clock_.now_ns() - now < kSpin_ns) {
      }
    }
    const std::int64_t silent = now - heard_ns_;
    futex_wait(channel_.calls, calls_, silent < silence_ns_ ? silence_ns_ - silent : kZeroEvery_ns);
  }

  void cut_off() noexcept {
    if (!armed_) return;
    armed_ = false;
    ++trips_;
  }

  void zero_on_demand() noexcept {
    zeros_ = channel_.zeros.load();
    cut_off();
    device_.write(Vec3(0), Vec3(0));
  }

  void reopen() noexcept {
    const std::uint32_t asked = channel_.reopens.load();
    cut_off();
    device_.write(Vec3(0), Vec3(0));
    channel_.message[0] = '\0';
    try {
      device_.reopen();
    } catch (const std::exception& error) {
      keep(channel_, error.what());
    } catch (...) {
      keep(channel_, "the device could not be opened again");
    }
    channel_.reopened.store(asked, std::memory_order_release);
  }

  void answer() noexcept {
    const std::uint32_t asked = channel_.reads.load(std::memory_order_acquire);
    answered_last_ = asked != channel_.answered.load(std::memory_order_relaxed);
    if (!answered_last_) return;
    channel_.reading.write(GuardedReading(device_.read(), asked, trips_));
    channel_.answered.store(asked, std::memory_order_release);
    futex_wake(channel_.answered);
  }

  void obey() noexcept {
    const std::uint32_t commands = channel_.commands.load(std::memory_order_acquire);
    GuardedCommand command;
    if (commands == commands_ || !channel_.command.read(command)) return;
    commands_ = commands;
    const auto [x1, y1, z1] = command.device1;
    const auto [x2, y2, z2] = command.device2;
    const Vec3 device1(x1, y1, z1), device2(x2, y2, z2);
    const bool zero = device1 == Vec3(0) && device2 == Vec3(0);
    if (zero && command.trips_seen == trips_) armed_ = true;
    if (armed_) {
      device_.write(device1, device2);
    } else {
      device_.write(Vec3(0), Vec3(0));
    }
  }

  GuardChannel& channel_;
  servo::Device& device_;
  servo::RealClock clock_;
  const std::int64_t silence_ns_, linger_ns_;
  const int runner_;
  const bool spins_;
  std::uint32_t calls_ = 0, commands_ = 0, zeros_ = 0, trips_ = 0;
  std::int64_t heard_ns_ = 0;
  bool armed_ = false, answered_last_ = false;
};

/// Detaches from the runner's terminal signals and files; only the shared memory remains.
void stand_alone() {
  setpgid(0, 0);
  for (const int signal : {SIGINT, SIGTERM, SIGQUIT, SIGHUP, SIGPIPE, SIGALRM, SIGUSR1, SIGUSR2})
    std::signal(signal, SIG_IGN);
  for (const int signal : {SIGSEGV, SIGABRT, SIGBUS, SIGFPE, SIGILL}) std::signal(signal, SIG_DFL);
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  const int nothing = open("/dev/null", O_RDWR | O_CLOEXEC);
  if (nothing >= 0) {
    dup2(nothing, STDIN_FILENO);
    dup2(nothing, STDOUT_FILENO);
  }
  close_range(STDERR_FILENO + 1, ~0U, 0);
}

void fail(GuardChannel& channel, const char* message) {
  keep(channel, message);
  channel.state.store(GuardState::failed);
}

}  // namespace

void run_guard(GuardChannel& channel, const DeviceFactory& factory, const GuardSettings& settings,
               int runner) noexcept {
  // No force is possible yet, so end together with the runner.
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != runner) return;
  stand_alone();
  prctl(PR_SET_NAME, "palpate-guard");
  try {
    const std::unique_ptr<servo::Device> device = factory();
    servo::request_realtime({settings.priority, true, -1});
    prctl(PR_SET_PDEATHSIG, 0);
    channel.capabilities.set(device->capabilities());
    channel.state.store(GuardState::ready);
    Guard(channel, *device, settings, runner).run();
  } catch (const std::exception& error) {
    fail(channel, error.what());
    return;
  } catch (...) {
    fail(channel, "the device could not be opened");
    return;
  }
  channel.state.store(GuardState::ended);
}

}  // namespace palpate::runner::safety
