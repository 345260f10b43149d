#pragma once
// Ctrl-C during a long command.

#include <atomic>

namespace palpate::runner {

/// From now on the first SIGINT (Ctrl-C) or SIGTERM only sets the returned flag, so that the
/// command can end cleanly; a second one ends the program as usual.
const std::atomic<bool>& catch_stop_signals();

}  // namespace palpate::runner
