#include "protocols/parse_response.h"

#include <algorithm>
#include <cstddef>
#include <map>
#include <optional>
#include <string>

#include "protocols/answer_keys.h"

namespace palpate::protocols {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxLabel = 80;  // bytes of a label

/// The stimulus that a key stands for: its name, or an object of name and label. Not a string, and
/// a fault, otherwise.
json read_answer(const json& value, const std::string& pointer, std::string& label,
                 FaultList& faults) {
  if (!value.is_object()) return value;
  ObjectReader answer(value, pointer, faults);
  const json* const stimulus = answer.member("stimulus", Presence::required);
  const json* const words = answer.member("label");
  answer.refuse_unknown_keys();
  if (words != nullptr) {
    const auto printable = [](unsigned char c) { return c >= 0x20 && c != 0x7f; };
    label = words->is_string() ? words->get<std::string>() : "";
    if (label.empty() || label.size() > kMaxLabel ||
        !std::all_of(label.begin(), label.end(), printable)) {
      faults.add(answer.pointer("label"), "expected a text of 1 to " + std::to_string(kMaxLabel) +
                                              " bytes without control characters" +
                                              found_text(*words));
      label.clear();
    }
  }
  return stimulus != nullptr ? *stimulus : json();
}

/// Labels must differ: two responses that read the same cannot be told apart.
void check_labels(const Protocol& protocol, const std::string& pointer, FaultList& faults) {
  std::map<std::string, std::string> key_of;  // by what is read
  for (const auto& [key, stimulus] : protocol.response.keys) {
    const std::string& label = answer_label(protocol, stimulus);
    const auto [before, is_new] = key_of.emplace(label, key);
    if (is_new || protocol.response.keys.at(before->second) == stimulus) continue;
    faults.add(child_pointer(pointer, key), "expected a label of its own; '" + label +
                                                "' is what the key '" + before->second +
                                                "' says already");
  }
}

}  // namespace

void read_response_keys(ObjectReader& response, Protocol& protocol) {
  const json* const keys = response.member("keys", Presence::required);
  if (keys == nullptr) return;
  FaultList& faults = response.faults();
  const std::string pointer = response.pointer("keys");
  if (!keys->is_object()) {
    faults.add(pointer, "expected an object of a stimulus for each key" + found_text(*keys));
    return;
  }
  std::map<std::string, std::optional<std::string>> key_of;  // by stimulus
  for (const StimulusSpec& stimulus : protocol.stimuli) key_of[stimulus.name];
  KeysTaken taken;
  for (const auto& [key, value] : keys->items()) {
    const std::string here = child_pointer(pointer, key);
    if (const std::string fault = taken.add(key); !fault.empty()) faults.add(here, fault);
    std::string label;
    const json name = read_answer(value, here, label, faults);
    const auto stimulus = name.is_string() ? key_of.find(name.get<std::string>()) : key_of.end();
    if (stimulus == key_of.end()) {
      if (!value.is_object()) {
        faults.add(here, "expected the name of a stimulus, or an object of 'stimulus' and 'label'" +
                             found_text(value));
      } else if (value.contains("stimulus")) {
        faults.add(child_pointer(here, "stimulus"),
                   "expected the name of a stimulus" + found_text(name));
      }
      continue;
    }
    if (stimulus->second) {
      faults.add(here, "expected one key for each stimulus; '" + stimulus->first +
                           "' has the key '" + *stimulus->second + "' already");
    }
    stimulus->second = key;
    protocol.response.keys[key] = stimulus->first;
    if (!label.empty()) protocol.response.labels[stimulus->first] = label;
  }
  check_labels(protocol, pointer, faults);
  for (const auto& [name, key] : key_of) {
    if (!key && !name.empty()) faults.add(pointer, "no key for the stimulus '" + name + "'");
  }
}

}  // namespace palpate::protocols
