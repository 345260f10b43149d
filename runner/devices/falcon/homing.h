#pragma once

#include "runner/devices/falcon/guide.h"
#include "runner/servo/device.h"

namespace palpate::runner::falcon {

/// Asks for the grip to be pulled out and pushed in, until the device knows where it is. Shows no
/// force. \throws GuideError when it is stopped or the device is unplugged.
void wait_until_homed(Device& device, Clock& clock, Guide& guide);

}  // namespace palpate::runner::falcon
