#pragma once
// Measures the delay from a device's pose to its force, through its guard process.

#include "runner/devices/device_delay.h"
#include "runner/devices/registry.h"

namespace palpate::runner {

/// Opens the device as a session does and reads and writes it at its rate, at zero force.
/// \throws std::runtime_error: the device cannot be opened, or does not keep its times
ChainTiming measure_chain(const DeviceKind& kind, const DeviceConfig& config, double seconds);

}  // namespace palpate::runner
