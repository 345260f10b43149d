#include "runner/sound/contact_sound.h"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <utility>

namespace palpate::runner::sound {
namespace {

constexpr double kPerSecond_ns = 1e9;
constexpr std::int64_t kArmedAfter_ns = 20'000'000;          // without contact, as of a transient
constexpr double kFastestEntry = 1;                          // m/s
constexpr double kVelocityTime = 0.005, kLevelTime = 0.005;  // s, of one pole
// Uniform in -1 to 1, of mean square 1.
constexpr double kWhite = 1.7320508075688772;

double smoothing(double step, double time) { return 1 - std::exp(-step / time); }

}  // namespace

ContactSound::ContactSound(double rate, double lag, std::uint64_t seed)
    : rate_(rate), lag_(lag), random_(seed) {}

void ContactSound::play(std::shared_ptr<const SoundSource> source) {
  source_ = std::move(source);
  last_.reset();
  touched_ = false;
  velocity_ = Vec3(0);
  if (source_ && source_->scrape > 0) {
    scraped_ = source_;
    resonators_.assign(scraped_->modes.size(), 0);
  }
}

std::int64_t ContactSound::heard_at(std::int64_t tick_ns) const {
  return tick_ns + std::llround((lag_ + source_->delay) * kPerSecond_ns);
}

void ContactSound::hear(const servo::HeardTick& tick) {
  if (!source_) return;
  if (!tick.touching) {
    if (last_ && last_->touching) changes_.push_back({heard_at(tick.time_ns), 0});
    last_ = tick;
    return;
  }
  const bool begins = !last_ || !last_->touching;
  double speed = 0;
  if (last_ && tick.time_ns > last_->time_ns) {
    const double step = static_cast<double>(tick.time_ns - last_->time_ns) / kPerSecond_ns;
    const double length = glm::distance(tick.probe.tip, tick.probe.tail);
    const double share = length > 0 ? tick.along / length : 0;
    const Vec3 velocity = ((1 - share) * (tick.probe.tip - last_->probe.tip) +
                           share * (tick.probe.tail - last_->probe.tail)) /
                          step;
    speed = std::clamp(-glm::dot(velocity, tick.normal), 0.0, kFastestEntry);
    velocity_ =
        begins ? velocity : velocity_ + smoothing(step, kVelocityTime) * (velocity - velocity_);
  }
  const bool armed = !touched_ || tick.time_ns - contact_ns_ >= kArmedAfter_ns;
  if (begins && armed && last_) knock(tick, speed);
  scrape(tick, velocity_ - glm::dot(velocity_, tick.normal) * tick.normal);
  touched_ = true;
  contact_ns_ = tick.time_ns;
  last_ = tick;
}

void ContactSound::knock(const servo::HeardTick& tick, double speed) {
  const double peak = source_->peak();
  const double amplitude = peak > 0 ? std::min(source_->gain * speed, kLoudest / peak) : 0;
  if (!(amplitude * peak > kInaudible)) return;
  if (voices_.size() == kMostVoices) voices_.pop_front();
  Voice voice;
  voice.source = source_;
  voice.amplitude = amplitude;
  voice.tick_ns = tick.time_ns;
  voice.due_ns = heard_at(tick.time_ns);
  for (const SoundSource::Mode& mode : source_->modes)
    voice.phasors.push_back(amplitude * mode.gain);
  voices_.push_back(std::move(voice));
}

/// The power of friction is as loud as its sliding speed times the force.
void ContactSound::scrape(const servo::HeardTick& tick, const Vec3& sliding) {
  if (!(source_->scrape > 0)) return;
  changes_.push_back({heard_at(tick.time_ns),
                      std::min(kLoudest, source_->scrape * glm::length(sliding) * tick.pressing)});
}

void ContactSound::begin(Voice& voice, std::int64_t at_ns) {
  voice.begun = true;
  newest_ = {at_ns,
             static_cast<double>(at_ns - voice.tick_ns) / kPerSecond_ns - voice.source->delay};
}

void ContactSound::add_voice(Voice& voice, std::span<double> left, std::span<double> right,
                             std::int64_t heard_ns) {
  std::size_t i = 0;
  if (!voice.begun) {
    const double wait = static_cast<double>(voice.due_ns - heard_ns) / kPerSecond_ns * rate_;
    if (!(wait < static_cast<double>(left.size()) - 0.5)) return;
    i = static_cast<std::size_t>(std::llround(std::max(0.0, wait)));
    begin(voice, heard_ns + std::llround(static_cast<double>(i) / rate_ * kPerSecond_ns));
  }
  const SoundSource& source = *voice.source;
  for (; i < left.size(); ++i) {
    double value = 0;
    for (std::size_t k = 0; k < source.modes.size(); ++k) {
      value += voice.phasors[k].imag();
      voice.phasors[k] *= source.modes[k].turn;
    }
    if (voice.at < source.samples.size()) value += voice.amplitude * source.samples[voice.at++];
    left[i] += source.left * value;
    right[i] += source.right * value;
  }
}

void ContactSound::add_scraping(std::span<double> left, std::span<double> right,
                                std::int64_t heard_ns) {
  const auto block_ns = std::llround(static_cast<double>(left.size()) / rate_ * kPerSecond_ns);
  while (!changes_.empty() && changes_.front().due_ns < heard_ns + block_ns) {
    target_ = changes_.front().level;
    changes_.pop_front();
  }
  // Ticks end with the forces.
  if (last_ && source_ && heard_ns > heard_at(last_->time_ns) + kArmedAfter_ns) target_ = 0;
  if (!source_) target_ = 0;
  if (!scraped_ || (target_ == 0 && level_ < kInaudible)) {
    level_ = 0;
    return;
  }
  const double step = smoothing(1 / rate_, kLevelTime);
  for (std::size_t i = 0; i < left.size(); ++i) {
    level_ += step * (target_ - level_);
    const double white = kWhite * (2 * random_.unit() - 1);
    double value = 0;
    for (std::size_t k = 0; k < resonators_.size(); ++k) {
      const SoundSource::Mode& mode = scraped_->modes[k];
      resonators_[k] = mode.turn * resonators_[k] + white;
      // The real part of noise through r e^(i w) has the mean square of 1/(1 - r^2) / 2, about.
      value += mode.gain * std::sqrt(2 * (1 - std::norm(mode.turn))) * resonators_[k].real();
    }
    left[i] += scraped_->left * level_ * value;
    right[i] += scraped_->right * level_ * value;
  }
}

void ContactSound::add(std::span<double> left, std::span<double> right, std::int64_t heard_ns) {
  if (silent()) {
    if (level_ != 0) level_ = 0;
    return;
  }
  mixed_left_.assign(left.size(), 0);
  mixed_right_.assign(right.size(), 0);
  for (Voice& voice : voices_) add_voice(voice, mixed_left_, mixed_right_, heard_ns);
  std::erase_if(voices_, [](const Voice& voice) {
    const auto faded = [](const std::complex<double>& z) { return std::abs(z) < kInaudible; };
    return voice.begun && std::ranges::all_of(voice.phasors, faded) &&
           voice.at >= voice.source->samples.size();
  });
  add_scraping(mixed_left_, mixed_right_, heard_ns);
  for (std::size_t i = 0; i < left.size(); ++i) {
    left[i] += std::clamp(mixed_left_[i], -kLoudest, kLoudest);
    right[i] += std::clamp(mixed_right_[i], -kLoudest, kLoudest);
  }
}

std::optional<Knock> ContactSound::take_knock() { return std::exchange(newest_, std::nullopt); }

}  // namespace palpate::runner::sound
