#include "runner/sweep/swept_study.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "data/base/json_text.h"
#include "data/base/random.h"
#include "data/base/text.h"
#include "data/base/words.h"
#include "data/stored_protocol.h"
#include "protocols/json_document.h"
#include "protocols/object_reader.h"
#include "runner/participants/simulated_settings.h"

namespace palpate::runner::sweep {

namespace {

using nlohmann::json;
using protocols::child_pointer;
using protocols::SweepParameter;
using protocols::SweptDocument;

std::vector<std::string> tokens_of(const std::string& pointer) {
  std::vector<std::string> tokens;
  for (json::json_pointer left(pointer); !left.empty(); left.pop_back())
    tokens.push_back(left.back());
  std::reverse(tokens.begin(), tokens.end());
  return tokens;
}

template <class Json>
Json* element(Json& array, const std::string& token) {
  std::size_t index = 0;
  const char* const end = token.data() + token.size();
  const auto read = std::from_chars(token.data(), end, index);
  const bool number = read.ec == std::errc() && read.ptr == end && std::to_string(index) == token;
  return number && index < array.size() ? &array[index] : nullptr;
}

/// The value that a pointer leads to; nullptr: there is none.
const json* value_at(const json& document, const std::string& pointer) {
  const json* at = &document;
  for (const std::string& token : tokens_of(pointer)) {
    if (at->is_array()) {
      at = element(*at, token);
    } else if (at->is_object()) {
      const auto member = at->find(token);
      at = member == at->end() ? nullptr : &*member;
    } else {
      return nullptr;
    }
    if (at == nullptr) return nullptr;
  }
  return at;
}

/// Sets it. Members of objects are added where they are missing, elements of arrays are not.
/// \return false: it leads through an array's end, or into a number or a text
bool set_value(json& document, const std::string& pointer, const json& value) {
  json* at = &document;
  for (const std::string& token : tokens_of(pointer)) {
    if (at->is_array()) {
      at = element(*at, token);
      if (at == nullptr) return false;
    } else if (at->is_object() || at->is_null()) {
      at = &(*at)[token];
    } else {
      return false;
    }
  }
  *at = value;
  return true;
}

/// Pointers of the document's numbers, texts and booleans that are written much like this one, the
/// nearest first, at most `most`.
std::vector<std::string> near_pointers(const json& document, const std::string& pointer,
                                       std::size_t most = 3) {
  std::vector<std::pair<std::size_t, std::string>> found;
  const std::string last = pointer.substr(pointer.rfind('/') + 1);
  const json flat = document.flatten();
  for (const auto& [place, value] : flat.items()) {
    // One that only stands elsewhere is as near as one that is misspelt by two letters.
    const std::size_t elsewhere = 2 + edit_distance(last, place.substr(place.rfind('/') + 1));
    const std::size_t edits = std::min(edit_distance(pointer, place), elsewhere);
    if (edits <= 2 + last.size() / 2) found.emplace_back(edits, place);
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const auto& a, const auto& b) { return a.first < b.first; });
  std::vector<std::string> out;
  for (const auto& [edits, place] : found) {
    if (out.size() == most) break;
    if (out.empty() || edits <= found.front().first + 2) out.push_back(place);
  }
  return out;
}

/// 53 bits: every reader of JSON takes them exactly.
std::uint64_t short_seed(std::uint64_t sweep_seed, std::int64_t point, std::uint64_t use) {
  constexpr std::uint64_t kPointSeeds = 4;  // other streams of the sweep's seed: above
  return Random(sweep_seed, {kPointSeeds, static_cast<std::uint64_t>(point), use}).next() >> 11U;
}

std::string place_of(std::size_t parameter, const SweepParameter& one, std::size_t path) {
  const std::string place = child_pointer(child_pointer("/parameters", parameter), "path");
  return one.paths.size() == 1 ? place : child_pointer(place, path);
}

std::string near_text(const json& document, const std::string& pointer) {
  const std::string near = listed(near_pointers(document, pointer));
  return near.empty() ? "" : "; near to it: " + near;
}

bool is_whole(const json& value) {
  return value.is_number() && value.get<double>() == std::floor(value.get<double>());
}

/// Values to try: all of a choice; of a distribution its middle and two beside it, without whole
/// numbers: it hardly ever gives one.
std::vector<json> typical_values(const SweepParameter& one) {
  if (!one.values.empty()) return one.values;
  std::vector<json> values;
  for (const double share : {0.5, 0.31, 0.77}) {
    if (const json value = one.value_at(share); !is_whole(value)) values.push_back(value);
  }
  if (values.empty()) values.push_back(one.value_at(0.5));
  return values;
}

/// Names that columns are made of.
std::vector<std::string> names_in(const json& protocol) {
  std::vector<std::string> out;
  if (const json* const stimuli = value_at(protocol, "/stimuli");
      stimuli != nullptr && stimuli->is_array()) {
    for (const json& stimulus : *stimuli) {
      const json* const name = value_at(stimulus, "/name");
      out.push_back(name == nullptr ? "" : name->dump());
    }
  }
  if (const json* const renderers = value_at(protocol, "/renderers"))
    out.push_back(renderers->dump());
  return out;
}

/// The sweep's file keeps numbers as doubles.
void check_whole_numbers(const SweepParameter& one, std::size_t number,
                         protocols::FaultList& faults) {
  constexpr double kMostExact = 9007199254740992;  // 2^53
  for (std::size_t i = 0; i < one.values.size(); ++i) {
    if (!one.values[i].is_number_integer() || std::abs(one.values[i].get<double>()) < kMostExact)
      continue;
    faults.add(child_pointer(child_pointer(child_pointer("/parameters", number), "values"), i),
               "expected a whole number below 2^53 (larger ones are not exact)" +
                   protocols::found_text(one.values[i]));
  }
}

}  // namespace

SweptStudy::SweptStudy(json protocol, std::string protocol_path, json settings,
                       protocols::SweepSpace space, const std::string& space_path)
    : protocol_(std::move(protocol)),
      protocol_path_(std::move(protocol_path)),
      settings_(std::move(settings)),
      space_(std::move(space)) {
  protocols::FaultList faults(space_path);
  protocols::read_json(space_.source_text, faults);  // for the lines of its values
  for (std::size_t i = 0; i < space_.parameters.size(); ++i) {
    const SweepParameter& one = space_.parameters[i];
    check_whole_numbers(one, i, faults);
    if (one.of == SweptDocument::participant) {
      check_participant(one, i, faults);
    } else {
      check_protocol(one, i, faults);
      varies_order_ = varies_order_ || std::count(one.paths.begin(), one.paths.end(), "/seed") > 0;
    }
  }
  faults.throw_if_any();
}

void SweptStudy::check_participant(const SweepParameter& one, std::size_t number,
                                   protocols::FaultList& faults) const {
  json settings = settings_;
  if (!one.group.empty()) {
    const GroupAssignment groups = data::read_stored_protocol(protocol_.dump()).groups.unmasked();
    if (groups.find(one.group) == groups.names.size())
      faults.add(child_pointer(child_pointer("/parameters", number), "of"),
                 groups.any() ? "expected a group of the protocol: " + listed(groups.names) +
                                    "; found '" + one.group + "'"
                              : "expected 'participant' or 'protocol': the protocol has no groups");
    if (const json* const own = value_at(settings_, "/groups/" + one.group))
      settings.merge_patch(json(*own));
    settings.erase("groups");
  }
  for (std::size_t p = 0; p < one.paths.size(); ++p) {
    const std::string& path = one.paths[p];
    const std::string place = place_of(number, one, p);
    const json* const now = value_at(settings, path);
    if (now == nullptr || now->is_structured() || path == "/version" || path == "/note") {
      faults.add(place, "expected a pointer to a setting of the simulated participant, found " +
                            path + near_text(settings, path));
      continue;
    }
    const std::vector<json> values = typical_values(one);
    std::vector<std::string> refusals;
    for (const json& value : values) {
      if (const std::string why = participants::setting_fault(path, value, *now); !why.empty())
        refusals.push_back(why + protocols::found_text(value));
    }
    // All words of a choice must be known; of numbers the space may hold some that fail.
    if (!refusals.empty() && (values.front().is_string() || refusals.size() == values.size())) {
      faults.add(place, "expected what " + path + " can be: it " + refusals.front() + "; " +
                            json_excerpt(*now) + " stands there now");
    }
  }
}

std::string SweptStudy::refusal_of(const std::string& path, const json& value) const {
  json changed = protocol_;
  if (!set_value(changed, path, value)) {
    return "expected a pointer into the protocol, found " + path +
           ", which leads through a value or past the end of a list" + near_text(protocol_, path);
  }
  if (names_in(changed) != names_in(protocol_))
    return "names of stimuli and the list of renderers cannot vary: they name the columns";
  try {
    parse(changed);
  } catch (const protocols::InputError& error) {
    for (const protocols::Fault& fault : error.faults()) {
      const std::string& at = fault.location;
      if (at != path && !path.starts_with(at + "/") && !at.starts_with(path + "/")) continue;
      const bool unknown = fault.expected.starts_with("unknown key");
      return "expected what the protocol can have; with " + json_excerpt(value) +
             " it says: " + at + ": " + fault.expected +
             (unknown ? near_text(protocol_, path) : "");
    }
  }
  return "";
}

void SweptStudy::check_protocol(const SweepParameter& one, std::size_t number,
                                protocols::FaultList& faults) const {
  for (std::size_t p = 0; p < one.paths.size(); ++p) {
    const std::vector<json> values = typical_values(one);
    std::string first;
    std::size_t refused = 0;
    for (const json& value : values) {
      const std::string refusal = refusal_of(one.paths[p], value);
      if (refusal.empty()) continue;
      if (first.empty()) first = refusal;
      // A word is known or not; a number may be too large beside another one only.
      refused += value.is_string() ? values.size() : 1;
    }
    if (refused >= values.size()) faults.add(place_of(number, one, p), first);
  }
}

PointStudy SweptStudy::at(std::uint64_t sweep_seed, std::int64_t point,
                          const std::vector<json>& values) const {
  PointStudy out;
  out.seed = short_seed(sweep_seed, point, 1);
  out.order_seed = short_seed(sweep_seed, point, 2);
  out.settings = settings_;
  out.protocol = protocol_;
  if (!varies_order_) out.protocol["seed"] = out.order_seed;
  for (std::size_t i = 0; i < space_.parameters.size(); ++i) {
    const SweepParameter& one = space_.parameters[i];
    json& document = one.of == SweptDocument::participant ? out.settings : out.protocol;
    const std::string within = one.group.empty() ? "" : "/groups/" + one.group;
    for (const std::string& path : one.paths) set_value(document, within + path, values.at(i));
  }
  return out;
}

protocols::Protocol SweptStudy::parse(const json& protocol) const {
  return protocols::parse_protocol_text(protocol.dump(), protocol_path_);
}

}  // namespace palpate::runner::sweep
