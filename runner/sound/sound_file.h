#pragma once
// Reads a recorded sound.

#include <string>
#include <vector>

namespace palpate::runner::sound {

/// One channel (the mean of all), full scale 1, resampled. \param bytes  of a WAV, FLAC or OGG
/// file. \param name  for messages. \param rate  Hz
/// \throws SoundError naming the file: it cannot be read, or lasts more than 10 s
std::vector<double> read_sound_file(const std::string& bytes, const std::string& name, double rate);

}  // namespace palpate::runner::sound
