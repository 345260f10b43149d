#pragma once
// Which session is due, where it goes on, and whether its participant has withdrawn.

#include <cstdint>
#include <string>

#include "data/store/store.h"
#include "protocols/protocol.h"
#include "runner/commands/run/settings.h"
#include "runner/session/session_plan.h"

namespace palpate::runner {

/// The session that is due, or was asked for. \throws UsageError: none is due, the one asked for
/// does not exist, or the participant has withdrawn.
int choose_session(data::Store& store, const data::Participant& participant,
                   const protocols::Protocol& protocol, const RunSettings& settings);

/// "yesterday 15:02", "today 09:30", "2026-01-31 15:02", in local time.
std::string spoken_time(std::int64_t utc_ns, std::int64_t now_utc_ns);

/// "12 of 24 trials done, last run yesterday 15:02 (paused), continues with trial 13". Empty where
/// the session was never begun.
std::string resumption(data::Store& store, const data::Participant& participant, int session,
                       const SessionPlan& plan);

/// Has the newest run of somebody with this code ended with a withdrawal, in whatever protocol?
/// \throws UsageError: it has
void refuse_withdrawn(data::Store& store, const std::string& code);

/// \param when  in words; empty: not said
[[noreturn]] void throw_withdrawn(const std::string& code, const std::string& when);

/// When that was; empty: it has not.
std::string withdrawn_when(data::Store& store, const std::string& code);

}  // namespace palpate::runner
