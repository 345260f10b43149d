#pragma once
// Event codes for other recorders: one byte for each event of a session.

#include <map>
#include <string>

#include "protocols/protocol.h"

namespace palpate::protocols {

class ObjectReader;

/// By the event's name, "trial_start" or "response:cube"; 1 to 255.
using EventCodes = std::map<std::string, int>;

/// Codes of the events that every protocol has.
EventCodes usual_event_codes();

/// Reads `codes` of a protocol whose stimuli, keys and blocks are read already. Events without a
/// code of their own keep the usual one.
EventCodes read_event_codes(ObjectReader& reader, const Protocol& protocol);

/// Codes of a valid protocol, read from its text; only a live session needs them.
EventCodes event_codes(const Protocol& protocol);

}  // namespace palpate::protocols
