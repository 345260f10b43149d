#pragma once
// Keys of the keyboard by the names that a protocol gives them.

#include <map>
#include <string>

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

}  // namespace palpate::protocols
