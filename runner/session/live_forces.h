#pragma once
// Switches the forces of a live session: off at once, on again only while device and watchdog work.
// Also measures how a trial's object was touched.

#include <atomic>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "runner/safety/guarded_device.h"
#include "runner/servo/sample.h"
#include "runner/servo/servo_thread.h"
#include "runner/sharp_edges.h"
#include "stimuli/vec.h"

namespace palpate::runner::session {

/// Measures how a trial's object was touched, to distinguish active from passive exploration.
/// Defined here for live and simulated sessions alike.
///
///   contact share  ticks with contact (at least one contact place with force) over all ticks, from
///                  time zero to the last tick before the answer
///   edge dwell     ticks with contact on an edge, times the servo's period: the deepest contact's
///                  point is within kReach of a sharp edge or vertex (runner/sharp_edges.h)
class ContactLog {
 public:
  static constexpr double kReach = 0.003;  ///< m; a light touch goes 2 mm deep

  /// \param edges  of the trial's stimulus; must outlive the trial. \param orientation  of it
  void begin(const SharpEdges& edges, const Quat& orientation);
  /// A tick with forces on. Does not allocate.
  void add(const servo::Sample& sample) noexcept;

  double contact_share() const;  ///< 0 where there was no tick
  /// s; none where the stimulus has too many edges (SharpEdges::kMost).
  std::optional<double> edge_dwell(double period) const;

 private:
  bool on_edge(const Vec3& point) noexcept;

  const SharpEdges* edges_ = nullptr;
  Quat to_object_{1, 0, 0, 0};
  std::uint64_t ticks_ = 0, contact_ticks_ = 0, edge_ticks_ = 0;
  // A point that moves by less than margin_ from here stays on the same side of kReach.
  Vec3 known_;
  double margin_ = -1;  ///< m; negative: nothing is known yet
  bool known_on_edge_ = false;
};

/// Turns the forces of a live session off and on. Belongs to the session's thread: it takes the
/// servo's newest samples.
class LiveForces {
 public:
  /// \param guard  may be null. All must outlive it.
  LiveForces(servo::ServoThread& servo, safety::GuardedDevice* guard, servo::Clock& clock)
      : servo_(servo), guard_(guard), clock_(clock) {}

  /// Zero force at once, until allow(). From any thread.
  void off() noexcept;
  /// Number of calls of off(). From any thread.
  std::uint32_t times_off() const noexcept { return times_off_.load(); }
  /// The same by the servo's ramp. From any thread.
  void fade() noexcept { servo_.fade_out(); }
  /// Allows forces again, once the device gives a good reading. Reopens an unplugged or silent
  /// device first, which may take seconds.
  /// \param stop  asked every few milliseconds; true gives up
  /// \param known  times_off() when the request was made: a later off() is kept. Empty: now
  /// \return the reason that forces stay off, in words; empty: they are allowed
  std::string allow(const std::function<bool()>& stop, std::optional<std::uint32_t> known = {});

  /// The servo's newest sample.
  const servo::Sample& newest() noexcept;
  /// Whether the device gives no readings, not only for a moment.
  bool device_is_gone() noexcept;
  /// \throws EndOfSession if the watchdog has ended or hangs, judged by the last sample of
  /// newest(): forces are zero and cannot come back.
  void end_without_guard() const;

 private:
  template <class Wished>
  bool await(Wished wished, double seconds, const std::function<bool()>& stop);
  std::string open_again(const std::function<bool()>& stop);
  std::string allow_now(const std::function<bool()>& stop);

  servo::ServoThread& servo_;
  safety::GuardedDevice* guard_;
  servo::Clock& clock_;
  servo::Sample sample_;
  std::atomic<std::uint32_t> times_off_{0};
};

}  // namespace palpate::runner::session
