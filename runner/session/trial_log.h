#pragma once
// The trial loop's way to the database.

#include <cstdint>
#include <string>
#include <vector>

#include "data/record.h"

namespace palpate::runner {

/// Where a session writes its trials, before and after each is shown.
class TrialLog {
 public:
  virtual ~TrialLog() = default;
  /// Before the stimulus is shown. \return the attempt's number, 1, 2, ...
  virtual int begin(const data::TrialRecord& planned, std::int64_t began_ns) = 0;
  /// After the answer; the trial is acknowledged when this returns.
  virtual void finish(const data::TrialRecord& record) = 0;
  /// The trial will be shown again.
  virtual void cut_off(const std::string& reason) = 0;
  /// The answers to a page of version 2, together. A log that keeps none loses them.
  virtual void answered(const std::vector<data::PageAnswer>& /*answers*/) {}
  /// An event of the session, as JSON. A log that keeps none loses it. \param at_ns  session clock
  virtual void note(std::int64_t /*at_ns*/, const std::string& /*text*/) {}
  /// Whether a page of this session has been answered: it is not shown again.
  virtual bool has_answers(const std::string& /*page*/) { return false; }
};

}  // namespace palpate::runner
