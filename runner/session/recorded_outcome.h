#pragma once
// The outcome of a recorded trial, to restore a session's plan.

#include <nlohmann/json.hpp>
#include <string>

#include "data/base/json_text.h"
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

/// The note of a block that a program ended before a trial of this number.
inline constexpr const char* kBlockEnded = "block_ended_by_program";

/// Ends the block of the next trial if a note says so. \return whether it did
inline bool end_as_noted(protocols::SessionPlan& plan, const std::string& note) {
  if (plan.finished() || !plan.tracks() || note.find(kBlockEnded) == std::string::npos)
    return false;
  const auto json = json_or_discarded(note);
  if (!json.is_object() || !json.contains(kBlockEnded)) return false;
  const auto& ended = json[kBlockEnded];
  if (!ended.is_object() || ended.value("before_trial", 0) != plan.next().trial ||
      ended.value("block", "") != plan.block().name)
    return false;
  plan.end_block();
  return true;
}

}  // namespace palpate::runner::session
