#pragma once
// The servo's interface to a haptic device. The servo calls read, then write, once a tick. Both
// must be quick and must not throw: trouble is reported in the reading.

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "rendering/probe.h"

namespace palpate::runner::servo {

/// Settings to open a device, or to look for devices.
struct DeviceConfig {
  double rate = 1000;                ///< Hz, of the servo
  double stylus_length = 0.12;       ///< m
  double stylus_grip = 0.06;         ///< m, from the tip
  std::vector<std::string> serials;  ///< serial numbers of the devices to use; empty: any
  std::string firmware;              ///< file to upload if the device needs one; empty: none
  std::string calibration;           ///< file of calibrations; empty: none
  std::string library;               ///< path of the maker's library; empty: search for it
  std::string service;               ///< HOST:PORT of the maker's program; empty: its default
};

/// A device that is plugged in (or, for the mouse and the simulated one, always there).
struct ConnectedDevice {
  std::string serial;   ///< empty: it has none
  std::string trouble;  ///< reason why it cannot be used; empty: it can
};

struct DeviceCapabilities {
  std::string name;
  int sensed_freedom = 3;       ///< degrees of freedom sensed: 3 position, 5 position and axis
  int actuated_freedom = 3;     ///< degrees of freedom driven: 3 force, 5 force and torque
  double max_force = 0;         ///< N, of each device; with two devices at each end of the stylus
  double max_stiffness = 0;     ///< N/m, largest that it can render at max_rate
  double max_rate = 1000;       ///< Hz
  double workspace_radius = 0;  ///< m; reach in every direction about the device's centre
  double resolution = 0;        ///< m
  bool simulated = false;
  std::string serial = {};       ///< of the device or devices; empty: none
  std::string calibration = {};  ///< measured force scale, with its date; empty: unknown
  double damping = 0;            ///< N s/m, viscous, physical, of the whole device; 0: unknown
  double friction = 0;           ///< N, Coulomb, of the whole device; 0: unknown
  bool any_rate = false;         ///< has no own rate: max_rate is the requested one
  /// N m about the tip, of a device that drives torque at its grip; max_force then limits its whole
  /// force. 0: it drives no torque, or two devices hold the ends.
  double max_torque = 0;
};

/// Whether it can push the hand. A device without motors cannot hurt.
inline bool has_motors(const DeviceCapabilities& device) { return device.actuated_freedom > 0; }

/// Trouble with a reading.
enum class DeviceTrouble : std::uint8_t {
  none,
  late,  ///< not lost: this tick's reading was not in time, so the last one is repeated
  unplugged,
  silent,             ///< no reply for too long
  not_homed,          ///< positions are meaningless
  implausible,        ///< positions that no hand could have moved to
  apart,              ///< distance of the stylus' ends differs from its length
  guarded,            ///< the guard process sent zero force: the servo was silent or asked for it
  guard_late,         ///< the guard process is late with readings; it may recover
  guard_lost,         ///< the guard process has ended or hangs for good
  reopening,          ///< the guard process is opening the device again
  not_calibrated,     ///< its maker's calibration is due: positions are meaningless
  stopped_by_device,  ///< it has switched its forces off: too fast, too warm, its watchdog
  service_gone,       ///< the program that connects to it has ended
  in_use,             ///< another program commands it
  unreadable,         ///< the maker's service sends what is no message of its form
};
/// In words, with the remedy for the experimenter; empty for none.
const char* advice(DeviceTrouble trouble) noexcept;
/// Whether the device must be opened again before it can work.
bool needs_reopening(DeviceTrouble trouble) noexcept;

struct DeviceReading {
  rendering::LineProbe stylus;  ///< m, tip and tail
  std::uint8_t buttons = 0;
  bool lost = false;  ///< no reading: unplugged, homing lost
  DeviceTrouble trouble = DeviceTrouble::none;
};

/// CLOCK_MONOTONIC, ns; 0: unknown.
struct DeviceTimes {
  std::int64_t pose_ns = 0;   ///< request or arrival of the last reading's pose
  std::int64_t force_ns = 0;  ///< the last force of Device::write left this program
};

/// Of two devices that hold one stylus: the older pose, the later force.
inline DeviceTimes later_of(const DeviceTimes& one, const DeviceTimes& other) {
  return {std::min(one.pose_ns, other.pose_ns), std::max(one.force_ns, other.force_ns)};
}

class Device {
 public:
  virtual ~Device() = default;
  virtual const DeviceCapabilities& capabilities() const = 0;
  virtual DeviceReading read() noexcept = 0;
  /// Forces on the hand, N: device 1 at the tip, device 2 at the tail (eq. 1). A device that drives
  /// 3 degrees of freedom receives the total force as device 1's.
  virtual void write(const Vec3& device1, const Vec3& device2) noexcept = 0;
  /// Opens a device again that was unplugged or fell silent; has no effect on one that works. May
  /// take seconds, without forces: do not call it in the servo thread, nor during a read or write.
  /// \throws std::runtime_error with the obstacle
  virtual void reopen() {}
  /// When the device sensed and pushed, for measurements of its delay. A driver with a thread of
  /// its own queues poses and forces, so its caller cannot measure them. Called between reads and
  /// writes, in their thread.
  virtual DeviceTimes times() const noexcept { return {}; }
};

/// The session clock: the computer's (RealClock) or a simulated one.
class Clock {
 public:
  virtual ~Clock() = default;
  virtual std::int64_t now_ns() noexcept = 0;
  /// Returns at `when_ns` or as soon after as the machine allows.
  virtual void wait_until(std::int64_t when_ns) noexcept = 0;
};

/// Jumps to the awaited time: a simulated session runs as fast as the processor allows.
class VirtualClock final : public Clock {
 public:
  explicit VirtualClock(std::int64_t start_ns = 0) : now_(start_ns) {}
  std::int64_t now_ns() noexcept override { return now_; }
  void wait_until(std::int64_t when_ns) noexcept override {
    if (when_ns > now_) now_ = when_ns;
  }

 private:
  std::int64_t now_;
};

}  // namespace palpate::runner::servo
