#pragma once
// A 3D Systems Touch, Touch X or Phantom, through the maker's library and its scheduler. Not tried
// on hardware: what is uncertain is listed in runner/README.md.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "runner/devices/touch/library.h"
#include "runner/servo/device.h"
#include "runner/servo/shared_value.h"
#include "runner/servo/triple_buffer.h"

namespace palpate::runner::touch {

/// What the library's arguments and results mean in world coordinates (x right, y away from the
/// user, z up).
inline Vec3 to_world(const Vec3& v) { return {v.x, -v.z, v.y}; }
inline Vec3 from_world(const Vec3& v) { return {v.x, v.z, -v.y}; }

/// Devices are known by the names that the maker's setup gave them. The library's scheduler calls
/// every millisecond in its own thread; every call sets the force, or the last one goes on.
class TouchDevice final : public Device {
 public:
  /// Opens the device with the config's serial number, which is its name, or the default one.
  /// \throws std::runtime_error saying what is in the way
  explicit TouchDevice(const DeviceConfig& config);
  ~TouchDevice() override;

  const DeviceCapabilities& capabilities() const override { return capabilities_; }
  /// Never waits. The tip is the device's position, the tail lies behind it along the gimbal's z.
  DeviceReading read() noexcept override;
  /// Without torque: device1 + device2 at the tip.
  void write(const Vec3& device1, const Vec3& device2) noexcept override;
  void reopen() override;

 private:
  struct Frame {
    Vec3 position, axis;  ///< m, world; from tip to tail
    std::uint8_t buttons = 0;
    std::int64_t asked_ns = 0, time_ns = 0;  ///< before and after it was asked for; 0: none yet
    DeviceTrouble trouble = DeviceTrouble::none;
  };
  struct Wanted {
    double x = 0, y = 0, z = 0;  ///< N, world
    std::int64_t time_ns = 0;
  };
  void open();
  void close() noexcept;
  static unsigned called(void* device) noexcept;
  void exchange() noexcept;
  DeviceTrouble errors() noexcept;
  bool plausible(const Frame& frame) noexcept;

  DeviceConfig config_;
  const Library& library_;
  Handle handle_ = kNoHandle;
  unsigned long scheduled_ = 0;
  DeviceCapabilities capabilities_;
  double silence_ns_;  ///< a force that is older becomes zero
  SharedValue<Wanted> wanted_;
  TripleBuffer<Frame> frames_;
  Frame seen_;                 ///< the reader's newest
  Vec3 tip_, tail_;            ///< m, of the last reading
  std::int64_t asked_ns_ = 0;  ///< for that
  bool lost_ = true;
  // The scheduler's thread's own.
  DeviceTrouble trouble_ = DeviceTrouble::none;
  std::int64_t trouble_ns_ = 0;
  int until_calibration_ = 0;
  bool calibrated_ = true;
};

/// See DeviceKind.
void check(const DeviceConfig& config);
DeviceCapabilities nominal(const DeviceConfig& config);
/// The names that the maker's setup stored below $GTDD_HOME.
std::vector<ConnectedDevice> connected(const DeviceConfig& config);
std::unique_ptr<Device> open(const DeviceConfig& config);

}  // namespace palpate::runner::touch
