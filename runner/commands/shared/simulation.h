#pragma once
// What is checked before a study is simulated.

#include <set>
#include <string>

#include "protocols/protocol.h"
#include "runner/commands/shared/command.h"
#include "runner/session/simulated_study.h"

namespace palpate::runner {

/// \throws UsageError
void check_simulated_participants(int participants);
/// Adds --participant-version. It leaves `version` alone where it is not given.
void add_participant_version(CommandLine& line, int& version);
/// \throws UsageError: the simulated participant has no such version
void check_participant_version(const boost::program_options::variables_map& values, int version);
/// The version for a file without an option: the only one in `begun`, the default if that is empty.
/// \throws UsageError naming `file`: there are several
int version_to_go_on_with(const std::set<int>& begun, const std::string& file);

/// Limits the materials where the protocol says so. \throws UsageError: the simulated device or
/// participant cannot do the protocol
LimitedForSimulation fit_to_simulation(protocols::Protocol& protocol,
                                       const SimulatedSettings& simulated);

}  // namespace palpate::runner
