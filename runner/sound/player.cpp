#include "runner/sound/player.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <future>
#include <nlohmann/json.hpp>
#include <utility>

#include "runner/sound/noise_signal.h"
#include "runner/sound/steady_time.h"

namespace palpate::runner::sound {
namespace {

using Clock = std::chrono::steady_clock;

constexpr SoundBuffer kQuick{64, 2}, kPatient{128, 4}, kUnhurried{256, 8};
// Pacing for outputs without a clock (a file), which accept everything at once: write a block every
// 0.9 of its duration. A sound card is slower and sets the pace itself.
constexpr double kPace = 0.9;
constexpr double kWaking = 0.0005;  // s, by which the thread may wake late
constexpr double kTonesDb = -24;    // where a protocol has neither tones nor noise

std::int16_t to_sample(double value) {
  return static_cast<std::int16_t>(std::lround(32767 * std::clamp(value, -1.0, 1.0)));
}

}  // namespace

SoundPlayer::SoundPlayer(SoundSettings settings)
    : settings_(std::move(settings)),
      tones_db_(
          settings_.tones_db.value_or(settings_.noise ? settings_.noise->level_db : kTonesDb)) {
  start();
  sources_.emplace(rate_);
}

SoundPlayer::~SoundPlayer() {
  on_ = false;
  quit_ = true;
}

/// The thread opens the output: its rights decide how much that holds.
void SoundPlayer::start() {
  std::promise<void> opened;
  std::future<void> result = opened.get_future();
  thread_ = std::jthread([this, &opened] {
    try {
      const bool quick = settings_.realtime && settings_.realtime();
      const SoundBuffer& without = settings_.ticks != nullptr ? kPatient : kUnhurried;
      output_ = settings_.open(settings_.device, quick ? kQuick : without);
      const SoundBuffer held = output_->buffer();
      rate_ = output_->rate();
      latency_ = held.block * held.blocks / rate_ + kWaking;
    } catch (...) {
      return opened.set_exception(std::current_exception());
    }
    opened.set_value();
    play();
  });
  try {
    result.get();
  } catch (...) {
    thread_.join();
    throw;
  }
}

void SoundPlayer::turn_on() {
  if (failed_) {
    if (thread_.joinable()) thread_.join();
    failed_ = false;
    trouble_.clear();
    try {
      start();
    } catch (...) {
      failed_ = true;
      throw;
    }
  }
  if (on_) return;
  frames_before_ = frames_;
  underruns_before_ = underruns_;
  on_ = true;
}

void SoundPlayer::turn_off() { on_ = false; }

void SoundPlayer::contacts(const protocols::SoundSpec* sound) {
  auto source = sound != nullptr ? sources_->of(*sound) : nullptr;
  const std::lock_guard lock(mutex_);
  next_source_ = std::move(source);
}

std::vector<Knock> SoundPlayer::take_knocks() {
  const std::lock_guard lock(mutex_);
  return std::exchange(knocks_, {});
}

SoundReport SoundPlayer::report() const {
  return {static_cast<double>(frames_ - frames_before_) / rate_, underruns_ - underruns_before_,
          failed_ ? trouble_ : ""};
}

void SoundPlayer::play() noexcept {
  try {
    play_blocks();
  } catch (const std::exception& error) {
    trouble_ = error.what();
    on_ = false;
    failed_ = true;
  }
  output_.reset();
}

void SoundPlayer::play_blocks() {
  NoiseSignal noise(settings_.noise.value_or(protocols::MaskingNoise{}), rate_, settings_.seed);
  ToneSignal tone(tones_db_, rate_);
  ContactSound touched(rate_, latency_, settings_.seed);
  const std::size_t block = output_->buffer().block;
  std::vector<double> left(block), right(block);
  std::vector<std::int16_t> frames(2 * block);
  const auto pace = std::chrono::duration_cast<Clock::duration>(
      std::chrono::duration<double>(kPace * static_cast<double>(block) / rate_));
  Clock::time_point due = Clock::now();
  while (!quit_ || !noise.silent() || !tone.silent()) {
    output_->wait();
    noise.turn(on_ && has_noise());
    const bool heard = !noise.silent();
    noise.fill(left);
    if (const unsigned asked = tones_; asked != tones_begun_) {
      tones_begun_ = asked;
      tone.begin(tone_);
    }
    tone.add(left);
    right = left;
    if (settings_.ticks != nullptr) {
      {
        const std::lock_guard lock(mutex_);
        if (next_source_) touched.play(*std::exchange(next_source_, std::nullopt));
      }
      servo::HeardTick tick;
      while (settings_.ticks->pop(tick)) touched.hear(tick);
      touched.add(left, right, now_ns() + std::llround(1e9 * output_->latency()));
      if (const std::optional<Knock> knock = touched.take_knock()) {
        const std::lock_guard lock(mutex_);
        knocks_.push_back(*knock);
      }
    }
    for (std::size_t i = 0; i < block; ++i) {
      frames[2 * i] = to_sample(left[i]);
      frames[2 * i + 1] = to_sample(right[i]);
    }
    const int underruns = output_->write(frames);
    if (on_ || heard) underruns_ += underruns;
    if (heard) frames_ += block;
    due = std::max(due + pace, Clock::now());
    std::this_thread::sleep_until(due);
  }
}

std::string to_json_text(const SoundPlayer& player) {
  const SoundSettings& settings = player.settings();
  nlohmann::ordered_json event;
  if (settings.noise) {
    event = {{"masking_noise", "on"},
             {"kind", protocols::to_string(settings.noise->kind)},
             {"level_db", settings.noise->level_db},
             {"tones_level_db", player.tones_db()},
             {"seed", settings.seed}};
  } else {
    event = {{"sounds", "on"}, {"level_db", player.tones_db()}};
  }
  event["device"] = settings.device;
  event["rate_hz"] = player.rate();
  event["latency_s"] = player.latency();
  if (settings.noise) event["fade_s"] = kNoiseFade;
  return event.dump();
}

std::string to_json_text(const SoundReport& report) {
  nlohmann::ordered_json event = {
      {"masking_noise", "off"}, {"seconds", report.seconds}, {"underruns", report.underruns}};
  if (!report.trouble.empty()) event["trouble"] = report.trouble;
  return event.dump();
}

}  // namespace palpate::runner::sound
