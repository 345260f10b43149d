#pragma once
// Masking noise as numbers: what goes to the headphones, without a sound card.

#include <cstdint>
#include <span>
#include <vector>

#include "protocols/protocol.h"
#include "stimuli/random.h"

namespace palpate::runner {

inline constexpr double kNoiseFade = 0.2;  ///< s, from silence to the full level and back

/// Same settings and seed, same samples (up to the rounding of exp on the machine). A raised cosine
/// takes the level up and down, from wherever it is.
class NoiseSignal {
 public:
  /// \param rate  Hz
  NoiseSignal(const protocols::MaskingNoise& noise, double rate, std::uint64_t seed);

  void sound(bool on) { on_ = on; }
  /// Faded out to the last sample.
  bool silent() const { return !on_ && loudness_ == 0; }
  /// The next samples, 1 for full scale.
  void fill(std::span<double> samples);

 private:
  /// First order: flat, -6 dB an octave between the pole's frequency and the zero's, flat again.
  struct Slope {
    double pole, zero;  ///< in the z plane
    double out = 0, in = 0;
  };
  double filtered(double white);

  stimuli::Random random_;
  std::vector<Slope> slopes_;  ///< none: white
  double gain_ = 1;
  double fade_step_;
  bool on_ = false;
  double loudness_ = 0;  ///< 0 to 1, before it is rounded off to a cosine
};

}  // namespace palpate::runner
