#pragma once
// Every constant of the simulated participant, from a versioned file that does not change.

#include <cstdint>
#include <string>

#include "runner/devices/simulated.h"
#include "runner/participants/shape_observer.h"

namespace palpate::runner {

struct SimulatedSettings {
  int version = 1;
  struct Percept {
    double axis_sd;          ///< rad
    double centre_jitter;    ///< m, per axis, drawn once a trial
    double force_low_pass;   ///< s, time constant
    double force_threshold;  ///< N; below it no contact is sensed
  } percept;
  ObserverSettings observer;  ///< also holds the percept's other noises and its rate
  double non_decision;        ///< s, from decision to response
  struct Motor {
    double reaction_delay;     ///< s; delays the contact information only
    double slide_speed;        ///< m/s
    double approach_speed;     ///< m/s
    double indentation;        ///< m; force is this times the object's stiffness
    double max_indentation;    ///< m; limits the force, without delay
    double heading_time;       ///< s; correlation time of the heading
    double mean_follow;        ///< s; exponential
    double approach_distance;  ///< m from the centre, start of an approach
    double approach_min_rise;  ///< smallest upward component of the direction of approach
  } motor;
  struct Search {
    double aim_sd;          ///< m, per axis
    double pull_to_centre;  ///< 1/s; rate of turning towards the centre after contact was lost
    double give_up;         ///< s
  } search;
  struct Stylus {
    double tilt, tilt_sd;  ///< rad, from the direction of approach
    double turning;        ///< rad/s, at most
  } stylus;
  HandImpedance hand;
  SimulatedDeviceSettings device;
  struct Between {
    double slide_speed, percept_noise, reaction_delay, non_decision;  ///< sd of the log
    double threshold;                                                 ///< sd of the logit
  } between;
  std::string sha256;  ///< of the settings used, patch included
};

/// The defaults, changed by the JSON merge patch (RFC 7396) in `patch_path` unless that is empty:
/// for ablation studies. \throws InputError naming unknown keys and wrong values.
SimulatedSettings load_simulated_settings(const std::string& patch_path);

/// The settings of participant `number` of a study, with individual speed, noise, delay and
/// threshold.
SimulatedSettings individual(const SimulatedSettings& settings, std::uint64_t seed, int number);

}  // namespace palpate::runner
