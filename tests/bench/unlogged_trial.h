#pragma once

#include "data/record.h"
#include "runner/participants/respondent.h"
#include "runner/servo/tick_source.h"
#include "runner/session/live_forces.h"

namespace palpate::bench {

/// A trial as Session::run_trial would run it if samples could not be kept: its yardstick. How the
/// object was touched is counted in either: every trial's record has it.
class UnloggedTrial {
 public:
  UnloggedTrial(runner::servo::TickSource& servo, runner::participants::Respondent& participant,
                const runner::SharpEdges& edges, const Quat& orientation, std::int64_t limit_ns)
      : servo_(servo), participant_(participant), limit_ns_(limit_ns) {
    contact_.begin(edges, orientation);
  }
  void run();

 private:
  void note(const runner::servo::Sample& sample);

  runner::servo::TickSource& servo_;
  runner::participants::Respondent& participant_;
  std::int64_t limit_ns_;
  data::TrialRecord record_;
  runner::session::ContactLog contact_;
};

}  // namespace palpate::bench
