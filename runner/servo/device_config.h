#pragma once
// What a device is opened with, and what is found when looking for devices.

#include <string>
#include <vector>

namespace palpate::runner {

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

}  // namespace palpate::runner
