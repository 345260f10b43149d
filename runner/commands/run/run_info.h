#pragma once
// What goes on record of a run as a whole.

#include <optional>

#include "data/record.h"
#include "protocols/protocol.h"
#include "runner/commands/run/admission.h"
#include "runner/commands/run/settings.h"
#include "runner/servo/device.h"

namespace palpate::runner {

/// This moment on the session clock and in UTC.
data::ClockStamp stamp_now(Clock& clock);

/// \param joystick  whether the protocol maps one, and a window looks at it
data::RunInfo run_info(const RunSettings& settings, const DeviceCapabilities& device, int session,
                       const data::ClockStamp& began, bool joystick);

/// The protocol as shown, where its texts are not those of the one that the participant is enrolled
/// in.
std::optional<data::ProtocolInfo> other_texts(const Admission& admission);

}  // namespace palpate::runner
