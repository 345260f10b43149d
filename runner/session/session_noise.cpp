#include "runner/session/session_noise.h"

namespace palpate::runner {

bool SessionNoise::start() {
  if (station_.noise == nullptr || on_record_) return true;
  try {
    station_.noise->turn_on();
  } catch (const SoundError& error) {
    say_(error.what());
    return false;
  }
  on_record_ = true;
  station_.record.note(station_.clock.now_ns(), to_json_text(*station_.noise));
  return true;
}

void SessionNoise::stop() {
  if (!on_record_) return;
  on_record_ = false;
  station_.noise->turn_off();
  const NoiseReport heard = station_.noise->report();
  if (station_.noise->has_noise())
    station_.record.note(station_.clock.now_ns(), to_json_text(heard));
  if (heard.underruns > 0)
    say_("the masking noise had " + std::to_string(heard.underruns) + " gaps");
}

bool SessionNoise::has_failed() {
  if (!on_record_ || !station_.noise->failed()) return false;
  say_(station_.noise->report().trouble);
  stop();
  return true;
}

void SessionNoise::go_tone() {
  const auto& sounds = station_.protocol.sounds;
  if (station_.noise != nullptr && (station_.protocol.masking_noise || (sounds && sounds->go)))
    station_.noise->tone();
}

void SessionNoise::cue(SoundCue cue) {
  const auto& sounds = station_.protocol.sounds;
  if (station_.noise == nullptr || !sounds) return;
  if (cue == SoundCue::ready && sounds->ready) station_.noise->tone(Tone::ready);
  if (cue == SoundCue::right && sounds->feedback) station_.noise->tone(Tone::right);
  if (cue == SoundCue::wrong && sounds->feedback) station_.noise->tone(Tone::wrong);
}

}  // namespace palpate::runner
