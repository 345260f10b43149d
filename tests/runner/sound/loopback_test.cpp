// The latency of contacts, measured through a cable that is not there.

#include "runner/sound/loopback.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <mutex>
#include <thread>
#include <vector>

namespace palpate::runner::sound {
namespace {

constexpr double kRate = 48000;  // Hz

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// A card whose output is heard at its input a known time later.
class Cable {
 public:
  explicit Cable(double extra) : extra_(extra), began_(now()) {}

  /// s, until the sample with this number is played
  double until(std::size_t sample) const {
    return began_ + static_cast<double>(sample) / kRate - now();
  }
  void play(std::span<const std::int16_t> frames) {
    const std::lock_guard lock(mutex_);
    // A late sound is played late: silence in between.
    while (until(samples_.size()) < 0) samples_.push_back(0);
    for (std::size_t i = 0; i < frames.size(); i += 2) samples_.push_back(frames[i]);
  }
  std::size_t written() const {
    const std::lock_guard lock(mutex_);
    return samples_.size();
  }
  std::int16_t captured(std::size_t sample) const {
    const auto at = static_cast<std::ptrdiff_t>(sample) - std::lround(extra_ * kRate);
    const std::lock_guard lock(mutex_);
    if (cut_ || at < 0 || at >= static_cast<std::ptrdiff_t>(samples_.size())) return 0;
    return samples_[static_cast<std::size_t>(at)];
  }
  void cut() { cut_ = true; }

 private:
  const double extra_, began_;
  mutable std::mutex mutex_;
  std::vector<std::int16_t> samples_;
  bool cut_ = false;
};

class Output final : public SoundOutput {
 public:
  explicit Output(Cable& cable) : cable_(cable) {}
  double rate() const override { return kRate; }
  SoundBuffer buffer() const override { return {64, 4}; }
  void wait() override {
    while (latency() > 3 * 64 / kRate) std::this_thread::sleep_for(std::chrono::microseconds(50));
  }
  int write(std::span<const std::int16_t> frames) override {
    cable_.play(frames);
    return 0;
  }
  double latency() override { return std::max(0.0, cable_.until(cable_.written())); }

 private:
  Cable& cable_;
};

class Input final : public SoundInput {
 public:
  explicit Input(Cable& cable) : cable_(cable) {
    while (cable_.until(read_) < 0) ++read_;
  }
  double rate() const override { return kRate; }
  double read(std::span<std::int16_t> samples) override {
    while (cable_.until(read_ + samples.size()) > 0)
      std::this_thread::sleep_for(std::chrono::microseconds(100));
    for (std::int16_t& sample : samples) sample = cable_.captured(read_++);
    return -cable_.until(read_ - 1);
  }

 private:
  Cable& cable_;
  std::size_t read_ = 0;
};

TEST(Loopback, FindsTheLatencyOfTheCable) {
  for (const double extra : {0.0, 0.017}) {
    Cable cable(extra);
    servo::HeardTicks ticks(256);
    SoundSettings settings{.device = "cable"};
    settings.ticks = &ticks;
    settings.open = [&](const std::string&, const SoundBuffer&) {
      return std::make_unique<Output>(cable);
    };
    SoundPlayer player(std::move(settings));
    Input input(cable);
    const LoopbackTiming timing = measure_loopback(player, ticks, input, 10);
    EXPECT_EQ(timing.clicks, 10);
    EXPECT_EQ(timing.missed, 0);
    EXPECT_NEAR(timing.median, player.latency() + extra, 0.0005);
    EXPECT_GE(timing.p99, timing.median);
  }
}

TEST(Loopback, CountsWhatIsNotHeard) {
  Cable cable(0);
  cable.cut();
  servo::HeardTicks ticks(256);
  SoundSettings settings{.device = "cable"};
  settings.ticks = &ticks;
  settings.open = [&](const std::string&, const SoundBuffer&) {
    return std::make_unique<Output>(cable);
  };
  SoundPlayer player(std::move(settings));
  Input input(cable);
  const LoopbackTiming timing = measure_loopback(player, ticks, input, 3);
  EXPECT_EQ(timing.clicks, 3);
  EXPECT_EQ(timing.missed, 3);
}

}  // namespace
}  // namespace palpate::runner::sound
