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
  explicit ParticipantGroups(Store& store)
      : ParticipantGroups(store.protocols(), !store.unmaskings().empty()) {}
  /// \param unmasked  whether masked groups have their names
  explicit ParticipantGroups(const std::vector<ProtocolInfo>& protocols, bool unmasked = false);

  /// Whether any protocol of the database has groups.
  bool any() const { return !by_protocol_.empty(); }
  /// Whether any of them are masked.
  bool masked() const { return masked_; }
  /// Names of all groups, in the order of protocols; masked ones by the alphabet.
  const std::vector<std::string>& names() const { return names_; }
  /// The participant's; "": the protocol has no groups. \param protocol_sha256  of the participant
  std::string of(const Participant& participant, const std::string& protocol_sha256) const;

 private:
  std::map<std::string, GroupAssignment> by_protocol_;  // by SHA-256
  std::vector<std::string> names_;
  bool masked_ = false;
};

}  // namespace palpate::data
