#include "runner/design/answers.h"

#include <algorithm>
#include <cstddef>
#include <glm/common.hpp>
#include <limits>
#include <set>
#include <utility>
#include <vector>

#include "data/base/cell_name.h"
#include "data/base/json_text.h"
#include "protocols/groups.h"
#include "protocols/parse.h"
#include "protocols/schedule.h"
#include "protocols/tasks/texts.h"
#include "runner/scene_builder.h"
#include "runner/station/protocol_check.h"
#include "runner/study/task_words.h"
#include "runner/touch/checked_meshes.h"
#include "runner/touch/trial_page.h"
#include "stimuli/polygon_soup.h"

namespace palpate::runner::design {
namespace {

using Json = nlohmann::ordered_json;
using protocols::Protocol;

constexpr std::size_t kMostTriangles = 12000;  // of all stimuli together
constexpr std::size_t kMostRows = 2000;        // of an order

Json as_json(const Vec3& v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

/// \throws protocols::InputError with every fault, also of meshes
Protocol checked(const std::string& text, const std::string& path, SceneBuilder& builder) {
  Protocol protocol = protocols::parse_protocol_text(text, path);
  const std::vector<protocols::Fault> faults = touch::mesh_faults(protocol, path, builder);
  if (!faults.empty()) throw protocols::InputError(faults);
  return protocol;
}

Json in_words(const Protocol& protocol) {
  Json out = Json::array();
  for (const protocols::TaskBlock& block : protocol.blocks) {
    if (!block.name.empty()) out.push_back({block.name, study::in_words(protocol, block)});
  }
  return out;
}

Json picture_of(const stimuli::ObjectSpec& object, std::size_t most) {
  Json out{{"corners", Json::array()}, {"triangles", Json::array()}};
  if (object.shape == stimuli::ShapeKind::none) return out;
  const touch::PictureMesh mesh = touch::picture_mesh(object, most);
  Vec3 low(std::numeric_limits<double>::max()), high(-std::numeric_limits<double>::max());
  for (const Vec3& corner : mesh.corners) {
    low = glm::min(low, corner);
    high = glm::max(high, corner);
    out["corners"].push_back(as_json(corner));
  }
  out["triangles"] = mesh.triangles;
  out["size_m"] = as_json(high - low);
  // Primitives look the same with fewer.
  if (object.shape == stimuli::ShapeKind::mesh && mesh.all_triangles > mesh.triangles.size())
    out["all_triangles"] = mesh.all_triangles;
  return out;
}

/// A stimulus in a cell that looks like one that is shown already is left out.
Json pictures_of(const std::vector<protocols::StimulusSpec>& stimuli) {
  Json out = Json::array();
  std::set<std::string> known;
  for (const protocols::StimulusSpec& stimulus : stimuli) {
    Json picture = picture_of(stimulus.object, kMostTriangles / stimuli.size() + 1);
    const std::string base = base_name(stimulus.name);
    const bool is_new = known.insert(base + picture.dump()).second;
    if (!is_new && base != stimulus.name) continue;
    picture["name"] = stimulus.name;
    picture["place"] = stimulus.place;
    out.push_back(std::move(picture));
  }
  return out;
}

/// A table from JSON rows; columns that are empty throughout are left out.
void put_rows(Json& out, const Json& trials) {
  std::vector<std::string> columns;
  const Json first = trials.empty() ? Json::object() : trials.front();
  for (const auto& [name, value] : first.items()) {
    const auto has_one = [&key = name](const Json& row) { return !row[key].is_null(); };
    if (name != "orientation_wxyz" && std::ranges::any_of(trials, has_one)) columns.push_back(name);
  }
  out["columns"] = columns;
  out["rows"] = Json::array();
  for (const Json& trial : trials) {
    if (out["rows"].size() == kMostRows) break;
    Json& row = out["rows"].emplace_back(Json::array());
    for (const std::string& column : columns) row.push_back(trial[column]);
  }
  out["all"] = trials.size();
}

Json trials_of(const Protocol& protocol, int participant) {
  if (protocol.version == 2)
    return read_ordered_json(study::task_schedule_text(protocol, participant, "json"))["trials"];
  Json out = Json::array();
  for (const protocols::Trial& trial : protocols::schedule(protocol, participant)) {
    out.push_back({{"session", trial.session},
                   {"block", trial.block},
                   {"trial", trial.trial},
                   {"renderer", protocols::to_string(trial.renderer)},
                   {"shape", protocol.stimuli[static_cast<std::size_t>(trial.stimulus)].name},
                   {"practice", trial.practice}});
  }
  return out;
}

}  // namespace

Json check_answer(const std::string& text, const std::string& path) {
  std::vector<protocols::Fault> faults;
  try {
    SceneBuilder builder;
    const Protocol protocol = checked(text, path, builder);
    const std::vector<std::string> notes = touch::stimulus_notes(protocol, builder);
    const StimulusLibrary library(protocol, std::move(builder));
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

Json picture_answer(const std::string& text, const std::string& path) {
  const Protocol protocol = protocols::parse_protocol_text(text, path);
  Json out;
  out["stimuli"] = pictures_of(protocol.stimuli);
  Json& stylus = out["stylus"];
  stylus = {{"length_m", protocol.stylus.length}, {"grip_m", protocol.stylus.grip}};
  for (const protocols::ToolSegmentSpec& segment : protocol.tool.segments)
    stylus["segments"].push_back({as_json(segment.from), as_json(segment.to)});
  if (protocol.reach) stylus["reach"] = protocol.reach->factor;
  return out;
}

Json schedule_answer(const std::string& text, const std::string& path, int participant) {
  const Protocol all = protocols::parse_protocol_text(text, path);
  const Protocol& protocol = protocols::protocol_of(all, participant);
  Json out{{"participant", participant}};
  if (all.groups.any()) out["group"] = all.groups.name(participant);
  put_rows(out, trials_of(protocol, participant));
  return out;
}

}  // namespace palpate::runner::design
