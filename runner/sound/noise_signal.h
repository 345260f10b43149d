#pragma once
// The signal of the masking noise, independent of the sound output.

#include <cstdint>
#include <span>
#include <vector>

#include "data/base/random.h"
#include "protocols/protocol.h"

namespace palpate::runner::sound {

inline constexpr double kNoiseFade = 0.2;  ///< s, from silence to the full level and back

/// Deterministic from settings and seed (up to the rounding of exp). Fades are raised cosines and
/// may be reversed at any time.
class NoiseSignal {
 public:
  /// \param rate  Hz
  NoiseSignal(const protocols::MaskingNoise& noise, double rate, std::uint64_t seed);

  void turn(bool on) { on_ = on; }
  /// Completely faded out.
  bool silent() const { return !on_ && fade_ == 0; }
  /// Fills in the next samples; full scale is 1.
  void fill(std::span<double> samples);

 private:
  /// First order: flat, -6 dB an octave between the pole's frequency and the zero's, flat again.
  struct Slope {
    double pole, zero;  ///< in the z plane
    double out = 0, in = 0;
  };
  double filtered(double white);

  Random random_;
  std::vector<Slope> slopes_;  ///< none: white
  double gain_ = 1;
  double fade_step_;
  bool on_ = false;
  double fade_ = 0;  ///< 0 to 1, phase of the raised cosine
};

}  // namespace palpate::runner::sound
