#pragma once
// A 3D Systems Touch, Touch X or Phantom, through the maker's library and its scheduler. Not tested
// on hardware: runner/README.md lists the uncertainties.

#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "runner/servo/device.h"
#include "runner/servo/shared_value.h"
#include "runner/servo/triple_buffer.h"

namespace palpate::runner::devices::touch {

using Handle = unsigned;
inline constexpr Handle kNoHandle = 0xFFFFFFFF;

struct Error {
  unsigned code;
  int internal;
  Handle device;
};

/// The functions of OpenHaptics' libHD, loaded at run time: it is proprietary and is installed by
/// the lab. Prototypes and numbers were written from its public documentation. Frame: x right, y
/// up, z to the user. Millimetres, newtons.
struct Library {
  /// Loads it once for the whole process and never unloads it: loading it again fails.
  /// \param path  empty: the loader's paths. \throws std::runtime_error naming the paths tried or
  /// the missing function
  static const Library& get(const std::string& path);

  Handle (*init_device)(const char* name) = nullptr;  ///< nullptr: the default device
  void (*disable_device)(Handle) = nullptr;
  void (*make_current)(Handle) = nullptr;
  void (*begin_frame)(Handle) = nullptr;
  void (*end_frame)(Handle) = nullptr;
  void (*enable)(unsigned what) = nullptr;
  unsigned char (*is_enabled)(unsigned what) = nullptr;
  void (*get_doubles)(unsigned what, double*) = nullptr;
  void (*get_integers)(unsigned what, int*) = nullptr;
  void (*set_doubles)(unsigned what, const double*) = nullptr;
  const char* (*get_string)(unsigned what) = nullptr;
  Error (*get_error)() = nullptr;
  const char* (*error_string)(unsigned code) = nullptr;
  unsigned (*check_calibration)() = nullptr;
  void (*update_calibration)(unsigned style) = nullptr;
  void (*set_rate)(unsigned long hz) = nullptr;
  void (*start)() = nullptr;
  void (*stop)() = nullptr;
  /// The scheduler calls the callback at its rate, in its thread, as long as it returns 1.
  unsigned long (*schedule)(unsigned (*callback)(void*), void* data,
                            unsigned short priority) = nullptr;
  void (*unschedule)(unsigned long) = nullptr;

 private:
  explicit Library(const std::string& path);
};

// Parameters to get and set, and returned values.
inline constexpr unsigned kButtons = 0x2000, kPosition = 0x2050, kTransform = 0x2052,
                          kForce = 0x2700, kModel = 0x2501, kSerialNumber = 0x2504,
                          kCalibrationStyle = 0x2555, kWorkspace = 0x2551, kStiffness = 0x2602,
                          kMaxForce = 0x2603, kForceOutput = 0x4000, kForceClamping = 0x4001,
                          kCalibrated = 0x5000, kCalibrationUpdate = 0x5001;
/// Styles of calibration, bits of kCalibrationStyle.
inline constexpr unsigned kEncoderReset = 1, kAuto = 2, kInkwell = 4;
inline constexpr unsigned kWarm = 0x0200, kTooFast = 0x0203, kFault = 0x0300, kInUse = 0x0301,
                          kCommunication = 0x0302, kLicence = 0x0600;

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
  void check_settings();
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
