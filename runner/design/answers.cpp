#include "runner/design/answers.h"

#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

#include "data/base/json_text.h"
#include "protocols/groups.h"
#include "protocols/parse.h"
#include "protocols/schedule.h"
#include "protocols/tasks/block_order.h"
#include "protocols/tasks/levels.h"
#include "protocols/tasks/texts.h"
#include "runner/scene_builder.h"
#include "runner/station/protocol_check.h"
#include "runner/study/schedule_text.h"
#include "runner/study/task_words.h"
#include "runner/touch/checked_meshes.h"
#include "runner/usage_error.h"
#include "stimuli/polygon_soup.h"

namespace palpate::runner::design {
namespace {

using Json = nlohmann::ordered_json;
using protocols::Protocol;

constexpr std::size_t kMostRows = 2000;  // of an order

/// \throws protocols::InputError with every fault
void require_meshes(const Protocol& protocol, const std::string& path, SceneBuilder& builder) {
  const std::vector<protocols::Fault> faults = touch::mesh_faults(protocol, path, builder);
  if (!faults.empty()) throw protocols::InputError(faults);
}

bool reads_files(const stimuli::ObjectSpec& object) {
  using stimuli::TextureSpec;
  return object.shape == stimuli::ShapeKind::mesh ||
         (object.texture && object.texture->kind == TextureSpec::Kind::image) ||
         std::ranges::any_of(object.parts,
                             [](const stimuli::ObjectSpec& part) { return reads_files(part); });
}

/// Whether another program may change what is built of it.
bool reads_files(const Protocol& protocol) {
  return std::ranges::any_of(protocol.stimuli, [](const protocols::StimulusSpec& stimulus) {
    return reads_files(stimulus.object) ||
           (stimulus.seen && stimulus.seen->shape && reads_files(*stimulus.seen->shape));
  });
}

Json in_words(const Protocol& protocol) {
  Json out = Json::array();
  for (const protocols::TaskBlock* const block : protocols::listed_blocks(protocol))
    out.push_back({block->name, study::in_words(protocol, *block)});
  return out;
}

/// The members of a row, with levels of factors and dimensions before the level.
Json flat(const Json& row) {
  Json out = Json::object();
  for (const auto& [name, value] : row.items()) {
    if (name == "level") {
      for (const char* object : {"factors", "levels"})
        if (row.contains(object)) out.update(row[object]);
    }
    if (name != "orientation_wxyz" && !value.is_object()) out[name] = value;
  }
  return out;
}

/// A table from JSON rows; columns that are empty throughout are left out.
void put_rows(Json& out, const Json& trials) {
  std::vector<Json> rows;
  Json all = Json::object();  // in the order of the columns, null where a column is empty
  for (const Json& trial : trials) {
    const Json& row = rows.emplace_back(flat(trial));
    if (row.size() > all.size()) {
      Json wider = row;
      for (const auto& [name, value] : all.items())
        if (!wider.contains(name) || !value.is_null()) wider[name] = value;
      all = std::move(wider);
    }
    for (const auto& [name, value] : row.items())
      if (!value.is_null()) all[name] = value;
  }
  std::vector<std::string> columns;
  for (const auto& [name, value] : all.items())
    if (!value.is_null()) columns.push_back(name);
  out["columns"] = columns;
  out["rows"] = Json::array();
  for (const Json& trial : rows) {
    if (out["rows"].size() == kMostRows) break;
    Json& row = out["rows"].emplace_back(Json::array());
    for (const std::string& column : columns) row.push_back(trial.value(column, Json()));
  }
  out["all"] = trials.size();
}

/// Builds what the library builds, in a builder that outlives it. Faults are the library's to tell.
void build_shapes(const Protocol& protocol, SceneBuilder& builder) {
  for (const protocols::StimulusSpec& stimulus : protocols::with_all_levels(protocol).stimuli) {
    if (stimulus.object.soft) continue;  // nothing of it is kept
    try {
      for (const bool sides : {false, true}) builder.build({stimulus.object}, sides);
    } catch (const stimuli::MeshError&) {
      return;
    }
  }
}

}  // namespace

SceneBuilder& BuiltShapes::for_protocol(const Protocol& protocol) {
  constexpr int kMostChecks = 100;
  const bool files = reads_files(protocol) ||
                     std::ranges::any_of(protocol.group_protocols,
                                         [](const auto& group) { return reads_files(*group); });
  if (files || ++checks_ > kMostChecks) {
    builder_ = SceneBuilder();
    checks_ = 0;
  }
  return builder_;
}

Json check_answer(const std::string& text, const std::string& path, BuiltShapes& shapes) {
  std::vector<protocols::Fault> faults;
  try {
    const Protocol protocol = protocols::parse_protocol_text(text, path);
    SceneBuilder& builder = shapes.for_protocol(protocol);
    require_meshes(protocol, path, builder);
    const std::vector<std::string> notes = touch::stimulus_notes(protocol, builder);
    build_shapes(protocol, builder);
    const StimulusLibrary library(protocol, builder);
    Json out = station::protocol_json(path, protocol, library, {}, notes);
    out["in_words"] = in_words(protocol);
    out["built_in_texts"] = protocols::built_in_texts(protocol);
    return out;
  } catch (const protocols::InputError& error) {
    faults = error.faults();
  } catch (const stimuli::MeshError& error) {
    for (const std::string& fault : error.faults()) faults.push_back({path, "", fault});
  }
  return station::faults_json(path, faults);
}

Json recover_answer(const std::string& text, const std::string& path, const std::string& block,
                    int participants) {
  Protocol protocol = protocols::parse_protocol_text(text, path);
  std::erase_if(protocol.blocks, [&](const protocols::TaskBlock& one) {
    return one.name != block || one.procedures.empty();
  });
  for (protocols::TaskBlock& one : protocol.blocks) one.practice = false;
  if (protocol.blocks.empty() || !protocols::is_adaptive(protocol.blocks.front()))
    throw UsageError("The levels of this block do not follow the answers: nothing is estimated.");
  constexpr std::uint64_t kSeed = 1;  // as the command's
  return read_ordered_json(study::recovery_text(protocol, participants, kSeed, "json"));
}

Json schedule_answer(const std::string& text, const std::string& path, int participant) {
  const Protocol all = protocols::parse_protocol_text(text, path);
  const Protocol& protocol = protocols::protocol_of(all, participant);
  Json out{{"participant", participant}};
  if (all.groups.any()) out["group"] = all.groups.true_name(all.groups.group(participant));
  put_rows(out, read_ordered_json(study::schedule_text(protocol, participant, "json"))["trials"]);
  return out;
}

}  // namespace palpate::runner::design
