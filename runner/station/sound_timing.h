#pragma once
// How late contacts are heard at a sound card, as measured by its own loop, and the file that keeps
// it beside a calibration.

#include <string>
#include <vector>

namespace palpate::runner::station {

/// From the tick of a contact to its sound at an input of the same computer.
struct SoundTiming {
  std::string device, input;  ///< of ALSA
  int clicks = 0, missed = 0;
  double median = 0, p99 = 0;  ///< s
  std::string made_utc;
};

/// The file that holds measurements beside a calibration: lab.json has lab.sound.json.
std::string sound_timing_file(const std::string& calibration);
/// Replaces the stored measurement of this sound device and keeps the others.
/// \throws std::runtime_error; protocols::InputError: the file at this path is something else
void store_sound_timing(const std::string& path, const SoundTiming& timing);
/// Empty where there is no such file. \throws protocols::InputError with every fault; also where a
/// measurement was changed by hand
std::vector<SoundTiming> stored_sound_timings(const std::string& path);

}  // namespace palpate::runner::station
