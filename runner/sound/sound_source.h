#pragma once
// The sound of a stimulus's contacts, ready to be played at a rate.

#include <complex>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "protocols/sound.h"

namespace palpate::runner::sound {

inline constexpr double kLoudest = 0.251188643150958;  ///< of full scale: -12 dB; of contacts

/// Full scale is 1.
struct SoundSource {
  struct Mode {
    std::complex<double> turn;  ///< of a sample: decay and rotation
    double gain = 0;
  };
  std::vector<Mode> modes;      ///< none: the recording
  std::vector<double> samples;  ///< of the recording, at the output's rate
  double gain = 1;              ///< share of full scale per m/s
  double scrape = 0;            ///< share of full scale, root mean square, per W
  double delay = 0;             ///< s
  double left = 1, right = 1;   ///< gains of the ears

  /// Largest value that a knock of amplitude 1 can have.
  double peak() const;
};

/// Reads each recording once.
class SoundSources {
 public:
  /// \param rate  Hz
  explicit SoundSources(double rate) : rate_(rate) {}
  /// \throws SoundError: the recording cannot be read
  std::shared_ptr<const SoundSource> of(const protocols::SoundSpec& sound);

 private:
  double rate_;
  std::map<std::string, std::vector<double>> recordings_;  ///< by name of file
};

}  // namespace palpate::runner::sound
