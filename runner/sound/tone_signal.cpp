#include "runner/sound/tone_signal.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace palpate::runner::sound {
namespace {

constexpr double kLength = 0.1, kEdge = 0.01;  // s, of a part

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

}  // namespace

ToneSignal::ToneSignal(double level_db, double rate)
    : amplitude_(std::sqrt(2) * std::pow(10, level_db / 20)), rate_(rate) {}

void ToneSignal::begin(Tone tone) {
  older_ = newest_;
  older_.over = std::min(older_.over, older_.at + kEdge);
  newest_ = {pitches_of(tone), 0, 0};
  for (const double pitch : newest_.pitches) newest_.over += pitch > 0 ? kLength : 0;
}

void ToneSignal::add(std::span<double> samples) {
  for (double& sample : samples) sample += next(older_) + next(newest_);
}

double ToneSignal::next(Playing& tone) const {
  if (tone.at >= tone.over) return 0;
  const std::size_t part = tone.at < kLength ? 0 : 1;
  const double at = tone.at - (part == 0 ? 0 : kLength);
  const double edge =
      std::min({1.0, at / kEdge, (kLength - at) / kEdge, (tone.over - tone.at) / kEdge});
  tone.at += 1 / rate_;
  return amplitude_ * std::max(edge, 0.0) *
         std::sin(2 * std::numbers::pi * tone.pitches[part] * at);
}

}  // namespace palpate::runner::sound
