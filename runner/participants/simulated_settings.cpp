#include "runner/participants/simulated_settings.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "data/base/checksum.h"
#include "data/base/json_text.h"
#include "data/base/random.h"
#include "protocols/fault_list.h"
#include "protocols/json_document.h"
#include "protocols/parse.h"

namespace palpate::runner::participants {
namespace {

using nlohmann::json;

int whole(const json& value) {
  return static_cast<int>(std::lround(std::clamp(value.get<double>(), -1e9, 1e9)));
}

enum class Kind { from_least, above_least, within, whole };

struct Range {
  std::string_view pointer;
  Kind kind;
  double least, most;
};

constexpr Kind kFrom = Kind::from_least;    // least <= x <= most
constexpr Kind kAbove = Kind::above_least;  // least < x <= most
constexpr Kind kWithin = Kind::within;      // least < x < most
constexpr Kind kWhole = Kind::whole;        // from_least, without a fraction

constexpr std::array kRanges = {
    Range{"/percept/contact_sd_m", kFrom, 0, 1},
    Range{"/percept/direction_sd_deg", kFrom, 0, 180},
    Range{"/percept/along_sd_m", kAbove, 0, 1},
    Range{"/percept/axis_sd_deg", kFrom, 0, 180},
    Range{"/percept/centre_jitter_m", kFrom, 0, 1},
    Range{"/percept/rate_hz", kAbove, 0, 1000},
    Range{"/percept/force_low_pass_s", kFrom, 0, 10},
    Range{"/percept/force_threshold_n", kFrom, 0, 100},
    Range{"/observer/model_contact_sd_m", kFrom, 0, 1},
    Range{"/observer/model_direction_sd_deg", kFrom, 0, 180},
    Range{"/observer/soft_min_scale_m", kAbove, 0, 1},
    Range{"/observer/places_along", kWhole, 2, 64},
    Range{"/observer/torque_floor", kFrom, 1e-30, 1},
    Range{"/observer/free_space_weight", kFrom, 0, 1000},
    Range{"/observer/floor", kFrom, -1e6, 0},
    Range{"/observer/beta", kFrom, 0, 1000},
    Range{"/observer/movement_scale_m", kAbove, 0, 10},
    Range{"/observer/turn_length_m_per_rad", kFrom, 0, 10},
    Range{"/observer/memory_s", kAbove, 0, 1e9},
    Range{"/observer/threshold", kWithin, 0, 1},
    Range{"/observer/non_decision_s", kFrom, 0, 60},
    Range{"/motor/reaction_delay_s", kFrom, 0, 10},
    Range{"/motor/slide_speed_m_per_s", kAbove, 0, 10},
    Range{"/motor/approach_speed_m_per_s", kAbove, 0, 10},
    Range{"/motor/indentation_m", kAbove, 0, 0.1},
    Range{"/motor/max_indentation_m", kAbove, 0, 0.1},
    Range{"/motor/heading_time_constant_s", kAbove, 0, 1000},
    Range{"/motor/mean_follow_s", kAbove, 0, 1e4},
    Range{"/motor/approach_distance_m", kAbove, 0, 10},
    Range{"/motor/approach_min_rise", kWithin, -1, 1},
    Range{"/search/aim_sd_m", kFrom, 0, 1},
    Range{"/search/pull_to_centre", kFrom, 0, 1000},
    Range{"/search/pull_to_centre_per_s", kFrom, 0, 1e4},
    Range{"/search/give_up_s", kAbove, 0, 1e4},
    Range{"/heading/interval_s", kAbove, 0, 1000},
    Range{"/heading/turning_time_s", kAbove, 0, 1000},
    Range{"/heading/hypotheses", kWhole, 2, 32},
    Range{"/heading/headings", kWhole, 2, 64},
    Range{"/heading/places", kWhole, 1, 8},
    Range{"/heading/look_ahead_m", kAbove, 0, 10},
    Range{"/stylus/tilt_deg", kFrom, 0, 90},
    Range{"/stylus/tilt_sd_deg", kFrom, 0, 90},
    Range{"/stylus/turning_deg_per_s", kFrom, 0, 1e5},
    Range{"/hand/stiffness_n_per_m", kAbove, 0, 1e5},
    Range{"/hand/damping_ns_per_m", kFrom, 0, 1000},
    Range{"/hand/mass_kg", kAbove, 0, 100},
    Range{"/hand/turn_stiffness_nm_per_rad", kAbove, 0, 1000},
    Range{"/hand/turn_damping_nms_per_rad", kFrom, 0, 100},
    Range{"/device/end_mass_kg", kAbove, 0, 100},
    Range{"/device/damping_ns_per_m", kFrom, 0, 1000},
    Range{"/device/friction_n", kFrom, 0, 100},
    Range{"/device/resolution_m", kFrom, 0, 0.01},
    Range{"/device/max_force_n", kAbove, 0, 1000},
    Range{"/device/max_stiffness_n_per_m", kAbove, 0, 1e6},
    Range{"/device/workspace_radius_m", kAbove, 0, 10},
    Range{"/cues/weber_v", kAbove, 0, 10},
    Range{"/cues/p_common", kFrom, 0, 1},
    Range{"/between_participants/slide_speed_log_sd", kFrom, 0, 3},
    Range{"/between_participants/percept_noise_log_sd", kFrom, 0, 3},
    Range{"/between_participants/reaction_delay_log_sd", kFrom, 0, 3},
    Range{"/between_participants/non_decision_log_sd", kFrom, 0, 3},
    Range{"/between_participants/threshold_logit_sd", kFrom, 0, 10},
};

bool holds(const Range& range, double x) {
  switch (range.kind) {
    case Kind::from_least:
      return x >= range.least && x <= range.most;
    case Kind::above_least:
      return x > range.least && x <= range.most;
    case Kind::within:
      return x > range.least && x < range.most;
    case Kind::whole:
      return x >= range.least && x <= range.most && x == std::floor(x);
  }
  return false;
}

const char* words_of(Kind kind) {
  switch (kind) {
    case Kind::from_least:
      return "must be %g to %g";
    case Kind::above_least:
      return "must be above %g, at most %g";
    case Kind::within:
      return "must be above %g and below %g";
    case Kind::whole:
      return "must be a whole number, %g to %g";
  }
  return "";
}

// Ranges of the simulated participant's numbers: physically possible hands, styli and devices, and
// the domain of the model. The ranges are wide; plausible values are up to the study.
std::string range_fault(const std::string& pointer, double value) {
  const auto* const range = std::find_if(kRanges.begin(), kRanges.end(),
                                         [&](const Range& one) { return one.pointer == pointer; });
  if (range == kRanges.end() || holds(*range, value)) return "";
  char text[80];
  std::snprintf(text, sizeof text, words_of(range->kind), range->least, range->most);
  return text;
}

// Version 3 has every key. These are the values that describe earlier versions.
const char* const kBeforeVersion3 = R"({
  "percept": {"place": "tip"},
  "observer": {"evidence": "percept", "movement_scale_m": 0.03, "turn_length_m_per_rad": 0.03, "forgetting": true},
  "search": {"after_loss": "turn-to-centre", "pull_to_centre": 0.15},
  "heading": {"chosen": false, "interval_s": 0.3, "turning_time_s": 0.1, "hypotheses": 32, "headings": 8,
              "places": 2, "look_ahead_m": 0.02}
})";
// Things can be seen in every version; no frozen file has these keys.
const char* const kOfSight = R"({
  "cues": {"rule": "optimal", "weber_v": 0.05, "p_common": 1}
})";
const char* const kBeforeVersion2 = R"({
  "search": {"after_loss": "press-on", "pull_to_centre_per_s": 15}
})";

/// The words that a switch accepts, by its pointer.
const std::map<std::string, std::vector<std::string>>& words() {
  static const std::map<std::string, std::vector<std::string>> kWords = {
      {"/percept/place", {"tip", "surface"}},
      {"/observer/evidence", {"percept", "movement"}},
      {"/search/after_loss", {"press-on", "turn-to-centre"}},
      {"/cues/rule", {"optimal", "best", "switch", "causal"}}};
  return kWords;
}

json frozen_settings(int version) {
  for (const FrozenSettings* frozen = kFrozenSettings; frozen->version != 0; ++frozen) {
    if (frozen->version == version) return read_json(frozen->text);
  }
  throw std::invalid_argument("no version " + std::to_string(version) +
                              " of the simulated participant");
}

/// The settings of a version for keys that its file lacks.
json implied_settings(int version) {
  json implied = read_json(kOfSight);
  if (version < 3) implied.merge_patch(read_json(kBeforeVersion3));
  if (version < 2) {
    implied.merge_patch(read_json(kBeforeVersion2));
    implied["search"].erase("pull_to_centre");  // version 2 has its own
  }
  return implied;
}

struct Check {
  std::string file;
  bool whole;  ///< every key is required, and the version may not change
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
  /// Patches of groups, each on the settings of all.
  void compare_groups(const json& groups, const json& known) {
    if (!groups.is_object()) {
      faults.push_back({file, "/groups", "must be an object of a merge patch for each group"});
      return;
    }
    Check patches{file, false};
    for (const auto& [name, patch] : groups.items())
      patches.compare(patch, known, "/groups/" + name);
    faults.insert(faults.end(), patches.faults.begin(), patches.faults.end());
  }
  void throw_if_any() const {
    if (!faults.empty()) throw protocols::InputError(faults);
  }
};

/// Removes from `settings` values equal to those of `implied`, and groups that become empty.
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

double degrees(const json& value) { return value.get<double>() * std::numbers::pi / 180; }

HeadingSettings read_heading(const json& heading) {
  HeadingSettings s;
  s.chosen = heading.at("chosen");
  s.interval = heading.at("interval_s");
  s.turning_time = heading.at("turning_time_s");
  s.hypotheses = whole(heading.at("hypotheses"));
  s.headings = whole(heading.at("headings"));
  s.places = whole(heading.at("places"));
  s.look_ahead = heading.at("look_ahead_m");
  return s;
}

CueSettings read_cues(const json& cues) {
  using Rule = CueSettings::Rule;
  static const std::map<std::string, Rule> kRules = {{"optimal", Rule::optimal},
                                                     {"best", Rule::best},
                                                     {"switch", Rule::switching},
                                                     {"causal", Rule::causal}};
  return {kRules.at(cues.at("rule").get<std::string>()), cues.at("weber_v"), cues.at("p_common")};
}

/// SHA-256 of complete settings. Keys unknown to their version count only if they differ from its
/// behaviour, so the checksum of unpatched settings is that of the frozen file without spaces.
std::string settings_checksum(json settings) {
  remove_implied(settings, implied_settings(settings.at("version")));
  return checksum_hex(settings.dump());
}

SimulatedSettings read(const json& j) {
  SimulatedSettings s;
  s.version = j.at("version");
  const json &percept = j.at("percept"), &observer = j.at("observer"), &motor = j.at("motor");
  s.percept = {percept.at("place") == "tip" ? PerceivedPlace::tip : PerceivedPlace::surface,
               degrees(percept.at("axis_sd_deg")), percept.at("centre_jitter_m"),
               percept.at("force_low_pass_s"), percept.at("force_threshold_n")};
  s.observer.contact_sd = percept.at("contact_sd_m");
  s.observer.direction_sd = degrees(percept.at("direction_sd_deg"));
  s.observer.along_sd = percept.at("along_sd_m");
  s.observer.percept_rate = percept.at("rate_hz");
  s.observer.model_contact_sd = observer.at("model_contact_sd_m");
  s.observer.model_direction_sd = degrees(observer.at("model_direction_sd_deg"));
  s.observer.soft_min_scale = observer.at("soft_min_scale_m");
  s.observer.places_along = whole(observer.at("places_along"));
  s.observer.torque_floor = observer.at("torque_floor");
  s.observer.free_space_weight = observer.at("free_space_weight");
  s.observer.floor = observer.at("floor");
  s.observer.beta = observer.at("beta");
  s.observer.evidence =
      observer.at("evidence") == "percept" ? Evidence::percept : Evidence::movement;
  s.observer.movement_scale = observer.at("movement_scale_m");
  s.observer.turn_length = observer.at("turn_length_m_per_rad");
  s.observer.forgetting = observer.at("forgetting");
  s.observer.memory = observer.at("memory_s");
  s.observer.threshold = observer.at("threshold");
  s.non_decision = observer.at("non_decision_s");
  s.motor = {motor.at("reaction_delay_s"),       motor.at("slide_speed_m_per_s"),
             motor.at("approach_speed_m_per_s"), motor.at("indentation_m"),
             motor.at("max_indentation_m"),      motor.at("heading_time_constant_s"),
             motor.at("mean_follow_s"),          motor.at("approach_distance_m"),
             motor.at("approach_min_rise")};
  const json &search = j.at("search"), &stylus = j.at("stylus"), &hand = j.at("hand");
  s.search = {
      search.at("aim_sd_m"),
      search.at("after_loss") == "press-on" ? AfterLoss::press_on : AfterLoss::turn_to_centre,
      search.at("pull_to_centre"), search.at("pull_to_centre_per_s"), search.at("give_up_s")};
  s.heading = read_heading(j.at("heading"));
  s.stylus = {degrees(stylus.at("tilt_deg")), degrees(stylus.at("tilt_sd_deg")),
              degrees(stylus.at("turning_deg_per_s"))};
  s.hand = {hand.at("stiffness_n_per_m"), hand.at("damping_ns_per_m"), hand.at("mass_kg"),
            hand.at("turn_stiffness_nm_per_rad"), hand.at("turn_damping_nms_per_rad")};
  const json &device = j.at("device"), &between = j.at("between_participants");
  s.device = {device.at("end_mass_kg"),       device.at("damping_ns_per_m"),
              device.at("friction_n"),        device.at("resolution_m"),
              device.at("max_force_n"),       device.at("max_stiffness_n_per_m"),
              device.at("workspace_radius_m")};
  s.between = {between.at("slide_speed_log_sd"), between.at("percept_noise_log_sd"),
               between.at("reaction_delay_log_sd"), between.at("non_decision_log_sd"),
               between.at("threshold_logit_sd")};
  s.cues = read_cues(j.at("cues"));
  return s;
}

/// With those of groups.
SimulatedSettings read_all(const json& j) {
  SimulatedSettings all = read(j);
  all.sha256 = settings_checksum(j);
  if (!j.contains("groups")) return all;
  for (const auto& [name, patch] : j["groups"].items()) {
    json patched = j;
    patched.erase("groups");
    patched.merge_patch(patch);
    SimulatedSettings group = read(patched);
    group.sha256 = all.sha256;
    all.groups[name] = std::make_shared<const SimulatedSettings>(std::move(group));
  }
  return all;
}

/// The frozen settings of a version with every key: switches unknown to it have the values that
/// describe its behaviour.
/// \throws std::invalid_argument if there is no such version
json complete_settings(int version) {
  const json frozen = frozen_settings(version);
  json settings = implied_settings(version);
  settings.merge_patch(frozen);
  return settings;
}

/// Removes the key `groups`. \return its value; null: there was none
json taken_groups(json& settings) {
  if (!settings.is_object() || !settings.contains("groups")) return nullptr;
  json groups = std::move(settings["groups"]);
  settings.erase("groups");
  return groups;
}

/// Applies the JSON merge patch (RFC 7396) in a file.
/// \throws protocols::InputError naming unknown keys and wrong values
void patch_settings(json& settings, const std::string& path) {
  protocols::FaultList found(path);
  json patch = protocols::read_json(protocols::read_text_file(path), found);
  found.throw_if_any();
  Check check{path, false};
  const json groups = taken_groups(patch);
  check.compare(patch, settings, "");
  if (!groups.is_null()) check.compare_groups(groups, settings);
  check.throw_if_any();
  settings.merge_patch(patch);
  if (!groups.is_null()) settings["groups"] = groups;
}

json patched_settings(const std::string& patch_path, int version) {
  json settings = complete_settings(version);
  if (!patch_path.empty()) patch_settings(settings, patch_path);
  return settings;
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

void check_settings(const json& settings) {
  Check check{"settings of the simulated participant", true};
  json of_all = settings;
  const json groups = taken_groups(of_all);
  check.compare(of_all, complete_settings(3), "");
  if (!groups.is_null()) check.compare_groups(groups, complete_settings(3));
  check.throw_if_any();
}

std::vector<int> participant_versions() {
  std::vector<int> versions;
  for (const FrozenSettings* frozen = kFrozenSettings; frozen->version != 0; ++frozen)
    versions.push_back(frozen->version);
  return versions;
}

SimulatedSettings load_simulated_settings(const std::string& patch_path, int version) {
  return read_all(patched_settings(patch_path, version));
}

std::string simulated_settings_text(const std::string& patch_path, int version) {
  return patched_settings(patch_path, version).dump();
}

std::optional<int> participant_version_of(const std::string& sha256,
                                          const std::string& patch_path) {
  for (const int version : participant_versions()) {
    if (settings_checksum(patched_settings(patch_path, version)) == sha256) return version;
  }
  return std::nullopt;
}

SimulatedSettings read_simulated_settings(const std::string& text) {
  const json settings = read_json(text);
  check_settings(settings);
  return read_all(settings);
}

const SimulatedSettings& settings_of_group(const SimulatedSettings& settings,
                                           const std::string& group) {
  const auto own = settings.groups.find(group);
  return own == settings.groups.end() ? settings : *own->second;
}

SimulatedSettings individual(const SimulatedSettings& settings, std::uint64_t seed, int number) {
  Random random(seed, {static_cast<std::uint64_t>(number)});
  const auto factor = [&random](double log_sd) { return std::exp(log_sd * random.normal()); };
  SimulatedSettings own = settings;
  own.motor.slide_speed *= factor(settings.between.slide_speed);
  const double noise = factor(settings.between.percept_noise);
  own.observer.contact_sd *= noise;
  own.observer.direction_sd *= noise;
  own.observer.along_sd *= noise;
  own.percept.axis_sd *= noise;
  own.percept.centre_jitter *= noise;
  own.motor.reaction_delay *= factor(settings.between.reaction_delay);
  own.non_decision *= factor(settings.between.non_decision);
  const double p = settings.observer.threshold;
  const double logit = std::log(p / (1 - p)) + settings.between.threshold * random.normal();
  own.observer.threshold = 1 / (1 + std::exp(-logit));
  return own;
}

}  // namespace palpate::runner::participants
