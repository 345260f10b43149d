#include "protocols/groups.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <string>

#include "data/base/column_names.h"
#include "data/base/json_text.h"
#include "data/base/words.h"

namespace palpate::protocols {
namespace {

using nlohmann::json;
using Rule = GroupAssignment::Rule;

constexpr std::size_t kLongestName = 32;  // bytes
constexpr NumberRange kBlock{1, 100};     // participants of each group
/// A patch of these would make another study of it.
constexpr std::array kUntouched = {"groups", "factors", "tests", "name", "version", "seed", "cues"};

bool is_group_name(const std::string& text) {
  const std::string lower = lower_case(text);
  // Tables write a missing value, or a person in several groups, by these.
  constexpr std::array kTaken = {"na", "nan", "null", "none", "mixed"};
  if (std::ranges::find(kTaken, lower) != kTaken.end()) return false;
  return !text.empty() && text.size() <= kLongestName && text.front() != '-' &&
         text.find_first_not_of(
             "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-") ==
             std::string::npos;
}

void read_names(ObjectReader& section, GroupAssignment& groups) {
  const json* const list = section.array("names", 2, GroupAssignment::kMost, Presence::required);
  if (list == nullptr) return;
  for (std::size_t i = 0; i < list->size(); ++i) {
    const json& one = (*list)[i];
    const std::string pointer = child_pointer(section.pointer("names"), i);
    const std::string name = one.is_string() ? one.get<std::string>() : "";
    if (!is_group_name(name)) {
      section.faults().add(pointer,
                           "expected a name of 1 to " + std::to_string(kLongestName) +
                               " letters, digits and '-', from a letter or digit on, and no "
                               "word for missing" +
                               found_text(one));
    } else if (groups.find(name) < groups.names.size()) {
      section.faults().add(pointer, "expected a unique name, found '" + name + "' again");
    }
    groups.names.push_back(name);
  }
}

void read_patches(ObjectReader& section, const GroupAssignment& groups,
                  std::vector<json>& patches) {
  section.section("patch", [&](ObjectReader& all) {
    for (std::size_t i = 0; i < groups.names.size(); ++i) {
      const json* const patch = all.member(groups.names[i].c_str());
      if (patch == nullptr || groups.find(groups.names[i]) != i) continue;
      const std::string pointer = all.pointer(groups.names[i]);
      if (!patch->is_object()) {
        all.faults().add(pointer,
                         "expected an object, a merge patch on the protocol" + found_text(*patch));
        continue;
      }
      for (const char* const key : kUntouched) {
        if (patch->contains(key))
          all.faults().add(child_pointer(pointer, key),
                           std::string("expected no change of '") + key + "': all groups share it");
      }
      patches[i] = *patch;
    }
  });
}

}  // namespace

std::vector<json> read_groups(ObjectReader& reader, Protocol& protocol, bool& masked) {
  std::vector<json> patches;
  reader.section("groups", [&](ObjectReader& section) {
    GroupAssignment& groups = protocol.groups;
    read_names(section, groups);
    patches.assign(groups.names.size(), json::object());
    section.choice("assign", groups.rule,
                   {{to_string(Rule::balanced), Rule::balanced},
                    {to_string(Rule::blocked), Rule::blocked},
                    {to_string(Rule::given), Rule::given}});
    section.integer("block", groups.block, kBlock);
    if (section.has("block") && groups.rule != Rule::blocked)
      section.faults().add(section.pointer("block"),
                           "expected it with \"assign\": \"blocked\" only");
    read_patches(section, groups, patches);
    section.boolean("masked", masked);
    if (masked && groups.rule == Rule::given)
      section.faults().add(
          section.pointer("masked"),
          "expected it with \"assign\": \"balanced\" or \"blocked\": who names the "
          "group of a participant knows it");
    GroupAssignment shown = groups;
    if (masked) shown.mask();
    for (std::size_t i = 0; masked && i < groups.names.size(); ++i) {
      if (shown.find(groups.names[i]) < groups.names.size())
        section.faults().add(child_pointer(section.pointer("names"), i),
                             "expected another name than '" + groups.names[i] +
                                 "', which stands for a masked group");
    }
  });
  return patches;
}

std::vector<std::pair<std::string, std::string>> texts_of_groups(const std::string& text) {
  const json root = json_or_discarded(text);
  const json::json_pointer names("/groups/names");
  std::vector<std::pair<std::string, std::string>> out;
  if (!root.is_object() || !root.contains("groups") || !root["groups"].is_object() ||
      !root.contains(names) || !root[names].is_array())
    return {{"", text}};
  for (const json& name : root[names]) {
    if (!name.is_string()) continue;
    json patched = root;
    const json::json_pointer patch = json::json_pointer("/groups/patch") / name.get<std::string>();
    if (root.contains(patch)) patched.merge_patch(root[patch]);
    patched.erase("groups");
    out.emplace_back(name, patched.dump());
  }
  return out;
}

const Protocol& protocol_of(const Protocol& protocol, int participant_number) {
  if (protocol.group_protocols.empty()) return protocol;
  return *protocol.group_protocols[protocol.groups.group(participant_number)];
}

}  // namespace palpate::protocols
