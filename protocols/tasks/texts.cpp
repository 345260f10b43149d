#include "protocols/tasks/texts.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <memory>
#include <set>
#include <system_error>

#include "data/base/cell_name.h"
#include "protocols/json_document.h"
#include "protocols/object_reader.h"

namespace palpate::protocols {
namespace {

using nlohmann::json;

constexpr std::size_t kLongestLabel = 80;  // bytes

/// A text of the protocol; a label is shown below a key, in one line.
struct TextPlace {
  std::string key;
  std::vector<std::string*> copies;  ///< equal; several where a block is shown in parts
  bool label = false;

  const std::string& text() const { return *copies.front(); }
};

/// "surface=wet,size=large": the levels of a block that is one cell; "": of any other.
std::string cell_of(const Protocol& protocol, const TaskBlock& block) {
  if (!block.cell || block.stimuli.empty()) return "";
  const auto& stimulus = protocol.stimuli[static_cast<std::size_t>(block.stimuli.front())];
  std::string levels;
  for (const auto& [factor, level] : cell_name(stimulus.name).levels)
    levels += (levels.empty() ? "" : ",") + factor + "=" + level;
  return levels;
}

bool is_reaching(const TaskBlock& block) { return block.reaching.has_value(); }

class TextPlaces {
 public:
  explicit TextPlaces(Protocol& protocol) {
    add_texts(protocol.texts);
    add_labels(protocol);
    add_task_texts(protocol.texts);
    if (std::ranges::any_of(protocol.blocks, is_reaching))
      add("texts.go_home", protocol.texts.go_home);
    for (TaskBlock& block : protocol.blocks) add_block(protocol, block);
    for (PageSpec& page : protocol.pages) add_page(page);
  }
  std::vector<TextPlace> take() { return std::move(places_); }

 private:
  void add(const std::string& key, std::string& text, bool label = false) {
    if (!text.empty()) places_.push_back({key, {&text}, label});
  }
  void add_texts(Protocol::Texts& texts) {
    add("texts.instructions", texts.instructions);
    add("texts.practice", texts.practice);
    add("texts.break", texts.break_text);
    add("texts.end", texts.end);
    add("texts.move_away", texts.move_away);
    add("texts.ready", texts.ready);
    add("texts.go", texts.go);
    add("texts.wait", texts.wait);
    add("texts.other_key", texts.other_key);
  }
  void add_task_texts(Protocol::Texts& texts) {
    add("texts.next_interval", texts.next_interval);
    add("texts.answer_now", texts.answer_now);
    add("texts.type_number", texts.type_number);
    add("texts.agree", texts.agree, true);
    add("texts.disagree", texts.disagree, true);
    add("texts.other_number", texts.other_number);
    add("texts.answer_first", texts.answer_first);
  }
  void add_labels(Protocol& protocol) {
    for (const auto& [key, stimulus] : protocol.response.keys) {
      std::string& label = protocol.response.labels[stimulus];
      if (label.empty()) label = stimulus;
      add("response.keys." + stimulus, label, true);
    }
  }
  /// Adds a text that the cells of a block share, or one that a cell has of its own.
  void add_in_cell(const std::string& head, const std::string& cell, const std::string& rest,
                   std::string& text, bool label = false) {
    const auto known = std::ranges::find(places_, head + rest, &TextPlace::key);
    if (known == places_.end()) {
      add(head + rest, text, label);
    } else if (known->text() == text) {
      known->copies.push_back(&text);
    } else {
      add(head + cell + "." + rest, text, label);
    }
  }
  void add_block(const Protocol& protocol, TaskBlock& block) {
    const std::string head = "blocks." + block.name + ".", cell = cell_of(protocol, block);
    const auto add_own = [&](const std::string& rest, std::string& text, bool label = false) {
      add_in_cell(head, cell, rest, text, label);
    };
    add_own("instructions", block.instructions);
    add_own("question", block.question);
    const char* const kind = block.task == TaskKind::rate ? "scale." : "keys.";
    if (!block.reaching) {
      for (TaskAnswer& answer : block.answers) add_own(kind + answer.name, answer.label, true);
    }
    if (!block.confidence) return;
    add_own("confidence.question", block.confidence->question);
    std::size_t step = 0;
    for (ScaleStep& one : block.confidence->scale)
      add_own("confidence.scale." + std::to_string(++step), one.label, true);
  }
  void add_page(PageSpec& page) {
    const std::string head = "pages." + page.name + ".";
    add(head + "text", page.text);
    for (PageItem& item : page.items) {
      const std::string place = head + "items." + item.name + ".";
      add(place + "question", item.question);
      for (std::size_t i = 0; i < item.shown.size(); ++i)
        add(place + "choices." + std::to_string(i + 1), item.shown[i]);
    }
  }

  std::vector<TextPlace> places_;
};

bool is_one_line(const std::string& text) {
  return text.size() <= kLongestLabel && std::all_of(text.begin(), text.end(), [](unsigned char c) {
           return c >= 0x20 && c != 0x7f;
         });
}

/// The part of a key before its last dot, which answers of one question share.
std::string group_of(const std::string& key) { return key.substr(0, key.rfind('.')); }

void check_translation(const TextPlace& place, const json& value, FaultList& faults) {
  const std::string pointer = child_pointer("", place.key);
  if (!value.is_string() || value.get_ref<const std::string&>().empty()) {
    faults.add(pointer, "expected the translation of '" + place.text().substr(0, 60) + "'" +
                            found_text(value));
  } else if (place.label && !is_one_line(value.get_ref<const std::string&>())) {
    faults.add(pointer,
               "expected a text of 1 to 80 bytes without control characters" + found_text(value));
  }
}

/// The program's own texts that a participant may read.
struct TextsRead {
  explicit TextsRead(const Protocol& protocol) {
    for (const TaskBlock& block : protocol.blocks) {
      go |= !block.announced;
      intervals |=
          block.task == TaskKind::compare || (block.task == TaskKind::rate && block.standard);
      no_question |= block.announced && block.question.empty() && !block.reaching;
      numbers |= block.task == TaskKind::rate && block.answers.empty();
    }
    for (const PageSpec& page : protocol.pages) {
      consent |= page.kind == PageSpec::Kind::consent;
      for (const PageItem& item : page.items) {
        numbers_of_pages |= item.kind == PageItem::Kind::number;
        typed |= item.kind == PageItem::Kind::number || item.kind == PageItem::Kind::text;
      }
    }
    typed |= numbers;
  }
  bool of(const std::string& key) const {
    if (key == "texts.go") return go;  // else the question replaces it
    if (key == "texts.next_interval") return intervals;
    if (key == "texts.answer_now") return no_question;
    if (key == "texts.type_number") return numbers;
    if (key == "texts.other_number") return numbers || numbers_of_pages;
    if (key == "texts.answer_first") return typed;
    return key == "texts.agree" || key == "texts.disagree" ? consent : true;
  }

  bool go = false, intervals = false, no_question = false, numbers = false,
       numbers_of_pages = false, typed = false, consent = false;
};

/// Whether an answer's name is a word of the program, not of the protocol.
bool is_built_in_answer(const TaskBlock& block, const TaskAnswer& answer) {
  if (block.task == TaskKind::identify || block.task == TaskKind::rate) return false;
  return answer.label == answer.name && answer.name.size() > 1;  // 1, 2 and 3 fit any language
}

/// Every text of the protocol needs a valid translation.
void check_translations(const Protocol& protocol, const json& given, FaultList& faults) {
  Protocol copy = protocol;
  std::set<std::pair<std::string, std::string>> labels;
  for (const TextPlace& place : TextPlaces(copy).take()) {
    const auto value = given.find(place.key);
    if (value == given.end()) {
      faults.add(child_pointer("", place.key),
                 "expected the translation of '" + place.text().substr(0, 60) + "': it is missing");
      continue;
    }
    check_translation(place, *value, faults);
    if (place.label && value->is_string() &&
        !labels.emplace(group_of(place.key), value->get<std::string>()).second) {
      faults.add(child_pointer("", place.key),
                 "expected a unique label, found '" + value->get<std::string>() + "' again");
    }
  }
}

void put_translations(Protocol& protocol, const std::string& language, const std::string& text,
                      const json& given) {
  for (const TextPlace& place : TextPlaces(protocol).take())
    for (std::string* copy : place.copies) *copy = given[place.key].get<std::string>();
  protocol.language = language;
  protocol.translation = text;
}

}  // namespace

std::vector<std::pair<std::string, std::string>> texts_of(const Protocol& protocol) {
  Protocol copy = protocol;
  std::vector<std::pair<std::string, std::string>> texts;
  for (const TextPlace& place : TextPlaces(copy).take())
    texts.emplace_back(place.key, place.text());
  return texts;
}

std::string texts_json(const Protocol& protocol) {
  nlohmann::ordered_json all;
  for (const auto& [key, text] : texts_of(protocol)) all[key] = text;
  // A group's own texts; where it has another one, the translation is for both.
  for (const auto& group : protocol.group_protocols) {
    for (const auto& [key, text] : texts_of(*group)) {
      if (!all.contains(key)) all[key] = text;
    }
  }
  return all.dump(1, ' ', false, json::error_handler_t::replace) + "\n";
}

std::vector<std::string> built_in_texts(const Protocol& protocol) {
  std::vector<std::string> found;
  if (!protocol.language.empty()) return found;
  const auto own_words = texts_of(Protocol());
  const std::map<std::string, std::string> built_in(own_words.begin(), own_words.end());
  std::set<std::string> answers;
  for (const TaskBlock& block : protocol.blocks) {
    for (const TaskAnswer& answer : block.answers) {
      if (is_built_in_answer(block, answer))
        answers.insert("blocks." + block.name + ".keys." + answer.name);
    }
  }
  const TextsRead read(protocol);
  bool has_words = false;
  for (const auto& [key, text] : texts_of(protocol)) {
    const auto same = built_in.find(key);
    const bool is_built_in =
        answers.contains(key) || (same != built_in.end() && same->second == text);
    if (is_built_in && read.of(key)) found.push_back(key);
    // An answer without a label is the name of a stimulus, in any language.
    has_words |= !is_built_in && text.size() > 1 && text != key.substr(key.rfind('.') + 1);
  }
  return has_words ? found : std::vector<std::string>();
}

void translate(Protocol& protocol, const std::string& language, const std::string& text,
               const std::string& file_name) {
  FaultList faults(file_name);
  const json given = read_json(text, faults);
  if (!given.is_object()) faults.add("", "expected an object of texts" + found_text(given));
  faults.throw_if_any();
  check_translations(protocol, given, faults);
  std::set<std::string> known;
  for (const auto& [key, words] : texts_of(protocol)) known.insert(key);
  for (const auto& group : protocol.group_protocols) {
    if (faults.empty()) check_translations(*group, given, faults);
    for (const auto& [key, words] : texts_of(*group)) known.insert(key);
  }
  for (const auto& [key, value] : given.items()) {
    if (!known.contains(key) && key != "$schema")
      faults.add(child_pointer("", key), "expected no such key: the protocol has no text there");
  }
  faults.throw_if_any();
  put_translations(protocol, language, text, given);
  for (auto& group : protocol.group_protocols) {
    auto translated = std::make_shared<Protocol>(*group);
    put_translations(*translated, language, text, given);
    group = std::move(translated);
  }
}

void translate(Protocol& protocol, const std::string& protocol_path, const std::string& language) {
  namespace fs = std::filesystem;
  const fs::path path(protocol_path);
  const fs::path own = path.parent_path() / (path.stem().string() + ".texts." + language + ".json");
  const fs::path common = path.parent_path() / ("texts." + language + ".json");
  std::error_code error;
  const fs::path& chosen = fs::exists(own, error) || !fs::exists(common, error) ? own : common;
  translate(protocol, language, read_text_file(chosen.string()), chosen.string());
}

}  // namespace palpate::protocols
