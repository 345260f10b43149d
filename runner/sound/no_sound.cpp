#include "runner/sound/sound_file.h"
#include "runner/sound/sound_output.h"

namespace palpate::runner::sound {
namespace {

constexpr const char* kRemedy =
    "this palpate was built without it; build it with libasound2-dev, libsndfile1-dev and "
    "libsamplerate0-dev, or run the session with --without-noise";

}  // namespace

std::unique_ptr<SoundOutput> open_sound(const std::string& device, const SoundBuffer&) {
  throw SoundError("no sound from '" + device + "': " + kRemedy);
}

std::unique_ptr<SoundInput> open_sound_input(const std::string& device) {
  throw SoundError("no sound into '" + device + "': " + kRemedy);
}

std::vector<double> read_sound_file(const std::string&, const std::string& name, double) {
  throw SoundError("sound file '" + name + "': " + kRemedy);
}

}  // namespace palpate::runner::sound
