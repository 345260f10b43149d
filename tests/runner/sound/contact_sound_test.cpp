// The sound of contacts as a signal: when it is heard, how loud, and for how long.

#include "runner/sound/contact_sound.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <numbers>
#include <string>
#include <vector>

#include "runner/sound/sound_output.h"

namespace palpate::runner::sound {
namespace {

constexpr double kRate = 48000, kLag = 0.004;  // Hz, s
constexpr std::size_t kBlock = 64;
constexpr std::int64_t kTick_ns = 1'000'000;

protocols::SoundSpec knock(std::vector<protocols::SoundSpec::Mode> modes, double gain = 0.1) {
  protocols::SoundSpec sound;
  sound.modes = std::move(modes);
  sound.gain = gain;
  return sound;
}

/// A tip that moves straight down onto the plane z = 0 and along it.
struct Hand {
  servo::HeardTick tick;
  explicit Hand(double height = 0.01) {
    tick.probe = {Vec3(0, 0, height), Vec3(0, 0, height + 0.1)};
  }
  servo::HeardTick move(const Vec3& by, double pressing = 0) {
    tick.time_ns += kTick_ns;
    tick.probe.tip += by;
    tick.probe.tail += by;
    tick.touching = tick.probe.tip.z <= 1e-12;
    tick.pressing = pressing;
    return tick;
  }
};

/// The sound, block by block, and the ticks that reach the sound before each.
struct Ear {
  ContactSound sound{kRate, kLag, 3};
  std::vector<double> left, right;
  std::vector<servo::HeardTick> waiting;
  /// \param late_ns  by which each block is asked for late
  void listen(double seconds, std::int64_t late_ns = 0) {
    const auto until = left.size() + static_cast<std::size_t>(seconds * kRate);
    while (left.size() < until) {
      // Played through a buffer of which one block is free: heard kLag less a block from now.
      const std::int64_t heard_ns = time_ns(left.size());
      const std::int64_t now_ns = heard_ns - std::llround(1e9 * (kLag - kBlock / kRate)) + late_ns;
      while (!waiting.empty() && waiting.front().time_ns <= now_ns) {
        sound.hear(waiting.front());
        waiting.erase(waiting.begin());
      }
      std::vector<double> l(kBlock), r(kBlock);
      sound.add(l, r, heard_ns + late_ns);
      left.insert(left.end(), l.begin(), l.end());
      right.insert(right.end(), r.begin(), r.end());
    }
  }
  static std::int64_t time_ns(std::size_t sample) {
    return std::llround(1e9 * static_cast<double>(sample) / kRate);
  }
  std::size_t first() const {
    for (std::size_t i = 0; i < left.size(); ++i)
      if (left[i] != 0 || right[i] != 0) return i;
    return left.size();
  }
};

/// Comes down at a speed (m/s) and touches at the tick with this number.
void come_down(Ear& ear, Hand& hand, double speed, int touches_at) {
  hand = Hand(speed * 1e-3 * touches_at);
  for (int i = 0; i < touches_at; ++i) ear.waiting.push_back(hand.move(Vec3(0, 0, -speed * 1e-3)));
}

std::shared_ptr<const SoundSource> source(const protocols::SoundSpec& sound) {
  return SoundSources(kRate).of(sound);
}

TEST(ContactSound, FollowsItsTickToTheSample) {
  for (int touches = 20; touches < 60; ++touches) {
    Ear ear;
    Hand hand;
    ear.sound.play(source(knock({{1000, 50, 1}})));
    come_down(ear, hand, 0.1, touches);
    ear.listen(0.1);
    // A sine begins with a sample of zero.
    const double heard = static_cast<double>(ear.first()) - 1;
    EXPECT_NEAR(heard, (touches * 1e-3 + kLag) * kRate, 1) << touches;
    EXPECT_NEAR(ear.sound.take_knock()->lag, kLag, 1.01 / kRate);
  }
}

TEST(ContactSound, IsTheSumOfDecayingSines) {
  const std::vector<protocols::SoundSpec::Mode> modes = {{900, 60, 1}, {2310, 200, 0.5}};
  Ear ear;
  Hand hand;
  ear.sound.play(source(knock(modes, 0.3)));
  come_down(ear, hand, 0.2, 30);
  ear.listen(0.3);
  const std::size_t begin = ear.first() - 1;
  for (std::size_t i = 0; i < 6000; ++i) {
    const double t = static_cast<double>(i) / kRate;
    double expected = 0;
    for (const auto& mode : modes)
      expected += 0.3 * 0.2 * mode.gain * std::exp(-mode.decay * t) *
                  std::sin(2 * std::numbers::pi * mode.frequency * t);
    ASSERT_NEAR(ear.left[begin + i], expected, 1e-9) << i;
    ASSERT_EQ(ear.left[begin + i], ear.right[begin + i]);
  }
}

TEST(ContactSound, IsNeverLouderThanItsLimit) {
  Ear ear;
  Hand hand;
  ear.sound.play(source(knock({{1000, 5, 1}, {1500, 5, 1}}, 100)));
  come_down(ear, hand, 3, 20);
  ear.listen(0.2);
  double peak = 0;
  for (const double x : ear.left) peak = std::max(peak, std::abs(x));
  EXPECT_LE(peak, std::pow(10, -12 / 20.0) + 1e-12);
  EXPECT_GT(peak, 0.2);
}

TEST(ContactSound, IsArmedAgainAfterTwentyMilliseconds) {
  for (const auto& [apart, knocks] : {std::pair{10, 1}, std::pair{19, 1}, std::pair{21, 2}}) {
    Ear ear;
    Hand hand;
    ear.sound.play(source(knock({{1000, 4000, 1}})));
    come_down(ear, hand, 0.1, 20);
    ear.waiting.push_back(hand.move(Vec3(0, 0, 0.002)));
    for (int i = 0; i < apart - 2; ++i) ear.waiting.push_back(hand.move(Vec3(0)));
    ear.waiting.push_back(hand.move(Vec3(0, 0, -0.002)));
    int found = 0;
    for (int i = 0; i < 60; ++i) {
      ear.listen(0.0014);
      found += ear.sound.take_knock().has_value();
    }
    EXPECT_EQ(found, knocks) << apart;
  }
}

TEST(ContactSound, IsSilentWhereTheSceneBeginsInContact) {
  Ear ear;
  Hand hand(0);
  ear.sound.play(source(knock({{1000, 50, 1}})));
  for (int i = 0; i < 30; ++i) ear.waiting.push_back(hand.move(Vec3(0)));
  ear.listen(0.1);
  EXPECT_EQ(ear.first(), ear.left.size());
}

TEST(ContactSound, SaysHowLateItIs) {
  Ear ear;
  Hand hand;
  ear.sound.play(source(knock({{1000, 50, 1}})));
  come_down(ear, hand, 0.1, 20);
  ear.listen(0.1, 60 * kTick_ns);  // the thread stood still until 60 ms, 40 ms after the contact
  EXPECT_NEAR(ear.sound.take_knock()->lag, 0.04, 1.01 / kRate);
}

TEST(ContactSound, KeepsItsDelayOutOfTheLag) {
  Ear ear;
  Hand hand;
  protocols::SoundSpec late = knock({{1000, 50, 1}});
  late.delay = 0.05;
  late.pan = -1;
  ear.sound.play(source(late));
  come_down(ear, hand, 0.1, 20);
  ear.listen(0.2);
  EXPECT_NEAR(static_cast<double>(ear.first()) - 1, (0.02 + kLag + 0.05) * kRate, 1);
  EXPECT_NEAR(ear.sound.take_knock()->lag, kLag, 1.01 / kRate);
  for (const double x : ear.right) ASSERT_EQ(x, 0);
}

TEST(ContactSound, ScrapesAsLoudAsThePowerOfSliding) {
  for (const double speed : {0.05, 0.1}) {
    Ear ear;
    Hand hand(0);
    protocols::SoundSpec scraping = knock({{600, 300, 1}}, 0);
    scraping.scrape = 0.4;
    ear.sound.play(source(scraping));
    for (int i = 0; i < 3000; ++i) ear.waiting.push_back(hand.move(Vec3(speed * 1e-3, 0, 0), 1.5));
    ear.listen(2.9);
    double sum = 0;
    const std::size_t from = 10000;
    for (std::size_t i = from; i < ear.left.size(); ++i) sum += ear.left[i] * ear.left[i];
    const double rms = std::sqrt(sum / static_cast<double>(ear.left.size() - from));
    EXPECT_NEAR(rms, 0.4 * speed * 1.5, 0.05 * 0.4 * speed * 1.5);
    ear.listen(1);  // the ticks have ended, and so has the sound
    for (std::size_t i = ear.left.size() - 1000; i < ear.left.size(); ++i)
      ASSERT_LT(std::abs(ear.left[i]), 1e-4);
    EXPECT_TRUE(ear.sound.silent());
  }
}

TEST(ContactSound, HearsAPushWithoutSlidingAsNothing) {
  Ear ear;
  Hand hand(0);
  protocols::SoundSpec scraping = knock({{600, 300, 1}}, 0);
  scraping.scrape = 1;
  ear.sound.play(source(scraping));
  for (int i = 0; i < 300; ++i) ear.waiting.push_back(hand.move(Vec3(0, 0, -1e-5), 3));
  ear.listen(0.3);
  EXPECT_EQ(ear.first(), ear.left.size());
}

/// A WAV file of 16 bit, one channel.
std::string wav(const std::vector<double>& samples, std::uint32_t rate) {
  std::string out = "RIFF";
  const auto put = [&](auto value) {
    char bytes[sizeof value];
    std::memcpy(bytes, &value, sizeof value);
    out.append(bytes, sizeof value);
  };
  const auto size = static_cast<std::uint32_t>(2 * samples.size());
  put(std::uint32_t{36 + size});
  out += "WAVEfmt ";
  put(std::uint32_t{16});
  put(std::uint16_t{1});
  put(std::uint16_t{1});
  put(rate);
  put(std::uint32_t{2 * rate});
  put(std::uint16_t{2});
  put(std::uint16_t{16});
  out += "data";
  put(size);
  for (const double x : samples) put(static_cast<std::int16_t>(std::lround(32767 * x)));
  return out;
}

protocols::SoundSpec recording(const std::string& bytes) {
  protocols::SoundSpec sound;
  sound.file_name = "tap.wav";
  sound.file_bytes = std::make_shared<const std::string>(bytes);
  return sound;
}

TEST(ContactSound, PlaysARecordingAtItsPitch) {
  for (const std::uint32_t rate : {48000U, 44100U, 22050U}) {
    std::vector<double> tone(rate / 10);
    for (std::size_t i = 0; i < tone.size(); ++i)
      tone[i] = 0.5 * std::sin(2 * std::numbers::pi * 500 * static_cast<double>(i) / rate);
    const auto played = source(recording(wav(tone, rate)));
    ASSERT_NEAR(static_cast<double>(played->samples.size()), 4800, 2);
    for (std::size_t i = 500; i < 4300; ++i)
      ASSERT_NEAR(played->samples[i],
                  0.5 * std::sin(2 * std::numbers::pi * 500 * static_cast<double>(i) / kRate), 0.01)
          << rate << " " << i;
    Ear ear;
    Hand hand;
    ear.sound.play(played);
    come_down(ear, hand, 0.1, 20);
    ear.listen(0.2);
    double peak = 0;
    for (const double x : ear.left) peak = std::max(peak, std::abs(x));
    EXPECT_NEAR(peak, 0.1 * 0.5, 0.002);
    EXPECT_TRUE(ear.sound.silent()) << "it ends with the recording";
  }
}

TEST(ContactSound, RefusesWhatIsNoRecording) {
  const auto refused = [](const std::string& bytes) {
    try {
      source(recording(bytes));
    } catch (const SoundError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_NE(refused("RIFF nonsense").find("tap.wav"), std::string::npos);
  EXPECT_NE(refused("").find("expected a WAV"), std::string::npos);
  EXPECT_NE(
      refused(wav(std::vector<double>(500000, 0.1), 48000 - 3)).find("at most 10 s, found 10"),
      std::string::npos);
  EXPECT_NE(refused(wav({}, 48000)).find("at least one sample"), std::string::npos);
  const std::string whole = wav(std::vector<double>(4800, 0.1), 48000);
  for (std::size_t cut = 0; cut < whole.size(); cut += 7) {
    try {
      source(recording(whole.substr(0, cut)));
    } catch (const SoundError&) {  // but nothing else
    }
  }
}

}  // namespace
}  // namespace palpate::runner::sound
