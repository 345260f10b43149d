#include "runner/study/export_settings.h"

#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "data/base/json_text.h"
#include "data/base/text.h"
#include "data/store/store.h"
#include "protocols/protocol.h"
#include "protocols/tasks/levels.h"
#include "runner/safety/fault_signals.h"

namespace palpate::runner::study {
namespace {

std::vector<data::BlockFacts> blocks_of(const nlohmann::ordered_json& protocol) {
  std::vector<data::BlockFacts> blocks;
  const auto text = [](const nlohmann::ordered_json& object, const char* key) {
    const auto found = object.find(key);
    return found != object.end() && found->is_string() ? found->get<std::string>() : "";
  };
  if (!protocol.contains("blocks") || !protocol["blocks"].is_array()) return blocks;
  for (const auto& block : protocol["blocks"]) {
    if (!block.is_object()) continue;
    data::BlockFacts& facts = blocks.emplace_back();
    facts.name = text(block, "name");
    facts.task = text(block, "task");
    if (const auto level = block.find("level"); level != block.end() && level->is_object()) {
      facts.level_path = text(*level, "path");
      if (level->contains("dimensions") && (*level)["dimensions"].is_array()) {
        for (const auto& one : (*level)["dimensions"]) {
          if (!one.is_object()) continue;
          const std::string path = text(one, "path");
          facts.dimensions.push_back({text(one, "name"), path, protocols::unit_of_level(path)});
        }
      }
    }
    if (!facts.level_path.empty()) facts.level_unit = protocols::unit_of_level(facts.level_path);
  }
  return blocks;
}

/// Pairs of "PAGE, ITEM" and its question.
std::vector<std::pair<std::string, std::string>> questions_of(const nlohmann::ordered_json& json) {
  std::vector<std::pair<std::string, std::string>> questions;
  const auto text = [](const nlohmann::ordered_json& of, const char* key) {
    return of.is_object() && of.contains(key) && of[key].is_string() ? of[key].get<std::string>()
                                                                     : std::string();
  };
  const auto list = [](const nlohmann::ordered_json& of, const char* key) {
    return of.is_object() && of.contains(key) && of[key].is_array()
               ? of[key]
               : nlohmann::ordered_json::array();
  };
  for (const auto& page : list(json, "pages")) {
    for (const auto& item : list(page, "items"))
      questions.emplace_back(text(page, "name") + ", " + text(item, "name"),
                             text(item, "question"));
  }
  return questions;
}

nlohmann::ordered_json document_of(const data::ProtocolInfo& info) {
  const std::string place = "the text of protocol " + info.name + " is damaged: expected ";
  try {
    nlohmann::ordered_json json = read_ordered_json(info.text);
    if (json.is_object()) return json;
  } catch (const JsonError& error) {
    throw data::StoreRefused(place + error.expected + ", found " + error.found);
  }
  throw data::StoreRefused(place + "an object");
}

/// Reads only what an export needs from the stored text, so that old databases can be exported
/// after the rules for protocols have changed.
data::ProtocolFacts facts_of(const data::ProtocolInfo& info) {
  const nlohmann::ordered_json json = document_of(info);
  data::ProtocolFacts facts{.servo_rate = protocols::Protocol{}.servo_rate};
  if (json.contains("title") && json["title"].is_string()) facts.title = json["title"];
  if (json.contains("servo") && json["servo"].is_object() && json["servo"].contains("rate_hz") &&
      json["servo"]["rate_hz"].is_number()) {
    facts.servo_rate = json["servo"]["rate_hz"];
  }
  if (!(facts.servo_rate > 0))
    throw data::StoreRefused("protocol " + info.name + " has no servo rate");
  facts.questions = questions_of(json);
  facts.seen = json.contains("view");
  if (!json.contains("stimuli") || !json["stimuli"].is_array()) return facts;
  for (const auto& stimulus : json["stimuli"]) {
    if (!stimulus.is_object() || !stimulus.contains("name") || !stimulus["name"].is_string())
      continue;
    facts.heard |= stimulus.contains("sound");
    nlohmann::ordered_json object = stimulus;
    object.erase("name");
    facts.stimuli.push_back({stimulus["name"], object.dump()});
  }
  facts.blocks = blocks_of(json);
  return facts;
}

std::vector<data::FaultMeaning> fault_bits() {
  std::vector<data::FaultMeaning> all;
  all.reserve(safety::kFaultTable.size());
  for (const rendering::FaultBit& fault : safety::kFaultTable) {
    all.push_back({fault.bit, std::string(fault.name) + ": " + fault.meaning});
  }
  return all;
}

}  // namespace

data::ExportSettings export_settings() {
  data::ExportSettings settings;
  settings.program_version = PALPATE_VERSION;
  settings.facts = facts_of;
  settings.fault_bits = fault_bits();
  return settings;
}

}  // namespace palpate::runner::study
