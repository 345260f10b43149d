#include "protocols/difference.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <set>
#include <string_view>

#include "protocols/fault_list.h"
#include "protocols/json_document.h"

namespace palpate::protocols {
namespace {

using nlohmann::json;

constexpr std::array<std::string_view, 4> kTexts = {"$schema", "title", "description", "texts"};
constexpr std::array<std::string_view, 15> kDesign = {
    "renderers",   "renderer_order",   "stimuli",  "repetitions", "order", "blocks_per_renderer",
    "orientation", "practice",         "sessions", "material",    "tool",  "reach",
    "seed",        "gravity_m_per_s2", "torque"};

template <std::size_t n>
bool is_in(const std::array<std::string_view, n>& names, const std::string& name) {
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// Adds the deepest pointers at which the two differ.
void compare(const json* before, const json* after, const std::string& pointer,
             std::vector<std::string>& out) {
  if (before == nullptr || after == nullptr || before->type() != after->type() ||
      !before->is_structured()) {
    if (before == nullptr || after == nullptr || *before != *after) out.push_back(pointer);
    return;
  }
  if (before->is_array()) {
    for (std::size_t i = 0; i < std::max(before->size(), after->size()); ++i) {
      compare(i < before->size() ? &(*before)[i] : nullptr,
              i < after->size() ? &(*after)[i] : nullptr, child_pointer(pointer, i), out);
    }
    return;
  }
  std::set<std::string> keys;
  for (const auto& one : before->items()) keys.insert(one.key());
  for (const auto& one : after->items()) keys.insert(one.key());
  for (const std::string& key : keys) {
    const auto a = before->find(key), b = after->find(key);
    compare(a != before->end() ? &*a : nullptr, b != after->end() ? &*b : nullptr,
            child_pointer(pointer, key), out);
  }
}

/// A key's answer may be a stimulus, or a stimulus with a label: write both alike, so that a label
/// compares as a text.
json with_answers_alike(json protocol) {
  const auto response = protocol.find("response");
  if (response == protocol.end() || !response->is_object()) return protocol;
  const auto keys = response->find("keys");
  if (keys == response->end() || !keys->is_object()) return protocol;
  for (json& answer : *keys) {
    if (answer.is_string()) answer = {{"stimulus", answer}};
  }
  return protocol;
}

bool is_label(const std::string& pointer) {
  return pointer.starts_with("/response/keys/") && pointer.ends_with("/label");
}

std::string listed_pointers(const std::vector<std::string>& pointers) {
  constexpr std::size_t kShown = 8;
  std::string words;
  for (std::size_t i = 0; i < std::min(kShown, pointers.size()); ++i)
    words += (i > 0 ? ", " : "") + pointers[i];
  if (pointers.size() > kShown)
    words += " and " + std::to_string(pointers.size() - kShown) + " more";
  return words;
}

}  // namespace

ProtocolDifference difference(const std::string& before, const std::string& after) {
  FaultList none("");
  const json a = with_answers_alike(read_json(before, none));
  const json b = with_answers_alike(read_json(after, none));
  std::vector<std::string> all;
  compare(&a, &b, "", all);
  ProtocolDifference difference;
  for (const std::string& pointer : all) {
    const std::size_t end = std::min(pointer.find('/', 1), pointer.size());
    const std::string key = pointer.empty() ? "" : pointer.substr(1, end - 1);
    auto& kind = is_in(kTexts, key) || is_label(pointer) ? difference.texts
                 : is_in(kDesign, key)                   ? difference.design
                                                         : difference.settings;
    kind.push_back(pointer);
  }
  return difference;
}

std::string in_words(const ProtocolDifference& difference) {
  if (difference.nothing()) return "only its layout";
  std::string words;
  const auto add = [&words](const char* kind, const std::vector<std::string>& pointers) {
    if (pointers.empty()) return;
    words += (words.empty() ? "" : "; ") + std::string(kind) + ": " + listed_pointers(pointers);
  };
  add("stimuli and order", difference.design);
  add("other settings", difference.settings);
  add(difference.only_texts() ? "only texts" : "texts", difference.texts);
  return words;
}

}  // namespace palpate::protocols
