#pragma once
// The accuracy of a procedure's estimates for simulated participants of known threshold.

#include <cstdint>

#include "protocols/procedures/procedure_spec.h"

namespace palpate::protocols {

/// Bias and spread over simulated participants, on the procedure's scale.
struct Recovery {
  int participants = 0;
  int without_estimate = 0;  ///< too few reversals, no change in any series
  double bias = 0;           ///< mean of estimate less truth
  double bias_se = 0;
  double spread = 0;  ///< standard deviation of the estimates
  double mean_trials = 0;
};

/// The level that a procedure aims at for a participant. Staircase: the level with the success rate
/// of its convergence point. QuestPlus: the threshold. Limits: the level with half successes.
/// ConstantStimuli has no estimate of its own: 0.
double true_threshold(const ProcedureSpec& spec, const PsychometricParticipant& participant);

Recovery simulate_recovery(const ProcedureSpec& spec, const PsychometricParticipant& participant,
                           int participants, std::uint64_t seed);

}  // namespace palpate::protocols
