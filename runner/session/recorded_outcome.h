#pragma once
// The outcome of a recorded trial, to restore a session's plan.

#include "data/record.h"
#include "protocols/session_plan.h"

namespace palpate::runner::session {

inline protocols::TrialOutcome outcome_of(const data::TrialRecord& record) {
  return {record.correct, record.task.success, !record.timed_out, record.task.level};
}

}  // namespace palpate::runner::session
