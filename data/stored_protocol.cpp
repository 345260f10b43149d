#include "data/stored_protocol.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <utility>

#include "data/base/json_text.h"

namespace palpate::data {
namespace {

void read_text(const nlohmann::json& from, const char* key, std::string& to) {
  if (!from.is_object()) return;
  if (const auto found = from.find(key); found != from.end() && found->is_string()) to = *found;
}

const nlohmann::json& list_of(const nlohmann::json& from, const char* key) {
  static const nlohmann::json kNone = nlohmann::json::array();
  if (!from.is_object()) return kNone;
  const auto found = from.find(key);
  return found != from.end() && found->is_array() ? *found : kNone;
}

void read_texts(const nlohmann::json& from, const char* key, std::vector<std::string>& to) {
  for (const auto& one : list_of(from, key)) {
    if (one.is_string()) to.push_back(one);
  }
}

StoredBlock read_block(const nlohmann::json& json) {
  StoredBlock block;
  read_text(json, "name", block.name);
  read_text(json, "task", block.task);
  block.practice = json.is_object() && json.contains("practice") && json["practice"] == true;
  read_texts(json, "renderers", block.renderers);
  read_texts(json, "stimuli", block.stimuli);
  if (json.is_object() && json.contains("level")) {
    for (const auto& one : list_of(json["level"], "dimensions"))
      read_text(one, "name", block.dimensions.emplace_back());
  }
  return block;
}

void read_columns(const nlohmann::json& page, std::vector<StoredColumn>& to) {
  for (const auto& item : list_of(page, "items")) {
    StoredColumn one;
    read_text(item, "column", one.column);
    if (one.column.empty()) continue;
    std::string kind;
    read_text(item, "kind", kind);
    one.number = kind == "number";
    read_text(page, "name", one.page);
    read_text(item, "name", one.item);
    read_text(item, "question", one.question);
    read_texts(item, kind == "scale" ? "labels" : "choices", one.choices);
    to.push_back(std::move(one));
  }
}

void read_factors(const nlohmann::json& protocol, std::vector<StoredFactor>& to) {
  for (const auto& one : list_of(protocol, "factors")) {
    StoredFactor factor;
    read_text(one, "name", factor.name);
    for (const auto& level : list_of(one, "levels")) {
      std::string name;
      read_text(level, "name", name);
      if (!name.empty() && level.contains("set"))
        factor.levels.emplace_back(name, level["set"].dump());
    }
    if (!factor.name.empty()) to.push_back(std::move(factor));
  }
}

/// The levels of a factor that a block crosses; empty: it does not.
std::vector<std::string> crossed_levels(const nlohmann::json& crossed, const StoredFactor& factor) {
  std::vector<std::string> out;
  if (crossed.is_object()) {
    read_texts(crossed, factor.name.c_str(), out);
  } else if (crossed.is_array() &&
             std::find(crossed.begin(), crossed.end(), factor.name) != crossed.end()) {
    for (const auto& [level, set] : factor.levels) out.push_back(level);
  }
  return out;
}

void read_cells(const nlohmann::json& json, const std::vector<StoredFactor>& factors,
                StoredBlock& block) {
  if (!json.is_object() || !json.contains("factors")) return;
  if (json.contains("shared") && json["shared"] == true) return;
  for (const StoredFactor& factor : factors) {
    const std::vector<std::string> levels = crossed_levels(json["factors"], factor);
    if (levels.empty()) continue;
    if (block.cells.empty()) block.cells.emplace_back();
    auto crossed = std::exchange(block.cells, {});
    for (const auto& cell : crossed) {
      for (const std::string& level : levels) {
        block.cells.push_back(cell);
        block.cells.back().emplace_back(factor.name, level);
      }
    }
  }
}

GroupAssignment read_groups(const nlohmann::json& protocol) {
  using Rule = GroupAssignment::Rule;
  GroupAssignment out;
  const auto groups = protocol.find("groups");
  if (groups == protocol.end()) return out;
  read_texts(*groups, "names", out.names);
  std::string rule;
  read_text(*groups, "assign", rule);
  for (const Rule one : {Rule::blocked, Rule::given}) {
    if (rule == to_string(one)) out.rule = one;
  }
  if (!out.any()) return out;
  // Whole numbers, as the protocol's reader takes them: 14.0 is 14.
  if (const auto block = groups->find("block"); block != groups->end() && block->is_number())
    out.block = std::max(1, static_cast<int>(block->get<double>()));
  if (const auto seed = protocol.find("seed"); seed != protocol.end() && seed->is_number()) {
    out.seed = seed->is_number_integer() ? seed->get<std::uint64_t>()
                                         : static_cast<std::uint64_t>(seed->get<double>());
  }
  if (const auto masked = groups->find("masked"); masked != groups->end() && *masked == true)
    out.mask();
  return out;
}

}  // namespace

StoredProtocol read_stored_protocol(const std::string& text) {
  StoredProtocol out;
  const auto json = json_or_discarded(text);
  if (!json.is_object()) return out;
  read_text(json, "name", out.name);
  read_text(json, "title", out.title);
  read_text(json, "description", out.description);
  if (const auto seed = json.find("seed"); seed != json.end() && seed->is_number_integer())
    out.seed = seed->dump();
  if (const auto n = json.find("repetitions"); n != json.end() && n->is_number())
    out.repetitions = *n;
  for (const auto& stimulus : list_of(json, "stimuli")) {
    std::string name;
    read_text(stimulus, "name", name);
    if (!name.empty()) out.stimuli.push_back(name);
    out.has_sound |= stimulus.is_object() && stimulus.contains("sound");
  }
  for (const auto& page : list_of(json, "pages")) read_columns(page, out.columns);
  out.has_view = json.contains("view");
  out.groups = read_groups(json);
  read_factors(json, out.factors);
  read_texts(json, "tests", out.tests);
  std::vector<std::string> renderers;
  read_texts(json, "renderers", renderers);
  for (const auto& one : list_of(json, "blocks")) {
    StoredBlock& block = out.blocks.emplace_back(read_block(one));
    if (block.renderers.empty()) block.renderers = renderers;
    read_cells(one, out.factors, block);
  }
  return out;
}

bool have_blocks(const std::vector<std::string>& texts) {
  return std::ranges::any_of(
      texts, [](const std::string& text) { return !read_stored_protocol(text).blocks.empty(); });
}

}  // namespace palpate::data
