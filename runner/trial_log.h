#pragma once

#include <cstdint>
#include <string>

#include "data/record.h"
#include "data/store.h"

namespace palpate {

/// Where a session writes its trials, before and after each is shown.
class TrialLog {
 public:
  virtual ~TrialLog() = default;
  /// Before the stimulus is shown. \return the attempt's number, 1, 2, ...
  virtual int begin(const TrialRecord& planned, std::int64_t began_ns) = 0;
  /// After the answer; the trial is acknowledged when this returns.
  virtual void finish(const TrialRecord& record) = 0;
  /// The trial will be shown again.
  virtual void cut_off(const std::string& reason) = 0;
};

/// Each step is on disk when it returns: a live session, where a person has felt the trial.
class DurableLog final : public TrialLog {
 public:
  DurableLog(Store& store, const Run& run) : store_(store), run_(run) {}
  int begin(const TrialRecord& planned, std::int64_t began_ns) override {
    return store_.begin_attempt(run_, planned, began_ns);
  }
  void finish(const TrialRecord& record) override { store_.finish_attempt(run_, record); }
  void cut_off(const std::string& reason) override { store_.cut_off_attempt(run_, reason); }

 private:
  Store& store_;
  Run run_;
};

}  // namespace palpate
