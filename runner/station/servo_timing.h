#pragma once
// Measures whether this machine is fit for the servo loop, every tick of a servo thread for some
// seconds, and the delay from a device's pose to its force.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "runner/devices/device_delay.h"
#include "runner/devices/registry.h"
#include "runner/servo/realtime.h"

namespace palpate::runner::station {

struct TimingSettings {
  double rate = 1000;   ///< Hz
  double seconds = 10;  ///< of ticks with forces on
  servo::RealtimeSettings realtime;
  bool guarded = false;  ///< with the device in a guard process, like a real one
};

/// Of ticks with forces on; times in ns. Quantiles are exact.
struct ServoTiming {
  servo::RealtimeRights rights;
  double rate = 0;
  std::uint64_t ticks = 0, missed_ticks = 0, old_readings = 0;
  std::int64_t lateness_median = 0, lateness_p99 = 0, lateness_p999 = 0, lateness_max = 0;
  double late_fraction = 0;  ///< share of ticks more than a period late
  int worst_run = 0;         ///< longest run of missed ticks
  std::uint64_t trips = 0;   ///< number of times that missed ticks switched forces off
  /// Wall-clock time of reloading the scene into the caches (Servo::keep_warm).
  std::int64_t warm_up_median = 0, warm_up_p999 = 0, warm_up_max = 0;
  /// Wall-clock time from the device's reading to the command, preemption included.
  std::int64_t clock_median = 0, clock_p999 = 0, clock_max = 0;
  /// CPU time of the servo thread: from reading to command, and for the whole tick without the
  /// device's transfer. Includes one query of the CPU clock each (asking_median) and interrupts.
  std::int64_t compute_median = 0, compute_p999 = 0, compute_max = 0;
  std::int64_t tick_median = 0, tick_p999 = 0, tick_max = 0;
  std::int64_t asking_median = 0;
  std::vector<std::int64_t> lateness;  ///< of every tick, sorted

  enum class Verdict { fit, fit_with_losses, unfit };
  Verdict verdict() const;
  /// The verdict in a sentence, with its reasons.
  std::string sentence() const;
};

/// Renders a prescribed path over a sphere of 1,280 triangles, in contact with tip and side, with
/// the ray renderer. \param wait  called about every 0.2 s by the waiting thread; true: stop early
ServoTiming measure_servo(const TimingSettings& settings, const std::function<bool()>& wait = {});

/// Opens a device as a session does, reads and writes it at its rate, at zero force, and measures
/// the delay from its pose to its force through the guard process.
/// \throws std::runtime_error: the device cannot be opened, or does not report its times
devices::ChainTiming measure_chain(const devices::DeviceKind& kind,
                                   const servo::DeviceConfig& config, double seconds);

}  // namespace palpate::runner::station
