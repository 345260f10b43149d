#include "runner/safety/guard_channel.h"

#include <linux/futex.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <ctime>

namespace palpate::runner {
namespace {

constexpr std::int64_t kNsPerSecond = 1'000'000'000;

template <std::size_t kSize>
void keep(std::array<char, kSize>& to, const std::string& from) {
  to.fill('\0');
  std::copy_n(from.begin(), std::min(from.size(), kSize - 1), to.begin());
}

}  // namespace

GuardedReading::GuardedReading(const DeviceReading& from, std::uint32_t request_,
                               std::uint32_t trips_)
    : tip_and_tail{from.stylus.tip.x,  from.stylus.tip.y,  from.stylus.tip.z,
                   from.stylus.tail.x, from.stylus.tail.y, from.stylus.tail.z},
      request(request_),
      trips(trips_),
      buttons(from.buttons),
      lost(from.lost),
      trouble(from.trouble) {}

DeviceReading GuardedReading::reading() const {
  const auto& p = tip_and_tail;
  return {{{p[0], p[1], p[2]}, {p[3], p[4], p[5]}}, buttons, lost, trouble};
}

DeviceCapabilities FixedCapabilities::numbers() const {
  return {name.data(),        sensed_freedom,   actuated_freedom, max_force, max_stiffness,
          max_rate,           workspace_radius, resolution,       simulated, serial.data(),
          calibration.data(), damping,          friction,         any_rate,  max_torque};
}

void FixedCapabilities::set(const DeviceCapabilities& from) {
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

}  // namespace palpate::runner
