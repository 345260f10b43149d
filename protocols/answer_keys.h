#pragma once
// Names of the keyboard's keys in protocols.

#include <map>
#include <string>

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

}  // namespace palpate::protocols
