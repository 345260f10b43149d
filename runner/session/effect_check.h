#pragma once
// Whether a device and a servo rate can show an object's texture, fields and knock.

#include <string>
#include <vector>

#include "runner/servo/device.h"
#include "stimuli/shapes.h"

namespace palpate::runner::session {

/// Each with its key in the object: " has at /texture/period_m ...". Empty: the device shows them.
std::vector<std::string> effect_faults(const stimuli::ObjectSpec& object, double rate,
                                       const servo::DeviceCapabilities& device);

/// Sentences that whoever runs the study should know, each with its key in the object.
/// \param texture  of the object; null: it is smooth
std::vector<std::string> effect_notes(const stimuli::ObjectSpec& object,
                                      const stimuli::Texture* texture, double rate);

}  // namespace palpate::runner::session
