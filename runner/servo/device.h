#pragma once
// A haptic device as the servo sees it. The servo calls read, then write, once a tick; both must be
// quick and must not throw: trouble is reported in the reading.

#include <cstdint>
#include <string>
#include <vector>

#include "rendering/probe.h"

namespace palpate::runner {

// What a device is opened with, and what is found when looking for devices.

struct DeviceConfig {
  double rate = 1000;                ///< Hz, of the servo
  double stylus_length = 0.12;       ///< m
  double stylus_grip = 0.06;         ///< m, from the tip
  std::vector<std::string> serials;  ///< which ones, where several are plugged in; empty: any
  std::string firmware;              ///< file to upload where the device needs one; empty: none
  std::string calibration;           ///< file of calibrations; empty: none
  std::string library;               ///< the maker's, where one is loaded; empty: looked for
  std::string service;               ///< HOST:PORT of the maker's program; empty: where it says
};

/// A device that is plugged in (or, for the mouse and the simulated one, always there).
struct ConnectedDevice {
  std::string serial;   ///< empty where it has none
  std::string trouble;  ///< why it cannot be used; empty: it can
};

struct DeviceCapabilities {
  std::string name;
  int sensed_freedom = 3;       ///< degrees of freedom sensed: 3 position, 5 position and axis
  int actuated_freedom = 3;     ///< degrees of freedom driven: 3 force, 5 force and torque
  double max_force = 0;         ///< N, of each device: at each end of the stylus where two hold it
  double max_stiffness = 0;     ///< N/m that it can show at max_rate
  double max_rate = 1000;       ///< Hz
  double workspace_radius = 0;  ///< m about the device's centre, reached in every direction
  double resolution = 0;        ///< m
  bool simulated = false;
  std::string serial = {};  ///< of the device or devices; empty: none
  std::string calibration =
      {};                 ///< what is known of its force scale, with its date; empty: nothing
  double damping = 0;     ///< N s/m, viscous, physical, of the whole device; 0: not known
  double friction = 0;    ///< N, Coulomb, of the whole device; 0: not known
  bool any_rate = false;  ///< has no rate of its own: max_rate is what was asked for
  /// N m about the tip, of one device that drives torque at its grip; its force is max_force in
  /// all. 0: it drives none, or two devices hold the ends.
  double max_torque = 0;
};

/// Whether it can push the hand. Without motors nothing can hurt.
inline bool has_motors(const DeviceCapabilities& device) { return device.actuated_freedom > 0; }

/// What is wrong with a reading.
enum class DeviceTrouble : std::uint8_t {
  none,
  late,  ///< not lost: the last reading again, this tick's did not come in time
  unplugged,
  silent,       ///< no reply for too long
  not_homed,    ///< positions mean nothing
  implausible,  ///< positions that no hand could have moved to
  apart,        ///< the ends of the stylus are not its length apart
  guarded,     ///< the guard process sent zero force: the servo had been silent, or it was asked to
  guard_late,  ///< the guard process has given no readings for a while; it may again
  guard_lost,  ///< the guard process has ended, or has been silent for so long that it counts so
  reopening,   ///< the guard process is opening the device again
  not_calibrated,     ///< its maker's calibration is due: positions mean nothing
  stopped_by_device,  ///< it has taken its own forces off: too fast, too warm, its watchdog
  service_gone,       ///< the program through which it is reached has ended
  in_use,             ///< another program commands it
};
/// In words, with what the experimenter can do; empty for none.
const char* advice(DeviceTrouble trouble) noexcept;
/// Whether the device must be opened again before it can work.
bool needs_reopening(DeviceTrouble trouble) noexcept;

struct DeviceReading {
  rendering::LineProbe stylus;  ///< m, tip and tail
  std::uint8_t buttons = 0;
  bool lost = false;  ///< no reading: unplugged, homing lost
  DeviceTrouble trouble = DeviceTrouble::none;
};

class Device {
 public:
  virtual ~Device() = default;
  virtual const DeviceCapabilities& capabilities() const = 0;
  virtual DeviceReading read() noexcept = 0;
  /// Forces on the hand, N: device 1 at the tip, device 2 at the tail (eq. 1). The servo gives a
  /// device that drives 3 degrees of freedom all force as device 1's.
  virtual void write(const Vec3& device1, const Vec3& device2) noexcept = 0;
  /// Opens a device again that was unplugged or fell silent; does nothing where it works.
  /// May take seconds, without forces: never in the servo thread.
  /// Between reads and writes. \throws std::runtime_error saying what is in the way
  virtual void reopen() {}
};

/// The session clock: the computer's (RealClock) or a simulated one.
class Clock {
 public:
  virtual ~Clock() = default;
  virtual std::int64_t now_ns() noexcept = 0;
  /// Returns at `when_ns` or as soon after as the machine allows.
  virtual void wait_until(std::int64_t when_ns) noexcept = 0;
};

/// Jumps to the time that is waited for: a simulated session runs as fast as the processor goes.
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

}  // namespace palpate::runner
