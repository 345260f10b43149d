#pragma once
// Groups of participants, as a protocol describes them: their names, who belongs to which
// (data/base/group_assignment.h), and what differs for a group.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "protocols/object_reader.h"
#include "protocols/protocol.h"

namespace palpate::protocols {

/// Reads the key `groups` into protocol.groups. \param masked  whether its groups are to be masked,
/// once the seed is known \return the merge patch (RFC 7396) of each group
/// on the protocol; empty: there are no groups
std::vector<nlohmann::json> read_groups(ObjectReader& reader, Protocol& protocol, bool& masked);

/// The name of each group and the text of its protocol; without groups "" and the text itself. Not
/// validated again.
std::vector<std::pair<std::string, std::string>> texts_of_groups(const std::string& text);

/// The protocol that a participant sees: that of their group.
const Protocol& protocol_of(const Protocol& protocol, int participant_number);

}  // namespace palpate::protocols
