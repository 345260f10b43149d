#pragma once

#include <atomic>

namespace palpate::runner {

/// From now on the first Ctrl-C (SIGINT or SIGTERM) only sets the flag that is returned, for the
/// command to end cleanly; a second one ends the program as usual.
const std::atomic<bool>& watch_stop_signals();

}  // namespace palpate::runner
