#pragma once
// The group of a new participant, which the number stands for (data/base/group_assignment.h).

#include <optional>
#include <set>
#include <string>
#include <vector>

#include "protocols/protocol.h"
#include "runner/station/run_settings.h"

namespace palpate::runner::station {

/// The facts that the choice depends on.
struct GroupFacts {
  std::optional<int> enrolled = {};  ///< number of a participant who is known
  std::set<int> taken = {};          ///< numbers of others
  std::vector<std::size_t> completed =
      {};  ///< participants of each group who have done every session
};

/// The number that --group, --fill or the protocol's own rule gives to a participant; none: the
/// next unused one. \throws UsageError: the options contradict the protocol, the number or a known
/// participant, or the protocol leaves the group to the experimenter and there is no --group.
std::optional<int> number_in_group(const RunSettings& settings, const protocols::Protocol& protocol,
                                   const GroupFacts& facts);

}  // namespace palpate::runner::station
