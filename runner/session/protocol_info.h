#pragma once

#include "data/record.h"
#include "protocols/protocol.h"

namespace palpate {

/// A protocol as the store keeps it: its text, and every file that it names as it was read.
ProtocolInfo info_of(const Protocol& protocol);

}  // namespace palpate
