#include "runner/sound/sound_source.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "runner/sound/sound_file.h"

namespace palpate::runner::sound {

double SoundSource::peak() const {
  double peak = 0;
  for (const Mode& mode : modes) peak += mode.gain;
  for (const double sample : samples) peak = std::max(peak, std::abs(sample));
  return peak;
}

std::shared_ptr<const SoundSource> SoundSources::of(const protocols::SoundSpec& sound) {
  auto out = std::make_shared<SoundSource>();
  for (const protocols::SoundSpec::Mode& mode : sound.modes) {
    if (mode.frequency >= rate_ / 2) continue;  // an output cannot play it
    const double angle = 2 * std::numbers::pi * mode.frequency / rate_;
    out->modes.push_back({std::polar(std::exp(-mode.decay / rate_), angle), mode.gain});
  }
  if (sound.file_bytes) {
    auto known = recordings_.find(sound.file_name);
    if (known == recordings_.end())
      known =
          recordings_
              .emplace(sound.file_name, read_sound_file(*sound.file_bytes, sound.file_name, rate_))
              .first;
    out->samples = known->second;
  }
  out->gain = sound.gain;
  out->scrape = sound.scrape;
  out->delay = sound.delay;
  out->left = std::min(1.0, 1 - sound.pan);
  out->right = std::min(1.0, 1 + sound.pan);
  return out;
}

}  // namespace palpate::runner::sound
