#pragma once
// How smoothly a hand moves: spectral arc length and dimensionless jerk (Balasubramanian et al.
// 2015, J. NeuroEng. Rehab., 10.1186/s12984-015-0090-9), movements, peaks of speed.

#include <cstddef>
#include <optional>
#include <vector>

#include "analysis/movement/signal.h"
#include "stimuli/vec.h"

namespace palpate::analysis {

/// Spectral arc length of a profile of speed: zero padding 2^(ceil log2 N + 4), up to 10 Hz, from
/// there down to where the spectrum is at 0.05 of its greatest value. None: no speed.
/// \param speed  not negative, so that the spectrum is greatest at 0 Hz. \param rate  Hz
std::optional<double> sparc(const std::vector<double>& speed, double rate);

/// - ln(T^3 / v_max^2 x integral of the vector jerk's square), their table 3. None: too short, or
/// no speed or jerk.
/// \param path  of one movement
std::optional<double> log_dimensionless_jerk(const std::vector<Vec3>& path, double rate);
/// As the authors' program has it: the second difference of the speed in place of the vector jerk.
std::optional<double> log_dimensionless_jerk_of_speed(const std::vector<double>& speed,
                                                      double rate);

/// Stretches with at least 5 % of the greatest speed, for 100 ms or more.
/// \param greatest  m/s, of the whole trial
std::vector<Stretch> movements(const std::vector<double>& speed, double rate, double greatest);
inline std::vector<Stretch> movements(const std::vector<double>& speed, double rate) {
  double greatest = 0;
  for (const double one : speed) greatest = one > greatest ? one : greatest;
  return movements(speed, rate, greatest);
}

/// Number of maxima with a prominence of at least `least`: one must go down by as much on both
/// sides before it goes higher. A plateau counts once.
std::size_t peaks(const std::vector<double>& values, double least);

}  // namespace palpate::analysis
