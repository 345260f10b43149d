#pragma once
// Procedures with simulated participants of known threshold: how many trials they take, and how
// accurate their estimates are.

#include <cstdint>

#include "protocols/procedures/procedure.h"
#include "protocols/procedures/procedure_spec.h"
#include "protocols/procedures/psychometric.h"

namespace palpate::protocols {

/// The trials still to come: exactly, or for an up-down staircase with a limit of reversals and for
/// the method of limits the mean of simulated courses. They assume a participant with the estimate
/// so far, at first half way between the start and the harder end of the range.
double expected_trials(const ProcedureSpec& spec, const Procedure& so_far);

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
