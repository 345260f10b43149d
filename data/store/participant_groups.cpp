#include "data/store/participant_groups.h"

#include <algorithm>

#include "data/stored_protocol.h"

namespace palpate::data {

ParticipantGroups::ParticipantGroups(const std::vector<ProtocolInfo>& protocols, bool unmasked) {
  for (const ProtocolInfo& protocol : protocols) {
    GroupAssignment groups = read_stored_protocol(protocol.text).groups;
    if (unmasked) groups = groups.unmasked();
    masked_ |= groups.masked();
    for (const std::string& name : groups.listed()) {
      if (std::ranges::find(names_, name) == names_.end()) names_.push_back(name);
    }
    if (groups.any()) by_protocol_.emplace(protocol.sha256, std::move(groups));
  }
}

std::string ParticipantGroups::of(const Participant& participant,
                                  const std::string& protocol_sha256) const {
  const auto groups = by_protocol_.find(protocol_sha256);
  return groups == by_protocol_.end() ? "" : groups->second.name(participant.enrolled_number);
}

}  // namespace palpate::data
