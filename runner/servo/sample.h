#pragma once
// Records of a servo tick, and requests to the servo between ticks. Plain values.

#include <algorithm>
#include <cstdint>

#include "rendering/render_fault.h"
#include "rendering/renderer.h"
#include "runner/servo/device.h"

namespace palpate::runner::servo::servo_fault {

// The fault bits of a servo tick in addition to the renderer's (rendering/render_fault.h). Each bit
// needs a row in runner/safety/fault_signals.h, which explains it; a test checks that. Bits of
// Sample::faults; the renderer uses 1 to 8 and from 4096 on.
inline constexpr std::uint32_t kForceLimited = 16;
inline constexpr std::uint32_t kDeviceLost = 32;
inline constexpr std::uint32_t kMissedTicks = 64;
inline constexpr std::uint32_t kTripped = 128;
inline constexpr std::uint32_t kEmergency = 256;
inline constexpr std::uint32_t kSamplesLost = 512;
inline constexpr std::uint32_t kStalled = 1024;
inline constexpr std::uint32_t kOldReading = 2048;

}  // namespace palpate::runner::servo::servo_fault

namespace palpate::runner::servo {

enum class Phase : std::uint8_t {
  idle,     ///< no forces
  homing,   ///< no forces; waits for the stylus to rest in the home zone
  feeling,  ///< forces on
};

/// The reason why forces are not on yet, while homing.
enum class Waiting : std::uint8_t {
  nothing,
  for_distance,  ///< the stylus is not in the home zone
  for_rest,      ///< the stylus is there but has not rested long enough
  for_return,    ///< the tip is not at the start of a movement
};

/// The record of one tick.
struct Sample {
  std::int64_t time_ns = 0;      ///< session clock, at the start of the tick
  std::int64_t period_ns = 0;    ///< since the previous tick
  std::int64_t lateness_ns = 0;  ///< time_ns less the time at which the tick was due
  std::int64_t warm_up_ns = 0;   ///< from time_ns to the device's reading, by the clock
  std::int64_t compute_ns = 0;   ///< from the device's reading to the command for it, by the clock
  std::uint32_t tick = 0;        ///< since time zero of the trial; 0 before
  Phase phase = Phase::idle;
  Waiting waiting = Waiting::nothing;
  rendering::LineProbe probe;      ///< virtual probe, m
  rendering::Rendering rendering;  ///< as rendered
  Vec3 device1, device2;           ///< N, as commanded after the limits
  std::uint8_t buttons = 0;
  std::uint8_t bodies = 0;  ///< poses of this tick in TickSource::bodies()
  std::uint32_t faults = 0;
  DeviceTrouble trouble = DeviceTrouble::none;
};

/// The count as stored in a sample: 255 stands for 255 or more.
inline std::uint8_t recorded_contacts(int contacts) {
  return static_cast<std::uint8_t>(std::min(contacts, 255));
}

/// The home zone, where a trial may start: the whole stylus is at rest outside `radius` about the
/// origin, or its tip within `radius` about the start of a movement.
struct HomeZone {
  double radius = 0.062;     ///< m, bounding sphere and margin
  double rest = 0.5;         ///< s
  double stillness = 0.005;  ///< m; largest distance of the resting tip from where it came to rest
  std::optional<Vec3> start = std::nullopt;  ///< m, virtual world; none: outside is home
};

/// Servo-quality figures of one trial, from time zero.
struct ServoQuality {
  std::uint64_t ticks = 0, missed_ticks = 0;
  std::int64_t longest_period_ns = 0;
  std::int64_t longest_compute_ns = 0;
  std::uint32_t faults = 0;
  double max_force = 0;  ///< N, commanded to the hand
};

}  // namespace palpate::runner::servo
