#pragma once
// Where sound goes: a sound card through ALSA, or what a test puts in its place.

#include <cstdint>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>

namespace palpate::runner {

/// No sound can be had; what() says from where, why, and what to do.
class SoundError : public std::runtime_error {
  using std::runtime_error::runtime_error;
};

class SoundOutput {
 public:
  /// Plays what it still has.
  virtual ~SoundOutput() = default;
  virtual double rate() const = 0;  ///< Hz
  /// Waits until there is room. \param samples  left and right in turn, full scale 32767
  /// \return how often it had run dry before. \throws SoundError: it plays no more
  virtual int write(std::span<const std::int16_t> samples) = 0;
  /// s, until what is written now is heard
  virtual double latency() = 0;
};

/// \param device  name of an ALSA PCM: "default", "plughw:1", ... \throws SoundError
std::unique_ptr<SoundOutput> open_sound(const std::string& device);

}  // namespace palpate::runner
