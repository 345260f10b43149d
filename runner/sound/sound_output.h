#pragma once
// The interface of a sound output: ALSA, or a substitute in tests.

#include <cstdint>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>

namespace palpate::runner::sound {

/// No sound output; what() names the device, the reason and the remedy.
class SoundError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

class SoundOutput {
 public:
  /// Plays the rest of its buffer.
  virtual ~SoundOutput() = default;
  virtual double rate() const = 0;  ///< Hz
  /// Waits until the buffer has space. \param samples  left and right interleaved, full scale 32767
  /// \return the number of underruns since the last call. \throws SoundError: the output has failed
  virtual int write(std::span<const std::int16_t> samples) = 0;
  /// Time until samples written now are heard, s.
  virtual double latency() = 0;
};

/// \param device  name of an ALSA PCM: "default", "plughw:1", ... \throws SoundError
std::unique_ptr<SoundOutput> open_sound(const std::string& device);

}  // namespace palpate::runner::sound
