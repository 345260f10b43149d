#include "runner/commands/shared/simulation.h"

#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

#include "data/base/text.h"

namespace palpate::runner {

void check_simulated_participants(int participants) {
  if (participants < 1 || participants > 100000)
    throw UsageError("--participants: must be 1 to 100000");
}

void add_participant_version(CommandLine& line, int& version) {
  line.options.add_options()(
      "participant-version", boost::program_options::value(&version)->value_name("1|2|3"),
      ("of the simulated participant; each is frozen. Default: the one that FILE was begun with, "
       "else " +
       std::to_string(kDefaultParticipantVersion))
          .c_str());
}

void check_participant_version(const boost::program_options::variables_map& values, int version) {
  if (values.count("participant-version") == 0) return;
  const std::vector<int> versions = participant_versions();
  if (std::find(versions.begin(), versions.end(), version) == versions.end())
    throw UsageError("--participant-version: must be 1 to " + std::to_string(versions.back()));
}

int version_to_go_on_with(const std::set<int>& begun, const std::string& file) {
  if (begun.empty()) return kDefaultParticipantVersion;
  if (begun.size() > 1) {
    std::string versions;
    for (const int version : begun)
      versions += (versions.empty() ? "" : ", ") + std::to_string(version);
    throw UsageError(printable(file) + ": holds versions " + versions +
                     " of the simulated participant; choose one with --participant-version");
  }
  if (*begun.begin() != kDefaultParticipantVersion) {
    std::fprintf(stderr, "%s: goes on with version %d of the simulated participant\n",
                 printable(file).c_str(), *begun.begin());
  }
  return *begun.begin();
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
