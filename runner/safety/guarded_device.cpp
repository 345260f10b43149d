#include "runner/safety/guarded_device.h"

#include <fcntl.h>
#include <linux/futex.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstring>
#include <ctime>
#include <exception>
#include <stdexcept>
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

constexpr std::int64_t kZeroEvery_ns = 1'000'000;  // while the runner is silent
constexpr std::int64_t kSpin_ns = 20'000;  // busy wait: the command soon follows its reading

std::int64_t to_ns(double seconds) { return static_cast<std::int64_t>(seconds * 1e9); }

void keep(GuardChannel& channel, const char* message) {
  std::strncpy(channel.message.data(), message, channel.message.size() - 1);
}

/// Waits while `word` is `value`, at most `for_ns`. May return early.
void futex_wait(const std::atomic<std::uint32_t>& word, std::uint32_t value,
                std::int64_t for_ns) noexcept {
  if (for_ns <= 0) return;
  const timespec time{for_ns / kNsPerSecond, for_ns % kNsPerSecond};
  syscall(SYS_futex, &word, FUTEX_WAIT, value, &time, nullptr, 0);
}

void futex_wake(const std::atomic<std::uint32_t>& word) noexcept {
  syscall(SYS_futex, &word, FUTEX_WAKE, 1, nullptr, nullptr, 0);
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

constexpr std::int64_t kReadingSpin_ns = 20'000;  // before sleeping for the reading
constexpr int kUnanswered = 25;  // unanswered reads in a row after which forces go off
constexpr auto kAnswerNap = std::chrono::milliseconds(2);
constexpr auto kFarewell = std::chrono::seconds(2);  // for the guard to close the device

/// Runs the guard in a newly forked process; returns when the process should exit. Passes forces
/// only after a zero command from a runner that knows of all trips of the guard, so no stale force
/// is ever felt. \param runner  process id
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

GuardedDevice::GuardedDevice(const DeviceFactory& factory, const GuardSettings& settings)
    : settings_(settings) {
  const int runner = getpid();
  guard_ = fork();
  if (guard_ < 0)
    throw std::runtime_error(std::string("no guard process could be started: ") +
                             std::strerror(errno));
  if (guard_ == 0) {
    run_guard(*channel_, factory, settings, runner);
    _exit(0);
  }
  const auto give_up = std::chrono::steady_clock::now() +
                       std::chrono::milliseconds(std::llround(settings.patience * 1e3));
  while (channel_->state.load() == GuardState::opening) {
    if (ended() && channel_->state.load() == GuardState::opening)
      throw std::runtime_error("the guard process ended while it opened the device");
    if (std::chrono::steady_clock::now() >= give_up) {
      kill(guard_, SIGKILL);
      end();
      throw std::runtime_error("the device was not ready after " +
                               std::to_string(std::llround(settings.patience)) + " s");
    }
    std::this_thread::sleep_for(kAnswerNap);
  }
  if (channel_->state.load() == GuardState::failed) {
    end();
    throw std::runtime_error(channel_->message.data());
  }
  capabilities_ = channel_->capabilities.numbers();
  // Wait for a first reading: it can replace later ones that are late.
  const auto try_to_read = [this] {
    answered_ns_ = servo::RealClock().now_ns();  // settings.patience counts, not given_up
    read();
  };
  for (try_to_read(); unanswered_ > 0; try_to_read()) {
    if (!ended() && std::chrono::steady_clock::now() < give_up) continue;
    kill(guard_, SIGKILL);
    end();
    throw std::runtime_error("the guard process gave no reading of the device");
  }
}

GuardedDevice::~GuardedDevice() { end(); }

bool GuardedDevice::ended() noexcept {
  if (ended_) return true;
  int status = 0;
  const pid_t changed = waitpid(guard_, &status, WNOHANG | WUNTRACED);
  if (changed > 0 && WIFSTOPPED(status)) {
    end_stopped();
  } else {
    ended_ = changed != 0;
  }
  return ended_;
}

/// A stopped guard leaves its last force on the device. It may go on only to send zero and to end.
void GuardedDevice::end_stopped() noexcept {
  channel_->quit.store(true);
  emergency_zero();
  kill(guard_, stopped_ ? SIGKILL : SIGCONT);
  stopped_ = true;
}

void GuardedDevice::end() noexcept {
  channel_->quit.store(true);
  emergency_zero();
  const auto give_up = std::chrono::steady_clock::now() + kFarewell;
  while (!ended()) {
    if (std::chrono::steady_clock::now() >= give_up) kill(guard_, SIGKILL);
    std::this_thread::sleep_for(kAnswerNap);
  }
}

servo::DeviceReading GuardedDevice::read() noexcept {
  const std::uint32_t asked = channel_->reads.load(std::memory_order_relaxed) + 1;
  channel_->reads.store(asked, std::memory_order_release);
  channel_->calls.fetch_add(1, std::memory_order_release);
  futex_wake(channel_->calls);
  servo::RealClock clock;
  const std::int64_t began = clock.now_ns();
  const auto patience = static_cast<std::int64_t>(0.5e9 / settings_.rate);
  for (std::int64_t waited = 0; waited < patience; waited = clock.now_ns() - began) {
    const std::uint32_t answered = channel_->answered.load(std::memory_order_acquire);
    if (answered == asked) break;
    if (waited > kReadingSpin_ns) futex_wait(channel_->answered, answered, patience - waited);
  }
  GuardedReading reading;
  if (channel_->answered.load(std::memory_order_acquire) == asked &&
      channel_->reading.read(reading)) {
    unanswered_ = 0;
    answered_ns_ = clock.now_ns();
    last_ = reading.reading();
    if (reading.trips != trips_seen_) {
      trips_seen_ = reading.trips;
      last_.lost = true;
      last_.trouble = servo::DeviceTrouble::guarded;
    }
    return last_;
  }
  ++unanswered_;
  servo::DeviceReading old = last_;
  old.trouble = without_answer();
  old.lost = old.trouble != servo::DeviceTrouble::late;
  return old;
}

servo::DeviceTrouble GuardedDevice::without_answer() noexcept {
  if (ended()) return servo::DeviceTrouble::guard_lost;
  if (stopped_) {
    if (unanswered_ >= kUnanswered) kill(guard_, SIGKILL);
    return servo::DeviceTrouble::guard_lost;
  }
  const std::int64_t now = servo::RealClock().now_ns();
  if (reopening()) {
    answered_ns_ = now;  // the guard is at work
    return servo::DeviceTrouble::reopening;
  }
  if (unanswered_ < kUnanswered) return servo::DeviceTrouble::late;
  const bool given_up = static_cast<double>(now - answered_ns_) * 1e-9 >= settings_.given_up;
  if (!given_up) return servo::DeviceTrouble::guard_late;
  kill(guard_, SIGKILL);  // its last force must not stay
  return servo::DeviceTrouble::guard_lost;
}

void GuardedDevice::write(const Vec3& device1, const Vec3& device2) noexcept {
  channel_->command.write(
      {{device1.x, device1.y, device1.z}, {device2.x, device2.y, device2.z}, trips_seen_});
  channel_->commands.fetch_add(1, std::memory_order_release);
  channel_->calls.fetch_add(1, std::memory_order_release);
  futex_wake(channel_->calls);
}

void GuardedDevice::ask_to_reopen() noexcept {
  channel_->reopens.fetch_add(1);
  channel_->calls.fetch_add(1);
  futex_wake(channel_->calls);
}

bool GuardedDevice::reopening() const noexcept {
  return channel_->reopens.load() != channel_->reopened.load(std::memory_order_acquire);
}

std::string GuardedDevice::reopen_trouble() const { return channel_->message.data(); }

void GuardedDevice::emergency_zero() noexcept {
  channel_->zeros.fetch_add(1);
  channel_->calls.fetch_add(1);
  futex_wake(channel_->calls);
}

}  // namespace palpate::runner::safety
