#pragma once
// The servo tick: device.read -> renderer -> force limit -> device.write. The same code for a
// simulated participant (as fast as the processor goes) and a live one (paced by the clock).

#include <cstdint>
#include <optional>

#include "rendering/renderer.h"
#include "runner/device.h"
#include "runner/force_limiter.h"

namespace palpate {

/// Bits of Sample::faults; the renderer's bits are the low ones.
namespace servo_fault {
inline constexpr std::uint32_t kForceLimited = 16;  ///< the force was cut in size or change
inline constexpr std::uint32_t kDeviceLost = 32;    ///< zero force for good
inline constexpr std::uint32_t kMissedTicks = 64;   ///< too many in a row: zero force for good
inline constexpr std::uint32_t kTripped = 128;  ///< forces are off until the experimenter clears
}  // namespace servo_fault

enum class Phase : std::uint8_t {
  idle,     ///< no forces
  homing,   ///< no forces; waits for the stylus to rest in the home zone
  feeling,  ///< forces on
};

/// What happened in one tick.
struct Sample {
  std::int64_t time_ns = 0;    ///< session clock, at the start of the tick
  std::int64_t period_ns = 0;  ///< since the tick before
  std::uint32_t tick = 0;      ///< since time zero of the trial; 0 before
  Phase phase = Phase::idle;
  LineProbe probe;        ///< virtual probe, m
  Rendering rendering;    ///< as rendered
  Vec3 device1, device2;  ///< N, as commanded after the limits
  std::uint8_t buttons = 0;
  std::uint32_t faults = 0;
};

/// Where a trial may start: the whole stylus outside of `radius` about the origin, at rest.
struct HomeZone {
  double radius = 0.062;     ///< m, bounding sphere and margin
  double rest = 0.5;         ///< s
  double stillness = 0.005;  ///< m; the tip stays this near to where it came to rest
};

/// Where the virtual world stands in the device's frame: virtual = scale * (device - centre).
struct WorkspaceMap {
  Vec3 centre;       ///< m, device frame
  double scale = 1;  ///< virtual metres per device metre

  Vec3 to_virtual(const Vec3& device) const { return scale * (device - centre); }
  Vec3 to_device(const Vec3& virtual_point) const { return virtual_point / scale + centre; }
};

/// Servo-quality figures of one trial, from time zero.
struct ServoQuality {
  std::uint64_t ticks = 0, missed_ticks = 0;
  std::int64_t longest_period_ns = 0;
  std::uint32_t faults = 0;
  double max_force = 0;  ///< N, commanded to the hand
};

class Servo {
 public:
  Servo(Device& device, Clock& clock, double rate, const ForceLimits& limits,
        const WorkspaceMap& workspace = {});

  /// Puts a scene before the stylus and waits for it in the home zone.
  void prepare(const Scene& scene, const Renderer& renderer, const HomeZone& home);
  /// Waits for the tick's time, then does one tick. Never throws, allocates, locks or does I/O but
  /// the device's own transfer.
  const Sample& tick() noexcept;
  /// Forces off; what the trial was like.
  ServoQuality stop() noexcept;

  double period() const { return period_; }  ///< s

 private:
  bool at_home(const LineProbe& probe) noexcept;
  void keep_time() noexcept;

  static constexpr int kMissedInARow = 5;  ///< so many and the forces go off

  Device& device_;
  Clock& clock_;
  const double period_;
  const std::int64_t period_ns_;
  std::int64_t due_ns_;
  ForceLimiter limiter_;
  WorkspaceMap workspace_;
  std::optional<Scene> scene_;
  const Renderer* renderer_ = nullptr;
  RenderState state_;
  HomeZone home_;
  Vec3 rest_tip_;
  int rested_ = 0;  ///< ticks
  int late_in_a_row_ = 0;
  Sample sample_;
  ServoQuality quality_;
};

}  // namespace palpate
