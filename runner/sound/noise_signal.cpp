#include "runner/sound/noise_signal.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace palpate::runner::sound {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kLowest = 10;          // Hz, first pole: below it pink noise is flat
constexpr double kLongEnough = 1;       // s; the slowest pole has decayed to e^-60
constexpr double kEvenPower = 1.0 / 3;  // mean square of uniform numbers in -1..1

double in_z_plane(double frequency, double rate) { return std::exp(-2 * kPi * frequency / rate); }

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

}  // namespace palpate::runner::sound
