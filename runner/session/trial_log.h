#pragma once
// The trial log: the trial loop's interface to the database.

#include <cstdint>
#include <string>
#include <vector>

#include "data/record.h"
#include "data/store/store.h"

namespace palpate::runner::session {

/// Where a session writes its trials, before and after each is shown.
class TrialLog {
 public:
  virtual ~TrialLog() = default;
  /// Before the stimulus is shown. \return the attempt's number, 1, 2, ...
  virtual int begin(const data::TrialRecord& planned, std::int64_t began_ns) = 0;
  /// After the answer; when this returns, the trial is durable.
  virtual void finish(const data::TrialRecord& record) = 0;
  /// The trial will be shown again.
  virtual void cut_off(const std::string& reason) = 0;
  /// Stores an answer to a question of a page of version 2; when this returns, it is durable. A log
  /// without pages ignores it.
  virtual void answered(const data::PageAnswer& /*answer*/) {}
  /// Stores an event of the session, as JSON. A log without notes ignores it. \param at_ns  session
  /// clock
  virtual void note(std::int64_t /*at_ns*/, const std::string& /*text*/) {}
  /// The answers of this session that are in force; their questions are not asked again.
  virtual std::vector<data::PageAnswer> answers() { return {}; }
};

}  // namespace palpate::runner::session
