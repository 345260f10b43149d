#pragma once
// The functions of OpenHaptics' libHD, loaded at run time: it is proprietary and is installed by
// the lab. Prototypes and numbers were written from its public documentation.

#include <string>

namespace palpate::runner::devices::touch {

using Handle = unsigned;
inline constexpr Handle kNoHandle = 0xFFFFFFFF;

struct Error {
  unsigned code;
  int internal;
  Handle device;
};

/// Frame: x right, y up, z to the user. Millimetres, newtons.
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
                          kCalibrationStyle = 0x2555, kStiffness = 0x2602, kMaxForce = 0x2603,
                          kForceOutput = 0x4000, kForceClamping = 0x4001, kCalibrated = 0x5000,
                          kCalibrationUpdate = 0x5001;
inline constexpr unsigned kWarm = 0x0200, kTooFast = 0x0203, kFault = 0x0300, kInUse = 0x0301,
                          kCommunication = 0x0302, kLicence = 0x0600;

}  // namespace palpate::runner::devices::touch
