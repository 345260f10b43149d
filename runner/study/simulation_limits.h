#pragma once
// Whether a study can be simulated.

#include "protocols/protocol.h"
#include "runner/participants/simulated_settings.h"
#include "runner/session/simulated_study.h"

namespace palpate::runner::study {

/// \throws UsageError
void check_simulated_participants(int participants);

/// Limits the materials if the protocol asks for it. \throws UsageError: the simulated device or
/// participant cannot do the protocol
session::LimitedForSimulation fit_to_simulation(protocols::Protocol& protocol,
                                                const participants::SimulatedSettings& simulated);

}  // namespace palpate::runner::study
