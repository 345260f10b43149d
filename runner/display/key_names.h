#pragma once

#include <string>
#include <utility>
#include <vector>

namespace palpate::runner::display {

/// The names that a key may have in a protocol, most likely first: that of the keyboard layout,
/// then that of the same key on a US keyboard (so that the row of digits answers "1" to "9" on a
/// French keyboard too). Keys of the numeric pad are digits, whatever NumLock is. \param key,
/// scancode  GLFW's
std::vector<std::string> key_names(int key, int scancode);

/// The first name that is an answer key of the page, else the first name; empty for a key without a
/// name.
std::string match_key(const std::vector<std::string>& names,
                      const std::vector<std::pair<std::string, std::string>>& keys);

/// The name of an emergency key, "the key F12".
const char* emergency_key_name(int key);

/// The character of a key of the numeric pad, whatever NumLock is: a digit, "." or "-"; empty:
/// nothing.
std::string keypad_character(int key);

/// Whether a key is on the numeric pad; that pad belongs to the participant.
bool on_keypad(int key);

}  // namespace palpate::runner::display
