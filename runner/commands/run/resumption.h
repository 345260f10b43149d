#pragma once
// What is said of a session that goes on from where it was left, and of somebody who had left.

#include <string>

#include "data/store/store.h"
#include "runner/session/session_plan.h"

namespace palpate::runner {

/// "yesterday 15:02", "today 09:30", "2026-01-31 15:02", in local time.
std::string spoken_time(std::int64_t utc_ns, std::int64_t now_utc_ns);

/// "12 of 24 trials done, last run yesterday 15:02 (paused), goes on with trial 13". Empty where
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
