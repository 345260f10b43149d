#pragma once
// Whether this machine keeps a servo's time: a servo thread at work for some seconds, every tick
// measured.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "runner/servo/realtime.h"

namespace palpate::runner {

struct TimingSettings {
  double rate = 1000;   ///< Hz
  double seconds = 10;  ///< of ticks in contact
  RealtimeSettings realtime;
  bool guarded = false;  ///< the device in a guard process, as a real one is
};

/// Of ticks with forces on; times in ns. Quantiles are exact.
struct ServoTiming {
  RealtimeRights rights;
  double rate = 0;
  std::uint64_t ticks = 0, missed_ticks = 0, old_readings = 0;
  std::int64_t lateness_median = 0, lateness_p99 = 0, lateness_p999 = 0, lateness_max = 0;
  double late_share = 0;    ///< of ticks, more than a period late
  int worst_run = 0;        ///< missed ticks in a row, at most
  std::uint64_t trips = 0;  ///< times that this cut the forces off
  /// By the clock, of bringing back what the tick needs (Servo::keep_warm).
  std::int64_t warm_up_median = 0, warm_up_p999 = 0, warm_up_max = 0;
  /// By the clock, from the device's reading to the command: with what others took of it.
  std::int64_t clock_median = 0, clock_p999 = 0, clock_max = 0;
  /// Of the servo's thread itself: the same, and the whole tick but for the device's own transfer.
  /// With what it costs to ask the system for that time (asking_median, once in each), and with
  /// interrupts that came meanwhile.
  std::int64_t compute_median = 0, compute_p999 = 0, compute_max = 0;
  std::int64_t tick_median = 0, tick_p999 = 0, tick_max = 0;
  std::int64_t asking_median = 0;
  std::vector<std::int64_t> lateness;  ///< of every tick, sorted

  enum class Verdict { fit, fit_with_losses, unfit };
  Verdict verdict() const;
  /// The verdict in a sentence, with its reasons.
  std::string sentence() const;
};

/// A stylus led over a sphere of 1,280 triangles, in contact from tip to side, with the ray
/// renderer. \param wait  called every so often by the thread that only waits; true: stop early
ServoTiming measure_servo(const TimingSettings& settings, const std::function<bool()>& wait = {});

}  // namespace palpate::runner
