#pragma once
// Short tones, made of sines.

#include <array>
#include <span>

namespace palpate::runner::sound {

enum class Tone { ready, go, right, wrong };

/// Plays one tone at a time. A new tone fades out the previous one, so that it does not click.
class ToneSignal {
 public:
  /// \param level_db  root mean square, dB re full scale. \param rate  Hz
  ToneSignal(double level_db, double rate);
  void begin(Tone tone);
  bool silent() const { return newest_.at >= newest_.over && older_.at >= older_.over; }
  /// Adds the next samples; full scale is 1.
  void add(std::span<double> samples);

 private:
  struct Playing {
    std::array<double, 2> pitches{};  ///< Hz, of successive parts; 0: no second part
    double at = 0, over = 0;          ///< s since its beginning; time of its end
  };
  double next(Playing& tone) const;

  double amplitude_, rate_;
  Playing newest_, older_;
};

}  // namespace palpate::runner::sound
