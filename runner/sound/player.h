#pragma once
// Everything that the participant hears: masking noise, which covers the device's motors, tones,
// and the sound of contacts.

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "protocols/protocol.h"
#include "runner/servo/heard_tick.h"
#include "runner/sound/contact_sound.h"
#include "runner/sound/sound_output.h"
#include "runner/sound/sound_source.h"
#include "runner/sound/tone_signal.h"

namespace palpate::runner::sound {

/// A report since the sound was last turned on.
struct SoundReport {
  double seconds = 0;   ///< of noise, including the fades
  int underruns = 0;    ///< gaps in the output
  std::string trouble;  ///< reason why it failed; empty: it did not
};

struct SoundSettings {
  using Opener =
      std::function<std::unique_ptr<SoundOutput>(const std::string& device, const SoundBuffer&)>;

  std::string device;  ///< of ALSA
  std::optional<protocols::MaskingNoise> noise = std::nullopt;
  std::optional<double> tones_db =
      std::nullopt;                    ///< root mean square, dB re full scale; none: the noise's
  std::uint64_t seed = 0;              ///< of noise and scraping
  servo::HeardTicks* ticks = nullptr;  ///< outlives the player; null: no contacts
  /// Asks for real-time scheduling of the calling thread; false: denied. None: not asked for.
  std::function<bool()> realtime = nullptr;
  Opener open = open_sound;  ///< called again after a failure (unplugged headphones)
};

/// Plays in its own thread; session and servo never wait for it. Plays silence while off, so that a
/// sound card does not click. Use it from one thread.
///
/// With real-time scheduling the output holds two blocks of 64 frames. Without it a busy computer
/// would leave gaps: four of 128, and eight of 256 where no contact is to be heard. A card that
/// refuses takes what it can. Whatever is asked for is heard latency() later, to the sample.
class SoundPlayer {
 public:
  /// Opens the output and plays silence. \throws SoundError
  explicit SoundPlayer(SoundSettings settings);
  /// Fades out.
  ~SoundPlayer();
  SoundPlayer(const SoundPlayer&) = delete;
  SoundPlayer& operator=(const SoundPlayer&) = delete;

  /// Fades in; returns at once. Reopens an output that has failed. \throws SoundError
  void turn_on();
  /// Fades out; returns at once.
  void turn_off();
  /// Plays a short tone; returns at once. Fades out a tone that still sounds.
  void tone(Tone which = Tone::go) {
    tone_ = which;
    tones_.fetch_add(1);
  }
  /// From now on contacts sound like this; null: like nothing. \throws SoundError: a recording
  /// cannot be read
  void contacts(const protocols::SoundSpec* sound);
  /// The knocks since the last call, in order.
  std::vector<Knock> take_knocks();

  bool on() const { return on_.load(); }
  /// The output has failed since turn_on().
  bool failed() const { return failed_.load(); }
  SoundReport report() const;  ///< valid after turn_off too, until the next turn_on
  const SoundSettings& settings() const { return settings_; }
  bool has_noise() const { return settings_.noise.has_value(); }
  double tones_db() const { return tones_db_; }  ///< dB re full scale, root mean square
  double rate() const { return rate_; }          ///< Hz
  double latency() const { return latency_; }    ///< s until what is asked for is heard

 private:
  void start();
  void play() noexcept;
  void play_blocks();

  const SoundSettings settings_;
  const double tones_db_;
  std::unique_ptr<SoundOutput> output_;  ///< used by the thread
  double rate_ = 0, latency_ = 0;        ///< set before the constructor returns
  std::string trouble_;                  ///< written before failed_
  std::atomic<bool> on_{false}, failed_{false}, quit_{false};
  std::atomic<std::uint64_t> frames_{0};  ///< of noise
  std::atomic<unsigned> tones_{0};        ///< number requested
  std::atomic<Tone> tone_{Tone::go};      ///< the newest requested
  std::atomic<int> underruns_{0};         ///< while on
  unsigned tones_begun_ = 0;              ///< used by the thread
  std::uint64_t frames_before_ = 0;
  int underruns_before_ = 0;
  std::optional<SoundSources> sources_;

  std::mutex mutex_;                                               ///< of the next two
  std::optional<std::shared_ptr<const SoundSource>> next_source_;  ///< none: no change
  std::vector<Knock> knocks_;

  std::jthread thread_;
};

/// Events for the session's record, each a line of JSON: the settings when turned on, the report
/// afterwards.
std::string to_json_text(const SoundPlayer& player);
std::string to_json_text(const SoundReport& report);

}  // namespace palpate::runner::sound
