#pragma once
// The groups of a database's participants, which follow from protocol and number.

#include <map>
#include <string>
#include <vector>

#include "data/base/group_assignment.h"
#include "data/store/store.h"

namespace palpate::data {

class ParticipantGroups {
 public:
  ParticipantGroups() = default;
  explicit ParticipantGroups(Store& store) : ParticipantGroups(store.protocols()) {}
  explicit ParticipantGroups(const std::vector<ProtocolInfo>& protocols);

  /// Whether any protocol of the database has groups.
  bool any() const { return !by_protocol_.empty(); }
  /// Names of all groups, in the order of protocols.
  const std::vector<std::string>& names() const { return names_; }
  /// The participant's; "": the protocol has no groups. \param protocol_sha256  of the participant
  std::string of(const Participant& participant, const std::string& protocol_sha256) const;

 private:
  std::map<std::string, GroupAssignment> by_protocol_;  // by SHA-256
  std::vector<std::string> names_;
};

}  // namespace palpate::data
