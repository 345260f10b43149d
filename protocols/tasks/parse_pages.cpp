// Reads the sounds, joysticks and response boxes of protocol version 2.

#include <algorithm>
#include <array>
#include <cstddef>
#include <set>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "data/base/input_file.h"
#include "protocols/answer_keys.h"
#include "protocols/tasks/parse_blocks.h"

namespace palpate::protocols {
namespace {

using nlohmann::json;

/// Removes a whole number from 1 to `most` from the beginning of `text`; 0: there is none.
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

/// Faults a byte given twice, as "0x41" and "A": its meaning would be ambiguous.
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
    reader.faults().add(pointer,
                        "expected an object with a key for each input" + found_text(*value));
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

constexpr std::size_t kMostPages = 100, kMostItems = 100, kMostChoices = 20;
constexpr NumberRange kPageNumber{-1e12, 1e12};
constexpr std::uintmax_t kMostPictureBytes = 8 << 20;
constexpr std::string_view kPngBegins = "\x89PNG\r\n\x1a\n";

void read_choices(ObjectReader& reader, PageItem& item) {
  const bool asks = item.kind == PageItem::Kind::choice || item.kind == PageItem::Kind::scale;
  const char* const key = item.kind == PageItem::Kind::scale ? "labels" : "choices";
  if (!asks) return;
  const json* const list = reader.array(key, 2, kMostChoices, Presence::required);
  if (list == nullptr) return;
  for (std::size_t i = 0; i < list->size(); ++i) {
    const json& value = (*list)[i];
    const std::string text = value.is_string() ? value.get<std::string>() : "";
    const std::string pointer = child_pointer(reader.pointer(key), i);
    if (text.empty()) {
      reader.faults().add(pointer, "expected a text that is not empty" + found_text(value));
    } else if (std::find(item.choices.begin(), item.choices.end(), text) != item.choices.end()) {
      reader.faults().add(pointer, "expected a unique text, found '" + text + "' again");
    }
    item.choices.push_back(text);
  }
  item.shown = item.choices;
}

/// As BIDS names columns of participants.tsv; two are the program's own.
void read_column(ObjectReader& reader, PageItem& item) {
  constexpr std::size_t kLongest = 32;
  reader.text("column", item.column);
  const json* const value = reader.member("column", Presence::optional);
  if (value == nullptr || !value->is_string()) return;
  const std::string& name = item.column;
  const bool fits = !name.empty() && name.size() <= kLongest && name[0] >= 'a' && name[0] <= 'z' &&
                    std::ranges::all_of(name, [](char c) {
                      return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || c == '_';
                    });
  if (!fits || name == "participant_id" || name == "simulated")
    reader.faults().add(reader.pointer("column"),
                        "expected a name of 1 to 32 of a to z, 0 to 9 and _, a letter first, such "
                        "as 'age', 'sex' or 'handedness'; not participant_id or simulated" +
                            found_text(*value));
}

PageItem read_item(ObjectReader& reader) {
  PageItem item;
  reader.name("name", item.name);
  reader.text("question", item.question);
  reader.member("question", Presence::required);
  reader.choice("kind", item.kind,
                {{"text", PageItem::Kind::text},
                 {"number", PageItem::Kind::number},
                 {"choice", PageItem::Kind::choice},
                 {"scale", PageItem::Kind::scale}},
                Presence::required);
  if (item.kind == PageItem::Kind::number) {
    reader.number("min", item.least, kPageNumber);
    reader.number("max", item.most, kPageNumber);
    if (item.least && item.most && *item.least > *item.most)
      reader.faults().add(reader.pointer("max"), "expected at least min");
  }
  read_choices(reader, item);
  reader.boolean("required", item.required);
  read_column(reader, item);
  reader.refuse_unknown_keys();
  return item;
}

void read_items(ObjectReader& reader, PageSpec& page) {
  const json* const list = reader.array("items", 1, kMostItems, Presence::required);
  if (list == nullptr) return;
  std::set<std::string> names;
  for (std::size_t i = 0; i < list->size(); ++i) {
    ObjectReader item((*list)[i], child_pointer(reader.pointer("items"), i), reader.faults());
    page.items.push_back(read_item(item));
    const std::string& name = page.items.back().name;
    if (!name.empty() && !names.insert(name).second) {
      reader.faults().add(item.pointer("name"),
                          "expected a unique name, found '" + name + "' again");
    }
  }
}

void read_place(ObjectReader& reader, const Protocol& protocol, PageSpec& page) {
  reader.choice("when", page.when,
                {{"before", PageSpec::When::before},
                 {"between", PageSpec::When::between},
                 {"after", PageSpec::When::after}});
  if (page.when != PageSpec::When::between) return;
  reader.text("block", page.before_block);
  const json* const value = reader.member("block", Presence::required);
  const bool known = std::any_of(protocol.blocks.begin(), protocol.blocks.end(),
                                 [&](const TaskBlock& b) { return b.name == page.before_block; });
  if (value != nullptr && !known) {
    reader.faults().add(reader.pointer("block"),
                        "expected the name of the block that it comes before" + found_text(*value));
  }
}

/// The big-endian number at `at`.
std::uint64_t number_in(const std::string& bytes, std::size_t at) {
  std::uint64_t number = 0;
  for (std::size_t i = 0; i < 4; ++i)
    number = number << 8U | static_cast<unsigned char>(bytes[at + i]);
  return number;
}

/// The reason why a file that begins as PNG cannot be shown: its chunks (length, kind, data,
/// checksum) do not lead to IEND, or it needs too much memory. Empty: it can.
std::string png_fault(const std::string& bytes) {
  constexpr std::uint64_t kMostPixels = 32'000'000;
  // Bytes: a chunk without its data; the file's header.
  constexpr std::size_t kFrame = 12, kHeader = 8;
  std::size_t at = kPngBegins.size();
  for (bool first = true; bytes.size() - at >= kFrame; first = false) {
    const std::uint64_t length = number_in(bytes, at);
    const std::string kind = bytes.substr(at + 4, 4);
    if (length > bytes.size() - at - kFrame || first != (kind == "IHDR")) break;
    if (kind == "IEND") return "";
    if (first) {
      if (length < kHeader) break;
      const std::uint64_t wide = number_in(bytes, at + 8), high = number_in(bytes, at + 12);
      if (wide * high == 0) break;
      if (wide * high > kMostPixels)
        return "has " + std::to_string(wide) + " x " + std::to_string(high) +
               " pixels; at most 32 million are possible";
    }
    at += kFrame + length;
  }
  return "is damaged or cut off";
}

/// The picture's bytes; null and a fault if it is not a picture.
std::shared_ptr<const std::string> read_picture(const std::string& name, const std::string& pointer,
                                                const MeshFiles& files, FaultList& faults) {
  std::string bytes;
  if (const auto stored = files.stored.find(name); stored != files.stored.end()) {
    bytes = stored->second;
  } else if (files.others == OtherFiles::refuse) {
    faults.add(pointer, "expected a file that is stored with the protocol; '" + name + "' is not");
    return nullptr;
  } else {
    const std::string path = files.folder.empty() ? name : files.folder + "/" + name;
    try {
      bytes = read_whole(path, kMostPictureBytes);
    } catch (const std::runtime_error& error) {
      faults.add(pointer, "expected a PNG file of at most 8 MiB; " + path + ": " + error.what());
      return nullptr;
    }
  }
  if (!bytes.starts_with(kPngBegins)) {
    faults.add(pointer, "expected a PNG file; '" + name + "' is not one");
    return nullptr;
  }
  // Do not refuse pictures that are already on record.
  const std::string fault = files.stored.contains(name) ? "" : png_fault(bytes);
  if (!fault.empty()) {
    faults.add(pointer, "expected a PNG file; '" + name + "' " + fault);
    return nullptr;
  }
  return std::make_shared<const std::string>(std::move(bytes));
}

void read_pictures(ObjectReader& reader, const MeshFiles& files, PageSpec& page) {
  const auto screens =
      1 + static_cast<std::size_t>(std::count(page.text.begin(), page.text.end(), '\f'));
  const json* const list = reader.array("pictures", 1, kMostPages);
  if (list == nullptr) return;
  if (list->size() > screens) {
    reader.faults().add(reader.pointer("pictures"),
                        "expected at most " + std::to_string(screens) +
                            ", one picture for each screen of the text");
  }
  for (std::size_t i = 0; i < list->size(); ++i) {
    const json& value = (*list)[i];
    const std::string pointer = child_pointer(reader.pointer("pictures"), i);
    PagePicture& picture = page.pictures.emplace_back();
    if (value.is_null()) continue;
    if (!value.is_string() || value.get_ref<const std::string&>().empty()) {
      reader.faults().add(pointer, "expected the name of a PNG file, or null" + found_text(value));
      continue;
    }
    picture.file = value.get<std::string>();
    picture.bytes = read_picture(picture.file, pointer, files, reader.faults());
  }
}

PageSpec read_page(ObjectReader& reader, const Protocol& protocol, const MeshFiles& files) {
  PageSpec page;
  reader.name("name", page.name);
  reader.choice("kind", page.kind,
                {{"instructions", PageSpec::Kind::instructions},
                 {"consent", PageSpec::Kind::consent},
                 {"questionnaire", PageSpec::Kind::questionnaire}},
                Presence::required);
  read_place(reader, protocol, page);
  reader.text("text", page.text);
  if (page.kind != PageSpec::Kind::questionnaire) reader.member("text", Presence::required);
  if (page.kind == PageSpec::Kind::consent) {
    reader.text("consent_version", page.version);
    reader.member("consent_version", Presence::required);
    if (page.when != PageSpec::When::before) {
      reader.faults().add(reader.pointer("when"),
                          "expected 'before': consent is asked before the first trial");
    }
  }
  if (page.kind == PageSpec::Kind::questionnaire) read_items(reader, page);
  if (page.kind == PageSpec::Kind::instructions) read_pictures(reader, files, page);
  reader.refuse_unknown_keys();
  return page;
}

/// Each column is filled by one question.
void refuse_repeated_columns(ObjectReader& reader, const Protocol& protocol) {
  std::set<std::string> columns;
  for (std::size_t p = 0; p < protocol.pages.size(); ++p) {
    for (std::size_t i = 0; i < protocol.pages[p].items.size(); ++i) {
      const std::string& column = protocol.pages[p].items[i].column;
      if (column.empty() || columns.insert(column).second) continue;
      const std::string page = child_pointer(reader.pointer("pages"), p);
      reader.faults().add(child_pointer(page + "/items", i) + "/column",
                          "expected a column of its own, found '" + column + "' again");
    }
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
    section.choice("lag", sounds.lag_accepted, {{"limited", false}, {"accepted", true}});
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

void read_pages(ObjectReader& reader, Protocol& protocol, const MeshFiles& files) {
  const json* const list = reader.array("pages", 0, kMostPages);
  if (list == nullptr) return;
  std::set<std::string> names;
  for (std::size_t i = 0; i < list->size(); ++i) {
    ObjectReader item((*list)[i], child_pointer(reader.pointer("pages"), i), reader.faults());
    protocol.pages.push_back(read_page(item, protocol, files));
    const std::string& name = protocol.pages.back().name;
    if (!name.empty() && !names.insert(name).second) {
      reader.faults().add(item.pointer("name"),
                          "expected a unique name, found '" + name + "' again");
    }
  }
  refuse_repeated_columns(reader, protocol);
}

}  // namespace palpate::protocols
