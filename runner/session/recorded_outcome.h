#pragma once
// The outcome of a recorded trial, to restore a session's plan.

#include "data/record.h"
#include "protocols/session_plan.h"

namespace palpate::runner::session {

inline protocols::TrialOutcome outcome_of(const data::TrialRecord& record) {
  protocols::TrialOutcome outcome{record.correct, record.task.success, !record.timed_out,
                                  record.task.level};
  for (const auto& [name, value] : record.task.dimensions) outcome.point.push_back(value);
  outcome.block = record.block;
  return outcome;
}

}  // namespace palpate::runner::session
