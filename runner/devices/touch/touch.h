#pragma once
// A 3D Systems Touch, Touch X or Phantom, through the maker's library and its scheduler. Not tested
// on hardware: runner/README.md lists the uncertainties.

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "runner/devices/touch/library.h"
#include "runner/servo/device.h"
#include "runner/servo/shared_value.h"
#include "runner/servo/triple_buffer.h"

namespace palpate::runner::devices::touch {

/// Convert between the library's frame and the world frame (x right, y away from the user, z up).
inline Vec3 to_world(const Vec3& v) { return {v.x, -v.z, v.y}; }
inline Vec3 from_world(const Vec3& v) { return {v.x, v.z, -v.y}; }

/// Devices are identified by the names given in the maker's setup. The library's scheduler calls
/// every millisecond in its own thread. Every call must set the force, because the last one would
/// persist.
class TouchDevice final : public servo::Device {
 public:
  /// Opens the device with the config's serial number, which is its name, or the default one.
  /// \throws std::runtime_error with the obstacle
  explicit TouchDevice(const servo::DeviceConfig& config);
  ~TouchDevice() override;

  const servo::DeviceCapabilities& capabilities() const override { return capabilities_; }
  /// Never waits. The tip is the device's position, the tail lies behind it along the gimbal's z.
  servo::DeviceReading read() noexcept override;
  /// Applies device1 + device2 at the tip, without torque.
  void write(const Vec3& device1, const Vec3& device2) noexcept override;
  void reopen() override;
  servo::DeviceTimes times() const noexcept override { return {seen_.asked_ns, force_ns_.load()}; }

 private:
  struct Frame {
    Vec3 position, axis;  ///< m, world; from tip to tail
    std::uint8_t buttons = 0;
    std::int64_t asked_ns = 0, time_ns = 0;  ///< before and after asking for it; 0: none yet
    servo::DeviceTrouble trouble = servo::DeviceTrouble::none;
  };
  struct Wanted {
    double x = 0, y = 0, z = 0;  ///< N, world
    std::int64_t time_ns = 0;
  };
  void open();
  void close() noexcept;
  static unsigned called(void* device) noexcept;
  void exchange() noexcept;
  servo::DeviceTrouble errors() noexcept;
  bool plausible(const Frame& frame) noexcept;

  servo::DeviceConfig config_;
  const Library& library_;
  Handle handle_ = kNoHandle;
  unsigned long scheduled_ = 0;
  servo::DeviceCapabilities capabilities_;
  double silence_ns_;  ///< an older force becomes zero
  servo::SharedValue<Wanted> wanted_;
  servo::TripleBuffer<Frame> frames_;
  Frame seen_;                 ///< the reader's newest
  Vec3 tip_, tail_;            ///< m, of the last reading
  std::int64_t asked_ns_ = 0;  ///< time of asking for it
  bool lost_ = true;
  std::atomic<std::int64_t> force_ns_{0};  ///< DeviceTimes
  // Used by the scheduler's thread only.
  std::int64_t set_ns_ = 0;  ///< Wanted::time_ns of the force set last
  servo::DeviceTrouble trouble_ = servo::DeviceTrouble::none;
  std::int64_t trouble_ns_ = 0;
  int until_calibration_ = 0;
  bool calibrated_ = true;
};

/// See DeviceKind.
void check(const servo::DeviceConfig& config);
servo::DeviceCapabilities nominal(const servo::DeviceConfig& config);
/// The names that the maker's setup stored below $GTDD_HOME.
std::vector<servo::ConnectedDevice> connected(const servo::DeviceConfig& config);
std::unique_ptr<servo::Device> open(const servo::DeviceConfig& config);

}  // namespace palpate::runner::devices::touch
