#include "runner/sound/loopback.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "data/base/random.h"
#include "runner/sound/steady_time.h"

namespace palpate::runner::sound {
namespace {

constexpr double kBefore = 0.04, kAfter = 0.15;  // s, listened to around a contact
constexpr double kJitter = 0.01;                 // s
constexpr double kOnset = 0.3;                   // of the loudest sample
constexpr double kAboveNoise = 8;                // of the root mean square before
constexpr double kLeastPeak = 1e-3;              // of full scale

/// The recorded sound, and its time.
class Heard {
 public:
  explicit Heard(SoundInput& input)
      : input_(input), block_(static_cast<std::size_t>(0.002 * input.rate())) {}

  void listen(double seconds) {
    const auto wanted = samples_.size() + static_cast<std::size_t>(seconds * input_.rate());
    while (samples_.size() < wanted) {
      std::vector<std::int16_t> block(block_);
      const double age = input_.read(block);
      for (const std::int16_t sample : block) samples_.push_back(std::abs(sample) / 32768.0);
      end_ns_ = static_cast<double>(now_ns()) - 1e9 * age;
    }
  }
  /// ns, of the first loud sample after a moment; none: nothing was heard.
  std::optional<double> onset_after(double moment_ns) const {
    const double step_ns = 1e9 / input_.rate();
    const auto time_of = [&](std::size_t i) {
      return end_ns_ - static_cast<double>(samples_.size() - 1 - i) * step_ns;
    };
    double noise = 0, peak = 0;
    std::size_t quiet = 0;
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      if (time_of(i) < moment_ns) {
        noise += samples_[i] * samples_[i];
        ++quiet;
      } else {
        peak = std::max(peak, samples_[i]);
      }
    }
    noise = quiet > 0 ? std::sqrt(noise / static_cast<double>(quiet)) : 0;
    if (!(peak > std::max(kAboveNoise * noise, kLeastPeak))) return std::nullopt;
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      if (time_of(i) >= moment_ns && samples_[i] >= kOnset * peak) return time_of(i);
    }
    return std::nullopt;
  }

 private:
  SoundInput& input_;
  std::size_t block_;
  std::vector<double> samples_;  ///< of full scale, without sign
  double end_ns_ = 0;            ///< session clock, of the last sample
};

/// At 1 m/s onto a plane.
std::int64_t touch_once(servo::HeardTicks& ticks) {
  servo::HeardTick tick;
  constexpr std::int64_t kTick_ns = 1'000'000;
  tick.time_ns = now_ns() - kTick_ns;
  tick.probe = {Vec3(0, 0, 0.001), Vec3(0, 0, 0.1)};
  ticks.push(tick);
  tick.time_ns += kTick_ns;
  tick.probe = {Vec3(0), Vec3(0, 0, 0.099)};
  tick.touching = true;
  ticks.push(tick);
  return tick.time_ns;
}

}  // namespace

LoopbackTiming measure_loopback(SoundPlayer& player, servo::HeardTicks& ticks, SoundInput& input,
                                int clicks) {
  protocols::SoundSpec click;
  click.modes = {{3000, 1000, 1}};
  player.contacts(&click);
  Random random(1);
  std::vector<double> late;
  LoopbackTiming out;
  Heard{input}.listen(kBefore);
  for (; out.clicks < clicks; ++out.clicks) {
    Heard heard(input);
    heard.listen(kBefore + kJitter * random.unit());
    const std::int64_t moment_ns = touch_once(ticks);
    heard.listen(kAfter);
    if (const auto onset = heard.onset_after(static_cast<double>(moment_ns)))
      late.push_back(1e-9 * (*onset - static_cast<double>(moment_ns)));
    else
      ++out.missed;
  }
  player.contacts(nullptr);
  if (late.empty()) return out;
  std::ranges::sort(late);
  const auto at = [&](double share) {
    return late[static_cast<std::size_t>(
        std::lround(share * static_cast<double>(late.size() - 1)))];
  };
  out.median = at(0.5);
  out.p99 = at(0.99);
  return out;
}

}  // namespace palpate::runner::sound
