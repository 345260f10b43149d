#pragma once
// Magnitude estimation and the method of adjustment.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "analysis/statistics/paired.h"

namespace palpate::analysis {

/// One judgement of a participant.
struct MagnitudeTrial {
  std::size_t participant = 0;
  double level = 0;      ///< of the stimulus, > 0
  double magnitude = 0;  ///< as judged, > 0; others have no logarithm and are only counted
};

/// Straight line of log10 magnitude over log10 level (Stevens 1957), by least squares on the log
/// means of each level.
struct StevensLine {
  std::string undefined;
  std::size_t participant = 0;
  std::size_t trials = 0, levels = 0;
  std::optional<double> exponent, log10_scale;  ///< magnitude = 10^log10_scale level^exponent
  std::optional<double> r_squared;
  std::optional<double> exponent_se;  ///< from three levels on
};

/// Geometric mean of the magnitudes at a level over participants, after equalising their means of
/// logs (Stevens' "modulus equalization"), or untransformed with a modulus given by the
/// experimenter.
struct MagnitudeMean {
  double level = 0;
  double geometric_mean = 0;
  std::optional<Interval> ci95;  ///< t over participants
  std::size_t participants = 0;
};

struct MagnitudeEstimation {
  std::vector<StevensLine> lines;  ///< one per participant, in their order
  std::vector<MagnitudeMean> means;
  std::size_t without_logarithm = 0;
  /// Mean of the participants' exponents and its 95 % interval (t).
  std::optional<double> exponent;
  std::optional<Interval> exponent_ci95;
};

/// \param modulus  the experimenter gave the number of a standard
MagnitudeEstimation magnitude_estimation(const std::vector<MagnitudeTrial>& trials, bool modulus);

/// One setting of a level to equal a standard.
struct AdjustmentTrial {
  std::size_t participant = 0;
  double standard = 0, setting = 0;
  bool from_above = false;
};

/// Summary of a participant's settings.
struct Adjustment {
  std::size_t participant = 0;
  std::size_t settings = 0;
  double pse = 0;                      ///< mean setting
  std::optional<Interval> pse_ci95;    ///< t; not below 0 if all settings are above 0
  double constant_error = 0;           ///< PSE minus standard
  std::optional<double> sd;            ///< of the settings about the mean of their direction
  std::optional<double> jnd;           ///< 0.6745 sd: half of the settings lie within
  std::optional<double> start_effect;  ///< mean setting from above minus from below
};

/// By participant, in their order; settings of one standard.
std::vector<Adjustment> adjustments(const std::vector<AdjustmentTrial>& trials);

}  // namespace palpate::analysis
