#pragma once
// From a parsed protocol to the record of it.

#include "data/record.h"
#include "protocols/protocol.h"

namespace palpate::runner {

/// A protocol as the store keeps it: its text, and every file that it names as it was read.
data::ProtocolInfo info_of(const protocols::Protocol& protocol);

}  // namespace palpate::runner
