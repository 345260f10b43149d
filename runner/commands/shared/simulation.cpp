#include "runner/commands/shared/simulation.h"

#include <algorithm>
#include <string>
#include <vector>

#include "runner/commands/shared/command.h"

namespace palpate::runner {

void check_simulated_participants(int participants) {
  if (participants < 1 || participants > 100000)
    throw UsageError("--participants: must be 1 to 100000");
}

void check_participant_version(int version) {
  const std::vector<int> versions = participant_versions();
  if (std::find(versions.begin(), versions.end(), version) == versions.end())
    throw UsageError("--participant-version: must be 1 to " + std::to_string(versions.back()));
}

LimitedForSimulation fit_to_simulation(protocols::Protocol& protocol,
                                       const SimulatedSettings& simulated) {
  LimitedForSimulation limited = limit_for_simulation(protocol, simulated);
  std::string reasons;
  for (const std::string& fault : simulation_faults(protocol, StimulusLibrary(protocol), simulated))
    reasons += "\n" + fault;
  if (!reasons.empty()) throw UsageError("this protocol cannot be simulated:" + reasons);
  return limited;
}

}  // namespace palpate::runner
