#pragma once
// A Force Dimension omega, delta, sigma or lambda, through the maker's library. Not tested on
// hardware: runner/README.md lists the uncertainties.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "runner/devices/forcedimension/library.h"
#include "runner/servo/device.h"

namespace palpate::runner::devices::forcedimension {

/// Convert between the library's frame and the world frame (x right, y away from the user, z up).
inline Vec3 to_world(const Vec3& v) { return {v.y, -v.x, v.z}; }
inline Vec3 from_world(const Vec3& v) { return {-v.y, v.x, v.z}; }

/// The firmware switches forces off after 5 ms without a command (at servo rates below 1 kHz after
/// 5 ticks, at most 32 ms). This also covers a dead guard.
class ForceDimensionDevice final : public servo::Device {
 public:
  /// Opens the device with the config's serial number, or the only one.
  /// \throws std::runtime_error with the obstacle
  explicit ForceDimensionDevice(const servo::DeviceConfig& config);
  ~ForceDimensionDevice() override;

  const servo::DeviceCapabilities& capabilities() const override { return capabilities_; }
  /// With a wrist, the stylus has its tip at the grip's centre and its tail towards the user along
  /// the grip's x axis. Without a wrist, tip and tail are one point.
  servo::DeviceReading read() noexcept override;
  /// Applies device1 + device2 at the grip; torque only if the wrist is driven.
  void write(const Vec3& device1, const Vec3& device2) noexcept override;
  void reopen() override;
  servo::DeviceTimes times() const noexcept override { return {pose_ns_, force_ns_}; }

 private:
  void open();
  void close() noexcept;
  servo::DeviceTrouble trouble_of_status() noexcept;
  servo::DeviceTrouble last_error() const noexcept;
  bool plausible(const Vec3& position, const Vec3& axis, std::int64_t asked_ns) noexcept;

  servo::DeviceConfig config_;
  Library library_;
  std::optional<char> id_;
  servo::DeviceCapabilities capabilities_;
  Vec3 tip_, tail_;            ///< m, world, of the last good reading
  std::int64_t asked_ns_ = 0;  ///< time of asking for the last good reading; 0: none since opening
  std::int64_t pose_ns_ = 0, force_ns_ = 0;  ///< DeviceTimes
  int until_status_ = 0;                     ///< readings until the next query of the status
  servo::DeviceTrouble status_ = servo::DeviceTrouble::none;
  servo::DeviceTrouble write_trouble_ = servo::DeviceTrouble::none;
  bool lost_ = true;
  bool pushed_ = false;  ///< a force was commanded since it was opened
};

/// See DeviceKind.
void check(const servo::DeviceConfig& config);
servo::DeviceCapabilities nominal(const servo::DeviceConfig& config);
std::vector<servo::ConnectedDevice> connected(const servo::DeviceConfig& config);
std::unique_ptr<servo::Device> open(const servo::DeviceConfig& config);
std::string move_to_calibrate(const servo::DeviceConfig& config);

}  // namespace palpate::runner::devices::forcedimension
