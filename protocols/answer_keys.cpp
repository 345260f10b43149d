#include "protocols/answer_keys.h"

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>
#include <utility>

#include "data/base/text.h"
#include "data/base/utf8.h"

namespace palpate::protocols {
namespace {

constexpr std::array<std::string_view, 8> kNamed = {"space", "enter", "tab", "backspace",
                                                    "left",  "right", "up",  "down"};

// Other programs' names of keys.
constexpr std::array<std::pair<std::string_view, std::string_view>, 9> kOtherNames = {
    {{"return", "enter"},
     {" ", "space"},
     {"spacebar", "space"},
     {"back", "backspace"},
     {"del", "backspace"},
     {"arrowleft", "left"},
     {"arrowright", "right"},
     {"arrowup", "up"},
     {"arrowdown", "down"}}};

// Characters that a single key of some layout writes. Left out: controls, spaces, signs without a
// form of their own, and ideographs and syllables, which an input method puts together from several
// keys. The schema has the same ranges.
constexpr std::array<std::pair<char32_t, char32_t>, 15> kWritten = {{{U'!', U'9'},
                                                                     {U';', U'~'},
                                                                     {0xA1, 0xAC},
                                                                     {0xAE, 0x167F},
                                                                     {0x1681, 0x1FFF},
                                                                     {0x2010, 0x2027},
                                                                     {0x2030, 0x205E},
                                                                     {0x2070, 0x2FFF},
                                                                     {0x3001, 0x33FF},
                                                                     {0x4DC0, 0x4DFF},
                                                                     {0xA000, 0xA015},
                                                                     {0xA490, 0xABFF},
                                                                     {0xFB00, 0xFEFE},
                                                                     {0xFF01, 0xFFDC},
                                                                     {0xFFE0, 0xFFEE}}};

/// The only character of a text in UTF-8; nullopt: it has none or several.
std::optional<char32_t> only_character(const std::string& text) {
  if (text.empty()) return std::nullopt;
  const Character first = first_character(text);
  if (!first.well_formed || first.size != text.size()) return std::nullopt;
  return first.code;
}

/// Lower case of the Latin, Greek and Cyrillic letters on keyboards.
char32_t lower_letter(char32_t c) {
  const auto within = [c](char32_t low, char32_t high) { return c >= low && c <= high; };
  if (within(U'A', U'Z') || (within(0xC0, 0xDE) && c != 0xD7) || within(0x391, 0x3A9) ||
      within(0x410, 0x42F))
    return c + 0x20;
  if (within(0x400, 0x40F)) return c + 0x50;
  if (c == 0x178) return 0xFF;
  // Pairs: the lower case follows the upper case.
  const bool even_first = within(0x100, 0x137) || within(0x14A, 0x177) || within(0x460, 0x481) ||
                          within(0x48A, 0x4BF) || within(0x4D0, 0x52F) || within(0x1E00, 0x1EFF);
  const bool odd_first = within(0x139, 0x148) || within(0x179, 0x17E) || within(0x4C1, 0x4CE);
  if ((even_first && c % 2 == 0) || (odd_first && c % 2 == 1)) return c + 1;
  return c;
}

/// The key name that was probably meant: "num_1" is '1', "Return" is 'enter'.
std::string meant_by(const std::string& name) {
  std::string lower;
  for (const char c : name) lower += c >= 'A' && c <= 'Z' ? static_cast<char>(c + 0x20) : c;
  for (const auto& [other, ours] : kOtherNames) {
    if (lower == other) return std::string(ours);
  }
  for (const std::string_view prefix : {"num", "kp", "numpad", "keypad", "digit", "key", "pad"}) {
    std::string_view rest = lower;
    if (!rest.starts_with(prefix)) continue;
    rest.remove_prefix(prefix.size());
    while (!rest.empty() && (rest.front() == '_' || rest.front() == ' ')) rest.remove_prefix(1);
    const bool digit = rest.size() == 1 && rest[0] >= '0' && rest[0] <= '9';
    const bool letter = rest.size() == 1 && prefix == "key" && rest[0] >= 'a' && rest[0] <= 'z';
    if (digit || letter) return std::string(rest);
  }
  std::string nearest;
  std::size_t distance = 3;
  for (const std::string_view known : kNamed) {
    const std::size_t edits = edit_distance(lower, std::string(known));
    if (edits >= distance || edits > known.size() / 2) continue;
    distance = edits;
    nearest = known;
  }
  return nearest;
}

}  // namespace

std::string key_fault(const std::string& name) {
  if (std::find(kNamed.begin(), kNamed.end(), name) != kNamed.end()) return "";
  if (const auto character = only_character(name)) {
    for (const auto& [first, last] : kWritten) {
      if (*character >= first && *character <= last) return "";
    }
  }
  if (name == ":") return "expected another key: at a terminal, ':' begins a command";
  if (name == "escape" || name == "Escape" || name == "esc" || name == "F12")
    return "expected another key: Escape and F12 are the emergency";
  constexpr std::size_t kLongest = 40;  // names of this length at most get a suggestion
  const std::string meant = name.size() > kLongest ? "" : meant_by(name);
  std::string text = "expected a key that somebody can press: ";
  for (const std::string_view known : kNamed) text += "'" + std::string(known) + "', ";
  text +=
      "or the character that a key writes without Shift, such as 'a' or '1' (also of the "
      "numeric pad)";
  return meant.empty() ? text : text + "; did you mean '" + meant + "'?";
}

std::string one_key(const std::string& name) {
  const auto character = only_character(name);
  return character && *character < 0x10000 ? utf8(lower_letter(*character)) : name;
}

std::string KeysTaken::add(const std::string& name) {
  std::string fault = key_fault(name);
  if (!fault.empty()) return fault;
  const auto [before, is_new] = names_.emplace(one_key(name), name);
  return is_new ? "" : "expected another key: this is the same as '" + before->second + "'";
}

}  // namespace palpate::protocols
