// Reading of what version 2 of a protocol says of sounds, joysticks and response boxes.

#include <algorithm>
#include <array>
#include <string_view>

#include "protocols/answer_keys.h"
#include "protocols/tasks/parse_blocks.h"

namespace palpate::protocols {
namespace {

using nlohmann::json;

/// A whole number from 1 to `most` at the begin of `text`, which goes on behind it; 0: none.
int number_at(std::string_view& text, int most) {
  int number = 0;
  std::size_t digits = 0;
  while (digits < text.size() && digits < 3 && text[digits] >= '0' && text[digits] <= '9')
    number = 10 * number + (text[digits++] - '0');
  if (digits == 0 || text.front() == '0' || number > most) return 0;
  text.remove_prefix(digits);
  return number;
}

bool is_joystick_input(std::string_view name) {
  const auto begins = [&name](std::string_view word) {
    if (!name.starts_with(word)) return false;
    name.remove_prefix(word.size());
    return true;
  };
  if (begins("button ")) return number_at(name, 64) > 0 && name.empty();
  if (begins("axis ")) return number_at(name, 16) > 0 && (name == " +" || name == " -");
  constexpr std::array<std::string_view, 4> kSides = {" up", " down", " left", " right"};
  return begins("hat ") && number_at(name, 8) > 0 &&
         std::find(kSides.begin(), kSides.end(), name) != kSides.end();
}

/// A printable character, or a byte as "0x00" to "0xff".
bool is_box_byte(std::string_view name) {
  if (name.size() == 1) return name[0] > ' ' && name[0] < '\x7f';
  const auto hexadecimal = [](char c) {
    return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f') || (c >= 'A' && c <= 'F');
  };
  return name.size() == 4 && name.starts_with("0x") && hexadecimal(name[2]) && hexadecimal(name[3]);
}

/// "0x41" and "A" are one byte, of which nobody could say what it stands for.
void check_bytes(ObjectReader& reader, const std::map<std::string, std::string>& box) {
  std::map<int, std::string> seen;
  for (const auto& [name, key] : box) {
    if (!is_box_byte(name)) continue;
    const int byte = name.size() == 1 ? name[0] : std::stoi(name, nullptr, 16);
    const auto [first, is_new] = seen.emplace(byte, name);
    if (!is_new)
      reader.faults().add(child_pointer(reader.pointer("box"), name),
                          "is the same byte as '" + first->second + "'");
  }
}

void read_mapping(ObjectReader& reader, const char* key, std::map<std::string, std::string>& out,
                  bool (*is_input)(std::string_view), const std::string& expected) {
  const json* const value = reader.member(key);
  if (value == nullptr) return;
  const std::string pointer = reader.pointer(key);
  if (!value->is_object() || value->empty()) {
    reader.faults().add(pointer, "expected an object of a key for each input" + found_text(*value));
    return;
  }
  for (const auto& [input, meaning] : value->items()) {
    const std::string here = child_pointer(pointer, input);
    if (!is_input(input)) reader.faults().add(here, expected);
    if (!meaning.is_string()) {
      reader.faults().add(here,
                          "expected the name of the key that it stands for, such as '1', "
                          "'space' or 'escape' (emergency)" +
                              found_text(meaning));
      continue;
    }
    const auto name = meaning.get<std::string>();
    const std::string fault = name == "escape" ? "" : key_fault(name);
    if (!fault.empty()) {
      reader.faults().add(here, fault + found_text(meaning));
      continue;
    }
    out[input] = name;
  }
}

}  // namespace

void read_periphery(ObjectReader& reader, Protocol& protocol) {
  reader.section("sounds", [&](ObjectReader& section) {
    Sounds& sounds = protocol.sounds.emplace();
    section.boolean("ready", sounds.ready);
    section.boolean("go", sounds.go);
    section.boolean("feedback", sounds.feedback);
    section.number("level_db", sounds.level_db, {-80, -12, "dB"});
  });
  reader.section("responses", [&](ObjectReader& section) {
    read_mapping(section, "joystick", protocol.responses.joystick, is_joystick_input,
                 "expected 'button N', 'axis N +', 'axis N -' or 'hat N up', 'down', 'left', "
                 "'right', N from 1");
    read_mapping(section, "box", protocol.responses.box, is_box_byte,
                 "expected a printable character, or a byte as '0x00' to '0xff'");
    check_bytes(section, protocol.responses.box);
  });
}

}  // namespace palpate::protocols
