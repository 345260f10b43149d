#include "runner/sound/sound_output.h"

namespace palpate::runner::sound {

std::unique_ptr<SoundOutput> open_sound(const std::string& device) {
  throw SoundError("no sound from '" + device +
                   "': this palpate was built without it; build it with libasound2-dev, or run "
                   "the session with --without-noise");
}

}  // namespace palpate::runner::sound
