#pragma once
// The interfaces of a sound output and input: ALSA, or a substitute in tests.

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

/// Requested settings of an output; it takes the nearest that it can.
struct SoundBuffer {
  unsigned block = 64;  ///< frames that are written at a time
  unsigned blocks = 2;  ///< that it holds
};

class SoundOutput {
 public:
  /// Plays the rest of its buffer.
  virtual ~SoundOutput() = default;
  virtual double rate() const = 0;  ///< Hz
  virtual SoundBuffer buffer() const = 0;
  /// Waits until the buffer has space for a block. \throws SoundError: the output has failed
  virtual void wait() = 0;
  /// Waits until the buffer has space. \param samples  left and right interleaved, full scale 32767
  /// \return the number of underruns since the last call. \throws SoundError: the output has failed
  virtual int write(std::span<const std::int16_t> samples) = 0;
  /// Time until samples written now are heard, s.
  virtual double latency() = 0;
};

class SoundInput {
 public:
  virtual ~SoundInput() = default;
  virtual double rate() const = 0;  ///< Hz
  /// Waits for the next samples, of one channel, full scale 32767.
  /// \return s, the age of the last of them. \throws SoundError: the input has failed
  virtual double read(std::span<std::int16_t> samples) = 0;
};

/// \param device  name of an ALSA PCM: "default", "plughw:1", ... \throws SoundError
std::unique_ptr<SoundOutput> open_sound(const std::string& device, const SoundBuffer& wanted);
std::unique_ptr<SoundInput> open_sound_input(const std::string& device);

}  // namespace palpate::runner::sound
