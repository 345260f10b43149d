#pragma once
// What is checked before a study is simulated.

#include "protocols/protocol.h"
#include "runner/session/simulated_study.h"

namespace palpate::runner {

/// \throws UsageError
void check_simulated_participants(int participants);
/// \throws UsageError: the simulated participant has no such version
void check_participant_version(int version);

/// Limits the materials where the protocol says so. \throws UsageError: the simulated device or
/// participant cannot do the protocol
LimitedForSimulation fit_to_simulation(protocols::Protocol& protocol,
                                       const SimulatedSettings& simulated);

}  // namespace palpate::runner
