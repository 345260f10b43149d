#pragma once

#include <string>
#include <vector>

#include "runner/device.h"
#include "runner/scene_builder.h"

namespace palpate {

/// Why a protocol cannot be run on a device, one sentence each with what would help; empty: it can.
std::vector<std::string> misfits(const Protocol& protocol, const StimulusLibrary& library,
                                 const DeviceCapabilities& device);

}  // namespace palpate
