#include "runner/safety/guarded_device.h"

#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstring>
#include <stdexcept>
#include <thread>

#include "runner/servo/realtime.h"

namespace palpate::runner::safety {
namespace {

constexpr std::int64_t kReadingSpin_ns = 20'000;  // before sleeping for the reading
constexpr int kUnanswered = 25;  // unanswered reads in a row after which forces go off
constexpr auto kAnswerNap = std::chrono::milliseconds(2);
constexpr auto kFarewell = std::chrono::seconds(2);  // for the guard to close the device

}  // namespace

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
  for (read(); unanswered_ > 0; read()) {
    if (!ended() && std::chrono::steady_clock::now() < give_up) continue;
    kill(guard_, SIGKILL);
    end();
    throw std::runtime_error("the guard process gave no reading of the device");
  }
}

GuardedDevice::~GuardedDevice() { end(); }

bool GuardedDevice::ended() noexcept {
  if (!ended_) ended_ = waitpid(guard_, nullptr, WNOHANG) != 0;
  return ended_;
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
  const std::int64_t now = servo::RealClock().now_ns();
  if (reopening()) {
    answered_ns_ = now;  // the guard is at work
    return servo::DeviceTrouble::reopening;
  }
  if (unanswered_ < kUnanswered) return servo::DeviceTrouble::late;
  const bool given_up = static_cast<double>(now - answered_ns_) * 1e-9 >= settings_.given_up;
  return given_up ? servo::DeviceTrouble::guard_lost : servo::DeviceTrouble::guard_late;
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
