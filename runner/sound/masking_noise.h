#pragma once
// Masking noise in the participant's headphones, which covers the sound of the device's motors.

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "data/base/random.h"
#include "protocols/protocol.h"
#include "runner/sound/sound_output.h"

namespace palpate::runner::sound {

// The signal of the masking noise, independent of the sound output.

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

/// Short tones, made of sines.
enum class Tone { ready, go, right, wrong };

/// A report since the noise was last turned on.
struct NoiseReport {
  double seconds = 0;   ///< of noise, including the fades
  int underruns = 0;    ///< gaps in the output
  std::string trouble;  ///< reason why it failed; empty: it did not
};

/// Plays in its own thread; session and servo never wait for it. Plays silence while off, so that a
/// sound card does not click. Use it from one thread.
class NoisePlayer {
 public:
  using Opener = std::function<std::unique_ptr<SoundOutput>(const std::string& device)>;

  /// Opens the output and plays silence. \param open  function that opens the output; called again
  /// after a failure (unplugged headphones). \param tones_db  level of tones, root mean square, dB
  /// re full scale; none: the noise's
  /// \throws SoundError
  NoisePlayer(const protocols::MaskingNoise& noise, std::uint64_t seed, const std::string& device,
              Opener open = open_sound, std::optional<double> tones_db = {});
  /// Tones without noise. \param level_db  root mean square, dB re full scale
  NoisePlayer(double level_db, const std::string& device, Opener open = open_sound);
  /// Fades out.
  ~NoisePlayer();
  NoisePlayer(const NoisePlayer&) = delete;
  NoisePlayer& operator=(const NoisePlayer&) = delete;

  /// Fades in; returns at once. Reopens an output that has failed. \throws SoundError
  void turn_on();
  /// Fades out; returns at once.
  void turn_off();
  /// Plays a short tone, heard latency() later; returns at once. Fades out a tone that still
  /// sounds.
  void tone(Tone which = Tone::go) {
    tone_ = which;
    tones_.fetch_add(1);
  }
  bool on() const { return on_.load(); }
  /// The output has failed since turn_on().
  bool failed() const { return failed_.load(); }
  NoiseReport report() const;  ///< valid after turn_off too, until the next turn_on
  const protocols::MaskingNoise& noise() const { return noise_; }
  bool has_noise() const { return has_noise_; }  ///< false: tones only
  double tones_db() const { return tones_db_; }  ///< dB re full scale, root mean square
  std::uint64_t seed() const { return seed_; }
  const std::string& device() const { return device_; }
  double rate() const { return output_->rate(); }     ///< Hz
  double latency() const { return latency_.load(); }  ///< s until a change is heard

 private:
  void start();
  void play() noexcept;

  const protocols::MaskingNoise noise_;
  const double tones_db_;
  const bool has_noise_ = true;
  const std::uint64_t seed_;
  const std::string device_;
  const Opener open_;
  std::unique_ptr<SoundOutput> output_;  ///< used by the thread
  std::string trouble_;                  ///< written before failed_
  std::atomic<bool> on_{false}, failed_{false}, quit_{false};
  std::atomic<std::uint64_t> frames_{0};  ///< of noise
  std::atomic<unsigned> tones_{0};        ///< number requested
  std::atomic<Tone> tone_{Tone::go};      ///< the newest requested
  std::atomic<int> underruns_{0};         ///< while on
  std::atomic<double> latency_{0};
  unsigned tones_begun_ = 0;  ///< used by the thread
  std::uint64_t frames_before_ = 0;
  int underruns_before_ = 0;
  std::jthread thread_;
};

/// Events for the session's record, each a line of JSON: the settings when turned on, the report
/// afterwards.
std::string to_json_text(const NoisePlayer& player);
std::string to_json_text(const NoiseReport& report);

}  // namespace palpate::runner::sound
