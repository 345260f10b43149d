#pragma once
// The delay from a device's pose to its force, which limits its stiffness, and the file that keeps
// measured delays beside a calibration.

#include <cstdint>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "runner/servo/device.h"

namespace palpate::runner::devices {

struct Percentiles {
  std::int64_t median = 0, p99 = 0, p999 = 0, max = 0;  ///< ns
};

/// Of ticks at zero force.
struct ChainTiming {
  std::string device, serial;
  double rate = 0;  ///< Hz
  std::uint64_t ticks = 0;
  std::uint64_t lost = 0;    ///< readings without a pose
  std::uint64_t late = 0;    ///< readings that repeat the last one
  std::uint64_t unsent = 0;  ///< forces not yet sent at the next tick
  Percentiles reading;       ///< duration of Device::read
  Percentiles age;           ///< of the pose when the tick uses it
  Percentiles wait;          ///< from a command until its force is sent
  Percentiles delay;         ///< age + wait of each tick
  std::string made_utc;      ///< time of the measurement
  bool sealed = true;        ///< false: of an older version, without a checksum

  /// s, the delay that 99 % of ticks keep.
  double counted() const { return static_cast<double>(delay.p99) * 1e-9; }
};

/// Limits of a device with this delay (s). A sampled spring with a delay needs damping K (T/2 +
/// delay) instead of K T/2 (Colgate & Schenkel 1997), so the device's damping and its largest
/// stiffness shrink by T/2 over T/2 + delay. \param rate  1/T, Hz, of the servo
servo::DeviceCapabilities with_delay(servo::DeviceCapabilities device, double delay, double rate);

nlohmann::ordered_json to_json(const ChainTiming& chain);

/// The file that holds measurements beside a calibration: lab.json has lab.timing.json.
std::string chain_file(const std::string& calibration);
/// Replaces the stored measurement of this kind of device and keeps the others.
/// \throws std::runtime_error; protocols::InputError: the file at this path is something else
void store_chain(const std::string& path, const ChainTiming& timing);
/// Empty where there is no such file. \throws protocols::InputError with every fault; also where a
/// measurement has no checksum, as those of older versions
std::vector<ChainTiming> stored_chains(const std::string& path);
/// The text of such a file. \param unsealed  accepts measurements without a checksum
/// \throws protocols::InputError with every fault
std::vector<ChainTiming> parse_chains(const std::string& text, const std::string& path,
                                      bool unsealed = false);
std::string to_json(const std::vector<ChainTiming>& chains);

}  // namespace palpate::runner::devices
