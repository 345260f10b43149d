#pragma once
// The trial loop's way to the database.

#include <cstdint>
#include <string>

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
};

}  // namespace palpate::runner
