#pragma once
// A Force Dimension omega, delta, sigma or lambda, through the maker's library. Not tested on
// hardware: runner/README.md lists the uncertainties.

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "runner/servo/device.h"

namespace palpate::runner::devices::forcedimension {

/// The functions of Force Dimension's library, loaded at run time: it is proprietary and is
/// installed by the lab. The prototypes were written from its public documentation (SDK 3.7
/// to 3.17). `id` is the number returned on opening a device. Negative results are errors unless
/// stated otherwise. SI units; frame: x to the user, y right, z up.
struct Library {
  /// \param path  of libdrd or libdhd; empty: search $FDSDK and $FORCEDIM_SDK, then the loader's
  ///              paths. \throws std::runtime_error naming the paths or the missing function
  explicit Library(const std::string& path);
  Library(const Library&) = delete;
  Library& operator=(const Library&) = delete;

  std::string version() const;  ///< "3.17.5.0"

  void (*get_sdk_version)(int* major, int* minor, int* release, int* revision) = nullptr;
  int (*get_device_count)() = nullptr;
  int (*open_id)(char index) = nullptr;  ///< returns the id
  int (*close)(char id) = nullptr;
  int (*get_serial_number)(unsigned short* serial, char id) = nullptr;
  const char* (*get_system_name)(char id) = nullptr;
  int (*get_status)(int* status, char id) = nullptr;  ///< room for kStatusRoom numbers
  bool (*has_wrist)(char id) = nullptr;
  bool (*has_active_wrist)(char id) = nullptr;
  bool (*has_gripper)(char id) = nullptr;
  /// 0 and 1 (nothing new since the last call) are success.
  int (*get_position_and_frame)(double* x, double* y, double* z, double frame[3][3],
                                char id) = nullptr;
  /// 0 and 2 (a motor is saturated) are success.
  int (*set_force_and_torque)(double fx, double fy, double fz, double tx, double ty, double tz,
                              char id) = nullptr;
  int (*enable_force)(unsigned char on, char id) = nullptr;
  int (*set_brakes)(int on, char id) = nullptr;
  int (*set_gravity_compensation)(int on, char id) = nullptr;
  unsigned (*get_button_mask)(char id) = nullptr;
  int (*enable_expert_mode)() = nullptr;
  int (*set_time_guard)(int microseconds, char id) = nullptr;
  int (*error_get_last)() = nullptr;
  const char* (*error_get_last_str)() = nullptr;

  // Null in older versions without the function; the last four also in libdhd.
  int (*set_watchdog)(unsigned char periods_of_125us, char id) = nullptr;
  int (*emulate_button)(unsigned char on, char id) = nullptr;
  int (*open_to_regulate)(char index) = nullptr;  ///< returns the id
  bool (*is_initialized)(char id) = nullptr;      ///< its arm has been moved to calibrate it
  int (*auto_init)(char id) = nullptr;            ///< moves the arm; returns when it is done
  int (*stop_regulation)(bool keep_forces, char id) = nullptr;

 private:
  struct Unload {
    void operator()(void* handle) const;
  };
  std::unique_ptr<void, Unload> handle_;
};

inline constexpr int kStatusRoom = 64;  ///< 16 or 17 are written, by version
/// Places in the status.
inline constexpr int kPower = 0, kConnected = 1, kReset = 3, kForce = 5, kError = 9, kGravity = 10,
                     kTimeGuard = 11;

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
