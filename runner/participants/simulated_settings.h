#pragma once
// Every constant of the simulated participant, as JSON: frozen versions in files that do not
// change, values implied by older versions, patches and the checksum. Versions differ by switches,
// which a patch can set in any version.

#include <cstdint>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "runner/devices/simulated.h"
#include "runner/participants/cue_combination.h"
#include "runner/participants/heading_choice.h"
#include "runner/participants/shape_observer.h"

namespace palpate::runner::participants {

/// A frozen settings file, embedded by the build.
struct FrozenSettings {
  int version;
  const char* text;  ///< JSON
};
/// Ascending; ends with version 0.
extern const FrozenSettings kFrozenSettings[];

/// The reason why a setting cannot have that value, as "must be ..."; empty: it can.
/// \param pointer  JSON pointer into the complete settings
/// \param now  the present value: a number must stay a number
std::string setting_fault(const std::string& pointer, const nlohmann::json& value,
                          const nlohmann::json& now);

/// \throws protocols::InputError if a key is missing, unknown or has a wrong value
void check_settings(const nlohmann::json& settings);

/// Place of the stylus in a percept with contact: as displayed, with its tip in the object; or
/// moved out according to the force, with the contact on the surface.
enum class PerceivedPlace { tip, surface };

/// Motion of the hand after a loss of contact: on in the direction of pressing, or on with its
/// heading, which turns to the centre.
enum class AfterLoss { press_on, turn_to_centre };

struct SimulatedSettings {
  int version = 1;
  struct Percept {
    PerceivedPlace place;
    double axis_sd;          ///< rad
    double centre_jitter;    ///< m, per axis, drawn once a trial
    double force_low_pass;   ///< s, time constant
    double force_threshold;  ///< N; below it no contact is sensed
  } percept;
  ObserverSettings observer;  ///< also has the percept's other noises and its rate
  double non_decision;        ///< s, from decision to response
  struct Motor {
    double reaction_delay;     ///< s; delays the contact information only
    double slide_speed;        ///< m/s
    double approach_speed;     ///< m/s
    double indentation;        ///< m; force is this times the object's stiffness
    double max_indentation;    ///< m; limits the force without delay
    double heading_time;       ///< s; correlation time of the heading
    double mean_follow;        ///< s; exponential
    double approach_distance;  ///< m from the centre, start of an approach
    double approach_min_rise;  ///< smallest upward component of the direction of approach
  } motor;
  struct Search {
    double aim_sd;  ///< m, per axis
    AfterLoss after_loss;
    double press_on_pull;   ///< weight of the direction to the centre relative to that of pressing
    double pull_to_centre;  ///< 1/s; rate of turning to the centre after a loss of contact
    double give_up;         ///< s
  } search;
  HeadingSettings heading;
  struct Stylus {
    double tilt, tilt_sd;  ///< rad, from the direction of approach
    double turning;        ///< rad/s, at most
  } stylus;
  devices::HandImpedance hand;
  devices::SimulatedDeviceSettings device;
  struct Between {
    double slide_speed, percept_noise, reaction_delay, non_decision;  ///< sd of the log
    double threshold;                                                 ///< sd of the logit
  } between;
  CueSettings cues;    ///< where things are seen
  std::string sha256;  ///< of the settings used, patch included
  /// Of groups of participants that differ, by name; the checksum is that of the whole settings.
  std::map<std::string, std::shared_ptr<const SimulatedSettings>> groups;
};

/// The default version.
inline constexpr int kDefaultParticipantVersion = 3;
/// Versions of the frozen settings, ascending.
std::vector<int> participant_versions();

/// The frozen settings of a version, changed by the JSON merge patch (RFC 7396) in `patch_path`
/// unless that is empty: for ablation studies.
/// \throws InputError naming unknown keys and wrong values; std::invalid_argument: no such version
SimulatedSettings load_simulated_settings(const std::string& patch_path,
                                          int version = kDefaultParticipantVersion);
/// The same as the text of a JSON document with every key, including switches unknown to the
/// version. Callers may edit it. \throws as load_simulated_settings
std::string simulated_settings_text(const std::string& patch_path,
                                    int version = kDefaultParticipantVersion);
/// The version that has this checksum with the patch; none: no version has it.
/// \throws InputError as load_simulated_settings
std::optional<int> participant_version_of(const std::string& sha256, const std::string& patch_path);
/// Reads such a text. \throws InputError if a key is missing or has an invalid value
SimulatedSettings read_simulated_settings(const std::string& text);

/// The settings of a group's participants.
const SimulatedSettings& settings_of_group(const SimulatedSettings& settings,
                                           const std::string& group);

/// The settings of participant `number` of a study, with individual speed, noise, delay and
/// threshold.
SimulatedSettings individual(const SimulatedSettings& settings, std::uint64_t seed, int number);

}  // namespace palpate::runner::participants
