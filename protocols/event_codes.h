#pragma once
// What other recorders get for the events of a session: a byte each.

#include <map>
#include <string>

#include "protocols/protocol.h"

namespace palpate::protocols {

class ObjectReader;

/// By the event's name, "trial_start" or "response:cube"; 1 to 255.
using EventCodes = std::map<std::string, int>;

/// Of the events that every protocol has.
EventCodes usual_event_codes();

/// Reads `codes` of a protocol whose stimuli, keys and blocks are read already. Events without a
/// code of their own keep the usual one.
EventCodes read_event_codes(ObjectReader& reader, const Protocol& protocol);

/// Of a protocol that has no fault, from its text: nobody but a live session asks for them.
EventCodes event_codes(const Protocol& protocol);

}  // namespace palpate::protocols
