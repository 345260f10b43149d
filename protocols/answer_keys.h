#pragma once
// What an answer is on the outside: keys of the keyboard by the names that a protocol gives them,
// and codes of events.

#include <map>
#include <string>

#include "protocols/protocol.h"

namespace palpate::protocols {

/// "space", "enter", "tab", "backspace", "left", "right", "up", "down", or the character that the
/// key writes without Shift. \return  "", or why nobody can press such a key
std::string key_fault(const std::string& name);

/// The same for all names of one key: "A" is the key "a".
std::string one_key(const std::string& name);

/// Keys of one object of keys, to find those that are one.
class KeysTaken {
 public:
  /// \return  key_fault(), or that it is the same key as one before; "": neither
  std::string add(const std::string& name);

 private:
  std::map<std::string, std::string> names_;  ///< by one_key()
};

// What other recorders get for the events of a session: a byte each.

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
