#include "runner/study/simulation_limits.h"

#include <string>

#include "runner/scene_builder.h"
#include "runner/usage_error.h"

namespace palpate::runner::study {

void check_simulated_participants(int participants) {
  if (participants < 1 || participants > 100000)
    throw UsageError("--participants: must be 1 to 100000");
}

session::LimitedForSimulation fit_to_simulation(protocols::Protocol& protocol,
                                                const participants::SimulatedSettings& simulated) {
  session::LimitedForSimulation limited = session::limit_for_simulation(protocol, simulated);
  std::string reasons;
  const auto add_reasons = [&](const protocols::Protocol& shown, const std::string& group) {
    for (const std::string& fault : session::simulation_faults(
             shown, StimulusLibrary(shown), participants::settings_of_group(simulated, group)))
      reasons += "\n" + (group.empty() ? "" : "group '" + group + "': ") + fault;
  };
  const GroupAssignment groups = protocol.groups.unmasked();
  for (const auto& [name, own] : simulated.groups) {
    if (groups.find(name) == groups.names.size())
      reasons += "\nthe settings have a group '" + name + "', the protocol has none of that name";
  }
  if (!protocol.groups.any()) add_reasons(protocol, "");
  for (std::size_t i = 0; i < protocol.group_protocols.size(); ++i)
    add_reasons(*protocol.group_protocols[i], groups.names[i]);
  if (!reasons.empty()) throw UsageError("this protocol cannot be simulated:" + reasons);
  return limited;
}

}  // namespace palpate::runner::study
