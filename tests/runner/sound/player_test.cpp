// The player's thread, with a scripted output.

#include "runner/sound/player.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <mutex>
#include <thread>
#include <vector>

#include "runner/sound/noise_signal.h"

namespace palpate::runner::sound {
namespace {

/// The output, and faults to inject; outlives the outputs.
struct Ear {
  std::mutex mutex;
  std::vector<std::int16_t> heard;
  std::atomic<bool> pulled{false};   ///< the headphones
  std::atomic<int> gaps{0};          ///< to be reported by the next write
  std::atomic<bool> held_up{false};  ///< takes nothing
  int opened = 0;

  std::size_t count() {
    const std::lock_guard lock(mutex);
    return heard.size();
  }
  bool sounds() {  // lately
    const std::lock_guard lock(mutex);
    const std::size_t part = std::min<std::size_t>(heard.size(), 200);
    return std::any_of(heard.end() - static_cast<std::ptrdiff_t>(part), heard.end(),
                       [](std::int16_t x) { return x != 0; });
  }
};

class Headphones final : public SoundOutput {
 public:
  explicit Headphones(Ear& ear) : ear_(ear) {}
  double rate() const override { return 8000; }
  SoundBuffer buffer() const override { return {160, 2}; }
  void wait() override {}
  int write(std::span<const std::int16_t> samples) override {
    while (true) {
      if (ear_.pulled) throw SoundError("pulled out");
      if (ear_.held_up) continue;
      const std::lock_guard lock(ear_.mutex);
      ear_.heard.insert(ear_.heard.end(), samples.begin(), samples.end());
      return ear_.gaps.exchange(0);
    }
  }
  double latency() override { return 0.01; }

 private:
  Ear& ear_;
};

template <class Condition>
void wait_for(const Condition& condition) {
  while (!condition()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

class Players : public ::testing::Test {
 protected:
  SoundSettings settings(double level_db) {
    SoundSettings out{.device = "ear"};
    out.noise = protocols::MaskingNoise{protocols::NoiseKind::white, level_db};
    out.seed = 1;
    out.open = [this](const std::string&, const SoundBuffer&) {
      ++ear_.opened;
      if (ear_.pulled) throw SoundError("pulled out");
      return std::make_unique<Headphones>(ear_);
    };
    return out;
  }
  std::unique_ptr<SoundPlayer> player() { return std::make_unique<SoundPlayer>(settings(-20)); }
  Ear ear_;
};

TEST_F(Players, PlaySilenceUntilTurnedOn) {
  const auto noise = player();
  wait_for([&] { return ear_.count() > 2000; });
  EXPECT_FALSE(ear_.sounds());
  noise->turn_on();
  wait_for([&] { return ear_.sounds(); });
  wait_for([&] { return noise->report().seconds > 0.3; });
  noise->turn_off();
  wait_for([&] { return !ear_.sounds(); });
  const double seconds = noise->report().seconds;
  EXPECT_GT(seconds, 0.3 + kNoiseFade - 0.03);
  EXPECT_EQ(noise->report().underruns, 0);
}

TEST_F(Players, PlayOneToneOnRequest) {
  const auto noise = player();
  for (int i = 0; i < 2; ++i) {
    const std::size_t before = ear_.count();
    noise->tone();
    const auto heard = [&] {
      const std::lock_guard lock(ear_.mutex);
      return std::count_if(ear_.heard.begin() + static_cast<std::ptrdiff_t>(before),
                           ear_.heard.end(), [](std::int16_t x) { return x != 0; });
    };
    wait_for([&] { return heard() > 1000 && !ear_.sounds(); });
    EXPECT_NEAR(static_cast<double>(heard()), 2 * 0.1 * 8000, 50);  // a sine crosses zero
  }
  EXPECT_FALSE(noise->on());
}

// A sine of amplitude a and pitch f moves by 2 pi f a / rate a sample at most; its edges of 10 ms
// add a / (0.01 rate). Cut off in the middle it would jump by up to a.
TEST_F(Players, AToneThatInterruptsAnotherDoesNotClick) {
  constexpr double kRate = 8000, kTonesDb = -12;
  const auto slope = [&](double pitch) {
    const double amplitude = std::sqrt(2.0) * std::pow(10, kTonesDb / 20);
    return amplitude * (2 * M_PI * pitch + 1 / 0.01) / kRate;
  };
  for (int i = 0; i < 8; ++i) {
    SoundSettings quiet = settings(-60);
    quiet.tones_db = kTonesDb;
    auto noise = std::make_unique<SoundPlayer>(std::move(quiet));
    const auto before = static_cast<std::ptrdiff_t>(ear_.count());
    const auto heard = [&] { return static_cast<std::ptrdiff_t>(ear_.count()) - before; };
    noise->tone(Tone::ready);
    const auto part = static_cast<std::ptrdiff_t>(2 * 0.02 * kRate);  // a block
    wait_for([&] { return heard() >= (2 + i % 4) * part; });
    noise->tone(Tone::wrong);
    wait_for([&] { return heard() >= (4 + i) * part; });
    noise.reset();
    double largest = 0, last = 0;
    const std::lock_guard lock(ear_.mutex);
    for (std::size_t k = static_cast<std::size_t>(before); k < ear_.heard.size(); k += 2) {
      const double now = ear_.heard[k] / 32767.0;
      largest = std::max(largest, std::abs(now - last));
      last = now;
    }
    EXPECT_LT(std::max(largest, std::abs(last)), slope(440) + slope(220));
    EXPECT_GT(largest, slope(220) / 4) << "tones have a level of their own";
  }
}

TEST_F(Players, PlayTheSameSignalOnBothChannels) {
  const auto noise = player();
  noise->turn_on();
  wait_for([&] { return noise->report().seconds > 0.1; });
  const std::lock_guard lock(ear_.mutex);
  for (std::size_t i = 0; i < ear_.heard.size(); i += 2)
    ASSERT_EQ(ear_.heard[i], ear_.heard[i + 1]);
}

TEST_F(Players, FadeOutOnDestruction) {
  {
    const auto noise = player();
    noise->turn_on();
    wait_for([&] { return noise->report().seconds > 0.3; });
  }
  EXPECT_FALSE(ear_.sounds());
  int loudest = 0, last = 0;  // of the last 2 ms before the silence
  const auto sound =
      std::find_if(ear_.heard.rbegin(), ear_.heard.rend(), [](std::int16_t x) { return x != 0; });
  for (int i = 0; i < 32; ++i) last = std::max(last, std::abs(int{*(sound + i)}));
  for (const std::int16_t x : ear_.heard) loudest = std::max(loudest, std::abs(int{x}));
  EXPECT_LT(last, loudest / 100);
}

TEST_F(Players, CountGapsWhileOn) {
  const auto noise = player();
  ear_.gaps = 1;
  wait_for([&] { return ear_.gaps == 0; });
  noise->turn_on();
  wait_for([&] { return ear_.sounds(); });
  EXPECT_EQ(noise->report().underruns, 0);
  ear_.gaps = 2;
  wait_for([&] { return noise->report().underruns == 2; });
}

TEST_F(Players, ReportAFailureAndReopen) {
  const auto noise = player();
  noise->turn_on();
  wait_for([&] { return ear_.sounds(); });
  ear_.pulled = true;
  wait_for([&] { return noise->failed(); });
  EXPECT_EQ(noise->report().trouble, "pulled out");
  EXPECT_THROW(noise->turn_on(), SoundError);
  EXPECT_TRUE(noise->failed());
  ear_.pulled = false;
  const std::size_t before = ear_.count();
  noise->turn_on();
  EXPECT_FALSE(noise->failed());
  wait_for([&] { return ear_.count() > before && ear_.sounds(); });
  EXPECT_EQ(noise->report().trouble, "");
  EXPECT_EQ(ear_.opened, 3);
}

TEST_F(Players, DoNotBlockWhenTheOutputHangs) {
  const auto noise = player();
  ear_.held_up = true;
  noise->turn_on();  // all return at once, otherwise this test never ends
  noise->turn_off();
  noise->turn_on();
  EXPECT_LT(noise->report().seconds, 1);
  ear_.held_up = false;
}

TEST(SoundPlayer, WithoutAnOutputItThrows) {
  EXPECT_THROW(SoundPlayer(SoundSettings{.device = "no such device"}), SoundError);
}

}  // namespace
}  // namespace palpate::runner::sound
