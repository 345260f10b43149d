#pragma once
// Preprocessing of a hand's path (low-pass filter, differences), smoothness, movements and peaks of
// speed. Units of the caller.

#include <cstddef>
#include <optional>
#include <vector>

#include "stimuli/vec.h"

namespace palpate::analysis {

/// Butterworth low-pass filter of order 2, forwards and backwards: zero phase. Winter's factor
/// 0.802 raises the cut-off of a single pass, so that both passes together attenuate by 3 dB at the
/// cut-off. Ends are extended by point reflection. Unchanged if the cut-off is not below half of
/// the rate.
/// \param rate, cutoff  Hz
std::vector<double> low_pass(const std::vector<double>& values, double rate, double cutoff);
std::vector<Vec3> low_pass(const std::vector<Vec3>& path, double rate, double cutoff);

/// Central differences, one-sided at the ends; zero for fewer than two values.
std::vector<Vec3> velocity(const std::vector<Vec3>& path, double rate);
std::vector<double> lengths(const std::vector<Vec3>& vectors);
/// Length, m: sum of the steps.
double path_length(const std::vector<Vec3>& path);

/// Half-open: from begin to before end.
struct Stretch {
  std::size_t begin = 0, end = 0;
  std::size_t size() const { return end - begin; }
  friend bool operator==(const Stretch&, const Stretch&) = default;
};
/// The maximal stretches of true.
std::vector<Stretch> stretches(const std::vector<bool>& wanted);

template <class T>
std::vector<T> part_of(const std::vector<T>& all, const Stretch& stretch) {
  return {all.begin() + static_cast<std::ptrdiff_t>(stretch.begin),
          all.begin() + static_cast<std::ptrdiff_t>(stretch.end)};
}

/// Smoothness of movement: spectral arc length of a speed profile (Balasubramanian et al. 2015, J.
/// NeuroEng. Rehab., 10.1186/s12984-015-0090-9). Zero padding to 2^(ceil log2 N + 4), up to the
/// highest frequency below 10 Hz with at least 0.05 of the spectrum's maximum. None: no speed.
/// \param speed  not negative, so that the spectrum is maximal at 0 Hz. \param rate  Hz
std::optional<double> sparc(const std::vector<double>& speed, double rate);

/// Dimensionless jerk: - ln(T^3 / v_max^2 x integral of the vector jerk's square), table 3 of the
/// same paper. None: too short, or no speed or jerk.
/// \param path  of one movement
std::optional<double> log_dimensionless_jerk(const std::vector<Vec3>& path, double rate);
/// As in the authors' program: with the second difference of speed in place of the vector jerk.
std::optional<double> log_dimensionless_jerk_of_speed(const std::vector<double>& speed,
                                                      double rate);

/// Movements: at least 5 % of the greatest speed for 100 ms or more.
/// \param greatest  m/s, of the whole trial
std::vector<Stretch> movements(const std::vector<double>& speed, double rate, double greatest);
inline std::vector<Stretch> movements(const std::vector<double>& speed, double rate) {
  double greatest = 0;
  for (const double one : speed) greatest = one > greatest ? one : greatest;
  return movements(speed, rate, greatest);
}

/// Number of maxima with a prominence of at least `least`: the curve falls by this much on both
/// sides before it rises higher. A plateau counts once.
std::size_t peaks(const std::vector<double>& values, double least);

}  // namespace palpate::analysis
