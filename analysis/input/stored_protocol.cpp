#include "analysis/input/stored_protocol.h"

#include <nlohmann/json.hpp>

#include "data/base/json_text.h"

namespace palpate::analysis {

StoredProtocol read_stored_protocol(const std::string& text) {
  StoredProtocol out;
  const auto json = json_or_discarded(text);
  if (!json.is_object()) return out;
  const auto read_text = [](const nlohmann::json& from, const char* key, std::string& to) {
    if (const auto found = from.find(key); found != from.end() && found->is_string()) to = *found;
  };
  read_text(json, "name", out.name);
  read_text(json, "title", out.title);
  if (const auto version = json.find("version"); version != json.end() && *version == 2)
    out.version = 2;
  if (const auto seed = json.find("seed"); seed != json.end() && seed->is_number_integer())
    out.seed = seed->dump();
  if (const auto n = json.find("repetitions"); n != json.end() && n->is_number())
    out.repetitions = *n;
  const auto stimuli = json.find("stimuli");
  if (stimuli == json.end() || !stimuli->is_array()) return out;
  for (const auto& stimulus : *stimuli) {
    std::string name;
    if (stimulus.is_object()) read_text(stimulus, "name", name);
    if (!name.empty()) out.stimuli.push_back(name);
  }
  return out;
}

}  // namespace palpate::analysis
