#pragma once

#include <string>
#include <utility>
#include <vector>

namespace palpate::runner {

/// What a key of the keyboard may be called in a protocol, the likeliest first: what its layout
/// writes on it, then what stands at its place on a US keyboard (so that the row of digits answers
/// "1" to "9" on a French keyboard too). Keypad as digits, whatever NumLock says.
/// \param key, scancode  GLFW's
std::vector<std::string> key_names(int key, int scancode);

/// The first name that the page gives a meaning to, else the first; empty for a key without a name.
std::string meant(const std::vector<std::string>& names,
                  const std::vector<std::pair<std::string, std::string>>& keys);

/// Which of the emergency keys it is, in words.
const char* emergency_key(int key);

/// On the numeric pad, which belongs to the participant.
bool on_keypad(int key);

}  // namespace palpate::runner
