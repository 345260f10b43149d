#pragma once
// Masking noise in the participant's headphones, so that motors and gears tell nothing.

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "runner/sound/noise_signal.h"
#include "runner/sound/sound_output.h"

namespace palpate::runner {

/// What was heard since it was last turned on.
struct NoiseReport {
  double seconds = 0;   ///< of noise, fades included
  int underruns = 0;    ///< gaps
  std::string trouble;  ///< why it stopped by itself; empty: it did not
};

/// Plays in a thread of its own, which nothing of the session or the servo waits for: silence while
/// it is off, so that a device never clicks. Its functions are called from one thread.
class NoisePlayer {
 public:
  using Opener = std::function<std::unique_ptr<SoundOutput>(const std::string& device)>;

  /// Opens the output and plays silence. \param open  also after it failed: headphones were pulled
  /// \throws SoundError
  NoisePlayer(const protocols::MaskingNoise& noise, std::uint64_t seed, const std::string& device,
              Opener open = open_sound);
  /// Fades out.
  ~NoisePlayer();
  NoisePlayer(const NoisePlayer&) = delete;
  NoisePlayer& operator=(const NoisePlayer&) = delete;

  /// Fades in; returns at once. Where the output has failed it is opened again. \throws SoundError
  void turn_on();
  /// Fades out; returns at once.
  void turn_off();
  /// "Go": a short tone as loud as the noise, heard latency() later; returns at once.
  void tone() { tones_.fetch_add(1); }
  bool on() const { return asked_.load(); }
  /// The output has failed since it was turned on.
  bool failed() const { return failed_.load(); }
  NoiseReport report() const;  ///< also after turn_off, until the next turn_on
  const protocols::MaskingNoise& noise() const { return noise_; }
  std::uint64_t seed() const { return seed_; }
  const std::string& device() const { return device_; }
  double rate() const { return output_->rate(); }     ///< Hz
  double latency() const { return latency_.load(); }  ///< s, until what changes now is heard

 private:
  void start();
  void play() noexcept;

  const protocols::MaskingNoise noise_;
  const std::uint64_t seed_;
  const std::string device_;
  const Opener open_;
  std::unique_ptr<SoundOutput> output_;  ///< the thread's
  std::string trouble_;                  ///< written before failed_
  std::atomic<bool> asked_{false}, failed_{false}, quit_{false};
  std::atomic<std::uint64_t> frames_{0};  ///< of noise
  std::atomic<unsigned> tones_{0};        ///< asked for
  std::atomic<int> underruns_{0};         ///< while it sounded
  std::atomic<double> latency_{0};
  unsigned tones_begun_ = 0;  ///< the thread's
  std::uint64_t frames_before_ = 0;
  int underruns_before_ = 0;
  std::jthread thread_;
};

/// Events for the session's record, one line of JSON each: what is turned on, and what was heard.
std::string to_json_text(const NoisePlayer& player);
std::string to_json_text(const NoiseReport& report);

}  // namespace palpate::runner
