#pragma once
// The station of a live session: device, servo, display and database, open from the first check to
// the report.

#include "runner/commands/run/parts.h"

namespace palpate::runner {

/// Opens what a session needs, runs it in a thread of its own beside the display's loop, and
/// reports. \returns the exit status. \throws UsageError: the device cannot show the protocol, or
/// no session is due; as what it opens.
int run_station(const RunSettings& settings);

}  // namespace palpate::runner
