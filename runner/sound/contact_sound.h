#pragma once
// The sound of contacts as a signal: knocks at their beginning, scraping while they slide.

#include <complex>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "data/base/random.h"
#include "runner/servo/heard_tick.h"
#include "runner/sound/sound_source.h"

namespace palpate::runner::sound {

/// When a knock was heard.
struct Knock {
  std::int64_t heard_ns = 0;  ///< session clock, without what the sound card adds
  double lag = 0;             ///< s, from the tick of its contact, beyond the intended delay
};

/// Every sound is heard the same time after its tick, whenever the thread that asks for samples
/// wakes up. A knock begins when the stylus touches after 20 ms without contact, as loud as the
/// speed of entry (at most 1 m/s). Belongs to the sound's thread.
class ContactSound {
 public:
  static constexpr std::size_t kMostVoices = 64;

  /// \param rate  Hz. \param lag  s, from a tick to its sound. \param seed  of scraping
  ContactSound(double rate, double lag, std::uint64_t seed);

  /// The sound of contacts from now on; null: silence. Sounds in progress continue.
  void play(std::shared_ptr<const SoundSource> source);
  /// Ticks with forces, in order.
  void hear(const servo::HeardTick& tick);
  /// Adds the next samples to both ears; full scale is 1.
  /// \param heard_ns  session clock, when the first of them is heard
  void add(std::span<double> left, std::span<double> right, std::int64_t heard_ns);
  /// The newest knock that has begun since the last call.
  std::optional<Knock> take_knock();
  bool silent() const { return voices_.empty() && changes_.empty() && level_ < kInaudible; }

 private:
  static constexpr double kInaudible = 1e-5;  // of full scale
  /// A knock; of a mode by its phasor.
  struct Voice {
    std::shared_ptr<const SoundSource> source;
    double amplitude = 0;
    std::int64_t tick_ns = 0;
    std::int64_t due_ns = 0;  ///< when it is to be heard
    bool begun = false;
    std::size_t at = 0;  ///< in a recording
    std::vector<std::complex<double>> phasors;
  };
  /// A new loudness of scraping.
  struct Change {
    std::int64_t due_ns;
    double level;
  };
  std::int64_t heard_at(std::int64_t tick_ns) const;
  void knock(const servo::HeardTick& tick, double speed);
  void scrape(const servo::HeardTick& tick, const Vec3& sliding);
  void begin(Voice& voice, std::int64_t at_ns);
  void add_voice(Voice& voice, std::span<double> left, std::span<double> right,
                 std::int64_t heard_ns);
  void add_scraping(std::span<double> left, std::span<double> right, std::int64_t heard_ns);

  double rate_, lag_;
  Random random_;
  std::shared_ptr<const SoundSource> source_;
  std::optional<servo::HeardTick> last_;
  std::int64_t contact_ns_ = 0;  ///< of the last tick with contact
  bool touched_ = false;         ///< since play()
  Vec3 velocity_{0};             ///< m/s, of the stylus at the contact, smoothed
  std::deque<Voice> voices_;
  std::deque<Change> changes_;
  double target_ = 0, level_ = 0;  ///< of scraping, full scale 1
  std::shared_ptr<const SoundSource> scraped_;
  std::vector<std::complex<double>> resonators_;
  std::optional<Knock> newest_;
  std::vector<double> mixed_left_, mixed_right_;
};

}  // namespace palpate::runner::sound
