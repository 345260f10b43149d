#include "runner/sound/noise_signal.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <vector>

namespace palpate::runner::sound {
namespace {

constexpr double kRate = 48000;  // Hz
constexpr double kPi = 3.14159265358979323846;

std::vector<double> noise(protocols::NoiseKind kind, double level, double seconds,
                          std::uint64_t seed = 3) {
  NoiseSignal signal({kind, level}, kRate, seed);
  signal.turn(true);
  std::vector<double> samples(static_cast<std::size_t>((seconds + kNoiseFade) * kRate));
  signal.fill(samples);
  samples.erase(samples.begin(), samples.begin() + static_cast<int>(kNoiseFade * kRate));
  return samples;
}

double level_of(const std::vector<double>& samples) {
  double sum = 0;
  for (const double x : samples) sum += x * x;
  return 10 * std::log10(sum / static_cast<double>(samples.size()));
}

double largest(std::span<const double> samples) {
  double most = 0;
  for (const double x : samples) most = std::max(most, std::abs(x));
  return most;
}

double largest_step(std::span<const double> samples) {
  double most = 0;
  for (std::size_t i = 1; i < samples.size(); ++i)
    most = std::max(most, std::abs(samples[i] - samples[i - 1]));
  return most;
}

/// dB of the density of power near a frequency, Welch's method with a Hann window.
double density(const std::vector<double>& samples, double frequency) {
  constexpr int kLength = 4096;
  const double width = kRate / kLength;
  const int first = static_cast<int>(std::ceil(0.9 * frequency / width));
  const int last = static_cast<int>(1.1 * frequency / width);
  const int stride = std::max(1, (last - first) / 8);
  double sum = 0;
  int count = 0;
  for (int bin = first; bin <= last; bin += stride) {
    const std::complex<double> turn = std::polar(1.0, -2 * kPi * bin / kLength);
    for (std::size_t start = 0; start + kLength <= samples.size(); start += kLength) {
      std::complex<double> total, phase = 1;
      for (int i = 0; i < kLength; ++i) {
        const double window = 0.5 - 0.5 * std::cos(2 * kPi * i / kLength);
        total += window * samples[start + static_cast<std::size_t>(i)] * phase;
        phase *= turn;
      }
      sum += std::norm(total);
      ++count;
    }
  }
  return 10 * std::log10(sum / count);
}

TEST(NoiseSignal, HasTheRequestedLevel) {
  for (const protocols::NoiseKind kind :
       {protocols::NoiseKind::white, protocols::NoiseKind::pink}) {
    for (const double level : {-12.0, -24.0, -60.0}) {
      EXPECT_NEAR(level_of(noise(kind, level, 20)), level, 0.2) << protocols::to_string(kind);
    }
  }
}

TEST(NoiseSignal, PinkFallsByThreeDecibelAnOctave) {
  for (const protocols::NoiseKind kind :
       {protocols::NoiseKind::white, protocols::NoiseKind::pink}) {
    const std::vector<double> samples = noise(kind, -20, 12);
    const double at_1000 = density(samples, 1000);
    for (int octave = -3; octave <= 3; ++octave) {
      const double fall =
          kind == protocols::NoiseKind::pink ? 10 * std::log10(std::pow(2, -octave)) : 0;
      EXPECT_NEAR(density(samples, 1000 * std::pow(2, octave)) - at_1000, fall, 0.8)
          << protocols::to_string(kind) << ", " << octave << " octaves from 1000 Hz";
    }
  }
}

TEST(NoiseSignal, TurnsOnAndOffWithoutAClick) {
  for (const protocols::NoiseKind kind :
       {protocols::NoiseKind::white, protocols::NoiseKind::pink}) {
    NoiseSignal signal({kind, -12}, kRate, 5);
    std::vector<double> before(960), rise(960), steady(48000), fall(48000);
    EXPECT_TRUE(signal.silent());
    signal.fill(before);
    EXPECT_EQ(largest(before), 0);
    signal.turn(true);
    signal.fill(rise);
    EXPECT_FALSE(signal.silent());
    EXPECT_GT(largest(rise), 0);
    // A twentieth of a raised cosine's way up is 0.6 % of its height.
    EXPECT_LT(largest(std::span(rise).first(480)), 0.01);
    signal.fill(steady);
    signal.turn(false);
    signal.fill(fall);
    EXPECT_TRUE(signal.silent());
    const auto faded = static_cast<std::size_t>(kNoiseFade * kRate);
    EXPECT_GT(largest(std::span(fall).first(480)), 0.05) << "not at once";
    EXPECT_LT(largest(std::span(fall).subspan(faded - 480, 480)), 0.01);
    EXPECT_EQ(largest(std::span(fall).subspan(faded + 1)), 0);
    EXPECT_LE(largest_step(fall), largest_step(steady));
    EXPECT_LE(largest_step(rise), largest_step(steady));
  }
}

TEST(NoiseSignal, AFadeCanBeReversed) {
  NoiseSignal signal({protocols::NoiseKind::white, -20}, kRate, 5);
  std::vector<double> first(9600), half(4800), last(9600);
  signal.turn(true);
  signal.fill(first);
  signal.turn(false);
  signal.fill(half);
  signal.turn(true);
  signal.fill(last);
  const auto start = std::span(last).first(480);
  EXPECT_NEAR(largest(start) / largest(first), 0.5, 0.1);
  EXPECT_NEAR(level_of(std::vector(last.end() - 4000, last.end())), -20, 0.5);
}

TEST(NoiseSignal, IsDeterministicFromItsSeed) {
  EXPECT_EQ(noise(protocols::NoiseKind::pink, -20, 0.1),
            noise(protocols::NoiseKind::pink, -20, 0.1));
  EXPECT_NE(noise(protocols::NoiseKind::pink, -20, 0.1),
            noise(protocols::NoiseKind::pink, -20, 0.1, 4));
}

}  // namespace
}  // namespace palpate::runner::sound
