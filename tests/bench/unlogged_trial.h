#pragma once

#include "data/record.h"
#include "runner/participants/respondent.h"
#include "runner/servo/tick_source.h"

namespace palpate::bench {

/// A trial as Session::run_trial would run it if samples could not be kept: its yardstick.
class UnloggedTrial {
 public:
  UnloggedTrial(runner::TickSource& servo, runner::Respondent& participant, std::int64_t limit_ns)
      : servo_(servo), participant_(participant), limit_ns_(limit_ns) {}
  void run();

 private:
  void note(const runner::Sample& sample);

  runner::TickSource& servo_;
  runner::Respondent& participant_;
  std::int64_t limit_ns_;
  data::TrialRecord record_;
};

}  // namespace palpate::bench
