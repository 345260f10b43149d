#pragma once

#include "runner/devices/falcon/guide.h"
#include "runner/servo/device.h"

namespace palpate::runner::falcon {

/// Asks the experimenter to pull the grip out and push it in until the device is homed. Zero force.
/// \throws GuideError when stopped or when the device is unplugged.
void wait_until_homed(Device& device, Clock& clock, Guide& guide);

}  // namespace palpate::runner::falcon
