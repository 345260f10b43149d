#pragma once
// A simulated participant for a block whose levels are chosen by answers: a psychometric function
// made to measure, that of nobody.

#include "protocols/protocol.h"

namespace palpate::protocols {

struct TypicalSettings {
  double place = 0.5;    ///< of the threshold, as a share of the levels' range, from the hard end
  double spread = 0.15;  ///< sd of the function, likewise
  double false_alarm = 0.05;  ///< detect, same/different
  double lapse = 0.02;
};

/// Cumulative normal on the scale of the block's first adaptive procedure, with its easier levels.
/// compare: guesses 1 / intervals; with levels on both sides of the standard they are lapses as
/// well, as many as at the other end, and the threshold is at the standard. \param block  with
/// levels
PsychometricParticipant typical_participant(const Protocol& protocol, const TaskBlock& block,
                                            const TypicalSettings& settings = {});

/// The harder and easier end of a procedure's levels; constant stimuli tell neither: nullopt.
std::optional<Easier> easier_of(const ProcedureSpec& spec);
LevelScale procedure_scale(const ProcedureSpec& spec);  ///< constant stimuli: linear

}  // namespace palpate::protocols
