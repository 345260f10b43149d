#pragma once
// A Force Dimension omega, delta, sigma or lambda, through the maker's library. Not tried on
// hardware: what is uncertain is listed in runner/README.md.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "runner/devices/forcedimension/library.h"
#include "runner/servo/device.h"

namespace palpate::runner::forcedimension {

/// What the library's arguments and results mean in world coordinates (x right, y away from the
/// user, z up).
inline Vec3 to_world(const Vec3& v) { return {v.y, -v.x, v.z}; }
inline Vec3 from_world(const Vec3& v) { return {-v.y, v.x, v.z}; }

/// The firmware drops forces when no command comes for 5 ms, at servo rates below 1 kHz for 5 ticks
/// or 32 ms, which also covers a dead guard.
class ForceDimensionDevice final : public Device {
 public:
  /// Opens the device with the config's serial number, or the only one.
  /// \throws std::runtime_error saying what is in the way
  explicit ForceDimensionDevice(const DeviceConfig& config);
  ~ForceDimensionDevice() override;

  const DeviceCapabilities& capabilities() const override { return capabilities_; }
  /// A stylus of a device with a wrist has its tip at the grip's centre and its tail towards the
  /// user along the grip's own x axis; without one tip and tail are one point.
  DeviceReading read() noexcept override;
  /// Without torque unless the wrist is driven: device1 + device2 at the grip.
  void write(const Vec3& device1, const Vec3& device2) noexcept override;
  void reopen() override;

 private:
  void open();
  void close() noexcept;
  DeviceTrouble trouble_of_status() noexcept;
  DeviceTrouble last_error() const noexcept;
  bool plausible(const Vec3& position, const Vec3& axis, std::int64_t asked_ns) noexcept;

  DeviceConfig config_;
  Library library_;
  std::optional<char> id_;
  DeviceCapabilities capabilities_;
  Vec3 tip_, tail_;            ///< m, world, of the last good reading
  std::int64_t asked_ns_ = 0;  ///< for the last good reading; 0: none since it was opened
  int until_status_ = 0;       ///< readings until the status is asked for again
  DeviceTrouble status_ = DeviceTrouble::none;
  DeviceTrouble write_trouble_ = DeviceTrouble::none;
  bool lost_ = true;
  bool pushed_ = false;  ///< a force was commanded since it was opened
};

/// See DeviceKind.
void check(const DeviceConfig& config);
DeviceCapabilities nominal(const DeviceConfig& config);
std::vector<ConnectedDevice> connected(const DeviceConfig& config);
std::unique_ptr<Device> open(const DeviceConfig& config);

}  // namespace palpate::runner::forcedimension
