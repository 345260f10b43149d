#include "runner/participants/settings_document.h"

#include <cmath>
#include <map>
#include <stdexcept>
#include <vector>

#include "data/base/json_text.h"
#include "protocols/json_document.h"
#include "protocols/parse.h"
#include "protocols/sha256.h"
#include "runner/participants/setting_ranges.h"
#include "runner/participants/simulated_defaults.h"

namespace palpate::runner {
namespace {

using nlohmann::json;

// Version 3 has every key; what earlier versions did, in its words.
const char* const kBeforeVersion3 = R"({
  "percept": {"place": "tip"},
  "observer": {"evidence": "percept", "movement_scale_m": 0.03, "turn_length_m_per_rad": 0.03, "forgetting": true},
  "search": {"after_loss": "turn-to-centre", "pull_to_centre": 0.15},
  "heading": {"chosen": false, "interval_s": 0.3, "turning_time_s": 0.1, "hypotheses": 32, "headings": 8,
              "places": 2, "look_ahead_m": 0.02}
})";
const char* const kBeforeVersion2 = R"({
  "search": {"after_loss": "press-on", "pull_to_centre_per_s": 15}
})";

/// The words that a switch can be, by its place.
const std::map<std::string, std::vector<std::string>>& words() {
  static const std::map<std::string, std::vector<std::string>> kWords = {
      {"/percept/place", {"tip", "surface"}},
      {"/observer/evidence", {"percept", "movement"}},
      {"/search/after_loss", {"press-on", "turn-to-centre"}}};
  return kWords;
}

json frozen_settings(int version) {
  for (const FrozenSettings* frozen = kFrozenSettings; frozen->version != 0; ++frozen) {
    if (frozen->version == version) return data::read_json(frozen->text);
  }
  throw std::invalid_argument("no version " + std::to_string(version) +
                              " of the simulated participant");
}

/// What a version did where its file has no key for it.
json implied_settings(int version) {
  json implied = json::object();
  if (version < 3) implied = data::read_json(kBeforeVersion3);
  if (version < 2) {
    implied.merge_patch(data::read_json(kBeforeVersion2));
    implied["search"].erase("pull_to_centre");  // its own
  }
  return implied;
}

}  // namespace

std::string setting_fault(const std::string& pointer, const json& value, const json& now) {
  if (now.is_number() && !(value.is_number() && std::isfinite(value.get<double>())))
    return "must be a number";
  if (now.is_number()) return range_fault(pointer, value.get<double>());
  if (now.is_boolean() && !value.is_boolean()) return "must be true or false";
  const auto known = words().find(pointer);
  if (known != words().end()) {
    std::string list;
    for (const std::string& word : known->second) {
      if (value == word) return "";
      list += (list.empty() ? "" : " or ") + word;
    }
    return "must be " + list;
  }
  if (now.is_string() && !value.is_string()) return "must be a text";
  return "";
}

namespace {

struct Check {
  std::string file;
  bool whole;  ///< every key must be there, and the version stands
  std::vector<protocols::Fault> faults = {};

  /// \param known  an object with all keys
  void compare(const json& given, const json& known, const std::string& pointer) {
    if (!given.is_object()) {
      faults.push_back({file, pointer, "must be an object"});
      return;
    }
    for (const auto& [key, value] : given.items()) {
      const std::string here = std::string(pointer).append("/").append(key);
      if (!known.contains(key)) {
        faults.push_back({file, here, "no such setting"});
      } else if (known[key].is_object()) {
        compare(value, known[key], here);
      } else if (const std::string fault = setting_fault(here, value, known[key]); !fault.empty()) {
        faults.push_back({file, here, fault});
      } else if (key == "version" && !whole) {
        faults.push_back({file, here, "a patch cannot change the version"});
      }
    }
    if (!whole) return;
    for (const auto& [key, value] : known.items()) {
      if (!given.contains(key)) faults.push_back({file, pointer + "/" + key, "is missing"});
    }
  }
  void throw_if_any() const {
    if (!faults.empty()) throw protocols::InputError(faults);
  }
};

/// Takes out of `settings` what is the same in `implied`, and groups that are empty then.
void remove_implied(json& settings, const json& implied) {
  for (const auto& [key, value] : implied.items()) {
    if (!settings.contains(key)) continue;
    json& own = settings[key];
    if (value.is_object()) {
      remove_implied(own, value);
      if (own.empty()) settings.erase(key);
    } else if (own == value) {
      settings.erase(key);
    }
  }
}

}  // namespace

json complete_settings(int version) {
  const json frozen = frozen_settings(version);
  json settings = implied_settings(version);
  settings.merge_patch(frozen);
  return settings;
}

void patch_settings(json& settings, const std::string& path) {
  protocols::FaultList found(path);
  const json patch = protocols::read_json(protocols::read_text_file(path), found);
  found.throw_if_any();
  Check check{path, false};
  check.compare(patch, settings, "");
  check.throw_if_any();
  settings.merge_patch(patch);
}

void check_settings(const json& settings) {
  Check check{"settings of the simulated participant", true};
  check.compare(settings, complete_settings(3), "");
  check.throw_if_any();
}

std::string settings_checksum(json settings) {
  remove_implied(settings, implied_settings(settings.at("version")));
  return protocols::sha256_hex(settings.dump());
}

}  // namespace palpate::runner
