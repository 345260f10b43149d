#pragma once
// Names of the keyboard's keys in protocols, and codes of events.

#include <map>
#include <string>

#include "protocols/protocol.h"

namespace palpate::protocols {

/// "space", "enter", "tab", "backspace", "left", "right", "up", "down", or the character that the
/// key writes without Shift. \return  "", or why nobody can press such a key
std::string key_fault(const std::string& name);

/// One name for each key: "A" is the key "a".
std::string one_key(const std::string& name);

/// The keys of one JSON object; finds two names of the same key.
class KeysTaken {
 public:
  /// \return  key_fault(), or that it is the same key as one before; "": neither
  std::string add(const std::string& name);

 private:
  std::map<std::string, std::string> names_;  ///< by one_key()
};

// Event codes for other recorders: one byte for each event of a session.

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
