#pragma once

#include "protocols/object_reader.h"
#include "protocols/protocol.h"

namespace palpate::protocols {

/// Reads `keys` of a response of version 1: every stimulus has one key, every label is its own.
void read_response_keys(ObjectReader& response, Protocol& protocol);

}  // namespace palpate::protocols
