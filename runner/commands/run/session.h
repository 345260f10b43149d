#pragma once
// One session of a live study, from pre-flight to its last trial.

#include "runner/commands/run/parts.h"

namespace palpate::runner {

/// Which session is due. \throws UsageError: none is, or the one asked for does not exist.
int choose_session(data::Store& store, const data::Participant& participant,
                   const protocols::Protocol& protocol, const RunSettings& settings, Clock& clock);

/// Pre-flight, then the trials that are not on record yet; for the session's own thread.
/// \throws EndOfSession: it ended before there was anything to record; as LiveSession::run
LiveSession::Outcome run_session(const RunParts& at);

}  // namespace palpate::runner
