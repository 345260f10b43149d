#include "runner/participants/simulated_settings.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "data/base/json_text.h"
#include "runner/participants/settings_document.h"
#include "runner/participants/simulated_defaults.h"
#include "stimuli/random.h"

namespace palpate::runner {
namespace {

using nlohmann::json;

double degrees(const json& value) { return value.get<double>() * std::numbers::pi / 180; }

int whole(const json& value) {
  return static_cast<int>(std::lround(std::clamp(value.get<double>(), -1e9, 1e9)));
}

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
  s.sha256 = settings_checksum(j);
  return s;
}

json patched_settings(const std::string& patch_path, int version) {
  json settings = complete_settings(version);
  if (!patch_path.empty()) patch_settings(settings, patch_path);
  return settings;
}

}  // namespace

std::vector<int> participant_versions() {
  std::vector<int> versions;
  for (const FrozenSettings* frozen = kFrozenSettings; frozen->version != 0; ++frozen)
    versions.push_back(frozen->version);
  return versions;
}

SimulatedSettings load_simulated_settings(const std::string& patch_path, int version) {
  return read(patched_settings(patch_path, version));
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
  const json settings = data::read_json(text);
  check_settings(settings);
  return read(settings);
}

SimulatedSettings individual(const SimulatedSettings& settings, std::uint64_t seed, int number) {
  stimuli::Random random(seed, {static_cast<std::uint64_t>(number)});
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

}  // namespace palpate::runner
