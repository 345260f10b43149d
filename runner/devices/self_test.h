#pragma once

#include <string>
#include <vector>

#include "runner/servo/device.h"

namespace palpate::runner::devices {

struct SelfTestResult {
  std::string what;
  bool passed = false;
  std::string found;
};

/// Reads a device for a second with zero force and checks that readings arrive in time and are
/// finite, within reach and without jumps. \param rate  Hz, of the servo; limited to the device's
/// own
std::vector<SelfTestResult> self_test(servo::Device& device, double rate);

}  // namespace palpate::runner::devices
