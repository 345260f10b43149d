#pragma once

#include <string>
#include <vector>

#include "runner/servo/device.h"

namespace palpate::runner {

struct SelfTestResult {
  std::string what;
  bool passed = false;
  std::string found;
};

/// Reads a device for a second at its rate, pushing nothing: do readings come, in time, finite,
/// within reach and as still as a device that nobody pushes? \param rate  Hz, of the servo; never
/// above the device's own
std::vector<SelfTestResult> self_test(Device& device, double rate);

}  // namespace palpate::runner
