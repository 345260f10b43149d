#include "protocols/event_codes.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "protocols/json_document.h"
#include "protocols/object_reader.h"

namespace palpate::protocols {
namespace {

constexpr NumberRange kCode{1, 255};  // 0: the rest between two pulses

/// "response:" and each answer that somebody may give, in the order of their keys.
std::vector<std::string> answer_events(const Protocol& protocol) {
  std::vector<std::string> names;
  const auto add = [&names](const std::string& answer) {
    const std::string name = "response:" + answer;
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  };
  for (const auto& [key, stimulus] : protocol.response.keys) add(stimulus);
  for (const TaskBlock& block : protocol.blocks) {
    if (block.task == TaskKind::adjust) continue;  // its keys change the level
    for (const TaskAnswer& answer : block.answers) add(answer.name);
  }
  return names;
}

/// Two events with one code would be indistinguishable in a recording.
void refuse_equal_codes(const EventCodes& given, const EventCodes& all, const std::string& pointer,
                        FaultList& faults) {
  for (const auto& [name, code] : given) {
    for (const auto& [other, same] : all) {
      // Report a pair once, at the later name.
      if (same != code || other == name || (given.contains(other) && other > name)) continue;
      faults.add(child_pointer(pointer, name),
                 "expected a unique code; " + std::to_string(code) + " is that of '" + other + "'");
      break;
    }
  }
}

}  // namespace

EventCodes usual_event_codes() {
  return {{"trial_start", 1}, {"first_contact", 2}, {"response", 3}, {"time_out", 4},
          {"cut_off", 5},     {"interval", 6},      {"sync", 128}};
}

EventCodes read_event_codes(ObjectReader& reader, const Protocol& protocol) {
  EventCodes codes = usual_event_codes();
  const nlohmann::json* const value = reader.member("codes");
  if (value == nullptr) return codes;
  const std::string pointer = reader.pointer("codes");
  ObjectReader table(*value, pointer, reader.faults());
  if (!value->is_object()) return codes;
  std::vector<std::string> names;
  for (const auto& [name, code] : codes) names.push_back(name);
  for (std::string& name : answer_events(protocol)) names.push_back(std::move(name));
  EventCodes given;
  for (const auto& [name, code] : value->items()) {
    if (std::find(names.begin(), names.end(), name) == names.end()) {
      std::string words;
      for (const std::string& known : names) words += (words.empty() ? "'" : ", '") + known + "'";
      reader.faults().add(child_pointer(pointer, name), "unknown event; expected one of " + words);
      continue;
    }
    int number = 0;
    table.integer(name.c_str(), number, kCode);
    if (number != 0) codes[name] = given[name] = number;
  }
  refuse_equal_codes(given, codes, pointer, reader.faults());
  return codes;
}

EventCodes event_codes(const Protocol& protocol) {
  FaultList faults(protocol.name);
  const nlohmann::json root = read_json(protocol.source_text, faults);
  ObjectReader reader(root, "", faults);
  return read_event_codes(reader, protocol);
}

}  // namespace palpate::protocols
