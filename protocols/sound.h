#pragma once
// The sound of a stimulus, as plain values. Meaning and default of each key:
// protocol.v2.schema.json. SI units.

#include <memory>
#include <string>
#include <vector>

namespace palpate::protocols {

/// The sound of a stimulus's contacts: a sum of decaying sines, or a recording.
struct SoundSpec {
  struct Mode {
    double frequency = 440;  ///< Hz
    double decay = 60;       ///< 1/s
    double gain = 1;
  };
  std::vector<Mode> modes;                        ///< none: the recording
  std::string file_name;                          ///< of the recording; "": none
  std::shared_ptr<const std::string> file_bytes;  ///< its file
  double gain = 1;                                ///< share of full scale per m/s of entry
  double scrape = 0;                              ///< share of full scale, rms, per W of sliding
  double delay = 0;                               ///< s
  double pan = 0;                                 ///< -1 left to 1 right
};

}  // namespace palpate::protocols
