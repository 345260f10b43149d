#include "runner/sound/masking_noise.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>
#include <vector>

namespace palpate::runner::sound {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kLowest = 10;          // Hz, first pole: below it pink noise is flat
constexpr double kLongEnough = 1;       // s; the slowest pole has decayed to e^-60
constexpr double kEvenPower = 1.0 / 3;  // mean square of uniform numbers in -1..1

double in_z_plane(double frequency, double rate) { return std::exp(-2 * kPi * frequency / rate); }

constexpr double kBlock = 0.02;  // s, length of a block

// Pacing for outputs without a clock (a file), which accept everything at once: write a block every
// 0.9 of its duration. A sound card is slower and sets the pace itself.
constexpr double kPace = 0.9;

/// Pitches of a tone's successive parts, Hz; 0: no second part.
std::array<double, 2> pitches_of(Tone tone) {
  switch (tone) {
    case Tone::ready:
      return {440, 0};
    case Tone::go:
      return {880, 0};
    case Tone::right:
      return {660, 990};
    case Tone::wrong:
      return {220, 0};
  }
  return {};
}

/// Adds tones to the samples. A new tone fades out the previous one, so that it does not click.
class ToneSignal {
 public:
  ToneSignal(double level_db, double rate)
      : amplitude_(std::sqrt(2) * std::pow(10, level_db / 20)), rate_(rate) {}
  void begin(Tone tone) {
    older_ = newest_;
    older_.over = std::min(older_.over, older_.at + kEdge);
    newest_ = {pitches_of(tone), 0, 0};
    for (const double pitch : newest_.pitches) newest_.over += pitch > 0 ? kLength : 0;
  }
  bool silent() const { return newest_.at >= newest_.over && older_.at >= older_.over; }
  void add(std::vector<double>& samples) {
    for (double& sample : samples) sample += next(older_) + next(newest_);
  }

 private:
  static constexpr double kLength = 0.1, kEdge = 0.01;  // s, of a part
  struct Playing {
    std::array<double, 2> pitches{};
    double at = 0, over = 0;  // s since its beginning; time of its end
  };

  double next(Playing& tone) const {
    if (tone.at >= tone.over) return 0;
    const std::size_t part = tone.at < kLength ? 0 : 1;
    const double at = tone.at - (part == 0 ? 0 : kLength);
    const double edge =
        std::min({1.0, at / kEdge, (kLength - at) / kEdge, (tone.over - tone.at) / kEdge});
    tone.at += 1 / rate_;
    return amplitude_ * std::max(edge, 0.0) * std::sin(2 * M_PI * tone.pitches[part] * at);
  }

  double amplitude_, rate_;
  Playing newest_, older_;
};

}  // namespace

NoiseSignal::NoiseSignal(const protocols::MaskingNoise& noise, double rate, std::uint64_t seed)
    : random_(seed), fade_step_(1 / (kNoiseFade * rate)) {
  if (noise.kind == protocols::NoiseKind::pink) {
    // Pole and zero half an octave apart: -6 dB an octave for half of each octave, -3 dB an octave
    // on average with less than 0.05 dB of ripple; sampling adds 0.5 dB at a quarter of the rate.
    for (double pole = kLowest; pole < rate / 2; pole *= 2) {
      slopes_.push_back({in_z_plane(pole, rate), in_z_plane(pole * std::sqrt(2.0), rate)});
    }
  }
  double power = 0;  // power gain of the filter, from its impulse response
  const auto length = static_cast<int>(kLongEnough * rate);
  for (int i = 0; i < length; ++i) {
    const double response = filtered(i == 0 ? 1 : 0);
    power += response * response;
  }
  for (Slope& slope : slopes_) slope.out = slope.in = 0;
  gain_ = std::pow(10.0, noise.level_db / 20) / std::sqrt(power * kEvenPower);
}

double NoiseSignal::filtered(double value) {
  for (Slope& slope : slopes_) {
    slope.out = value - slope.zero * slope.in + slope.pole * slope.out;
    slope.in = value;
    value = slope.out;
  }
  return value;
}

void NoiseSignal::fill(std::span<double> samples) {
  for (double& sample : samples) {
    fade_ = std::clamp(fade_ + (on_ ? fade_step_ : -fade_step_), 0.0, 1.0);
    const double level = 0.5 - 0.5 * std::cos(kPi * fade_);
    sample = std::clamp(level * gain_ * filtered(2 * random_.unit() - 1), -1.0, 1.0);
  }
}

NoisePlayer::NoisePlayer(const protocols::MaskingNoise& noise, std::uint64_t seed,
                         const std::string& device, Opener open, std::optional<double> tones_db)
    : noise_(noise),
      tones_db_(tones_db.value_or(noise.level_db)),
      seed_(seed),
      device_(device),
      open_(std::move(open)),
      output_(open_(device_)) {
  start();
}

NoisePlayer::NoisePlayer(double level_db, const std::string& device, Opener open)
    : noise_{protocols::NoiseKind::pink, level_db},
      tones_db_(level_db),
      has_noise_(false),
      seed_(0),
      device_(device),
      open_(std::move(open)),
      output_(open_(device_)) {
  start();
}

NoisePlayer::~NoisePlayer() {
  on_ = false;
  quit_ = true;
}

void NoisePlayer::start() {
  thread_ = std::jthread([this] { play(); });
}

void NoisePlayer::turn_on() {
  if (failed_) {
    if (thread_.joinable()) thread_.join();
    output_ = open_(device_);
    failed_ = false;
    trouble_.clear();
    start();
  }
  if (on_) return;
  frames_before_ = frames_;
  underruns_before_ = underruns_;
  on_ = true;
}

void NoisePlayer::turn_off() { on_ = false; }

NoiseReport NoisePlayer::report() const {
  return {static_cast<double>(frames_ - frames_before_) / output_->rate(),
          underruns_ - underruns_before_, failed_ ? trouble_ : ""};
}

void NoisePlayer::play() noexcept {
  using Clock = std::chrono::steady_clock;
  const double rate = output_->rate();
  NoiseSignal signal(noise_, rate, seed_);
  ToneSignal tone(tones_db_, rate);
  std::vector<double> samples(static_cast<std::size_t>(kBlock * rate));
  std::vector<std::int16_t> frames(2 * samples.size());
  const auto pace =
      std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(kPace * kBlock));
  Clock::time_point due = Clock::now();
  try {
    while (!quit_ || !signal.silent() || !tone.silent()) {
      signal.turn(on_ && has_noise_);
      const bool heard = !signal.silent();
      signal.fill(samples);
      if (const unsigned asked = tones_; asked != tones_begun_) {
        tones_begun_ = asked;
        tone.begin(tone_);
      }
      tone.add(samples);
      for (std::size_t i = 0; i < samples.size(); ++i) {
        frames[2 * i] = frames[2 * i + 1] =
            static_cast<std::int16_t>(std::lround(32767 * std::clamp(samples[i], -1.0, 1.0)));
      }
      const int underruns = output_->write(frames);
      if (heard) {
        frames_ += samples.size();
        underruns_ += underruns;
      }
      latency_ = output_->latency();
      due = std::max(due + pace, Clock::now());
      std::this_thread::sleep_until(due);
    }
  } catch (const std::exception& error) {
    trouble_ = error.what();
    on_ = false;
    failed_ = true;
  }
}

std::string to_json_text(const NoisePlayer& player) {
  if (!player.has_noise()) {
    const nlohmann::ordered_json event = {{"sounds", "on"},
                                          {"level_db", player.tones_db()},
                                          {"device", player.device()},
                                          {"rate_hz", player.rate()},
                                          {"latency_s", player.latency()}};
    return event.dump();
  }
  const nlohmann::ordered_json event = {{"masking_noise", "on"},
                                        {"kind", protocols::to_string(player.noise().kind)},
                                        {"level_db", player.noise().level_db},
                                        {"tones_level_db", player.tones_db()},
                                        {"seed", player.seed()},
                                        {"device", player.device()},
                                        {"rate_hz", player.rate()},
                                        {"latency_s", player.latency()},
                                        {"fade_s", kNoiseFade}};
  return event.dump();
}

std::string to_json_text(const NoiseReport& report) {
  nlohmann::ordered_json event = {
      {"masking_noise", "off"}, {"seconds", report.seconds}, {"underruns", report.underruns}};
  if (!report.trouble.empty()) event["trouble"] = report.trouble;
  return event.dump();
}

}  // namespace palpate::runner::sound
