#include <alsa/asoundlib.h>

#include <algorithm>
#include <cerrno>

#include "runner/sound/sound_output.h"

namespace palpate::runner::sound {
namespace {

constexpr unsigned kRate = 48000;         // Hz
constexpr unsigned kChannels = 2;         // the same on both ears
constexpr unsigned kBuffer_us = 200'000;  // longest delay of the player's thread without a gap

SoundError no_sound(const std::string& device, const std::string& what) {
  return SoundError("no sound from '" + device + "': " + what +
                    "\nplug in headphones and name them by --sound-device ('aplay -L' lists the "
                    "names); --without-noise runs the session without masking noise and sounds");
}

/// Suppresses ALSA's messages: the SoundError has the reason.
void ignore_message(const char*, int, const char*, int, const char*, ...) {}

class AlsaOutput final : public SoundOutput {
 public:
  explicit AlsaOutput(const std::string& device) : device_(device) {
    snd_lib_error_set_handler(&ignore_message);
    check(snd_pcm_open(&pcm_, device.c_str(), SND_PCM_STREAM_PLAYBACK, 0));
    const int error = snd_pcm_set_params(pcm_, SND_PCM_FORMAT_S16, SND_PCM_ACCESS_RW_INTERLEAVED,
                                         kChannels, kRate, 1, kBuffer_us);
    if (error < 0) {
      snd_pcm_close(pcm_);
      check(error);
    }
  }
  AlsaOutput(const AlsaOutput&) = delete;
  AlsaOutput& operator=(const AlsaOutput&) = delete;
  ~AlsaOutput() override {
    snd_pcm_drain(pcm_);  // plays the end of a fade
    snd_pcm_close(pcm_);
  }

  double rate() const override { return kRate; }

  int write(std::span<const std::int16_t> samples) override {
    int underruns = 0;
    while (!samples.empty()) {
      const snd_pcm_sframes_t written =
          snd_pcm_writei(pcm_, samples.data(), samples.size() / kChannels);
      if (written < 0) {
        if (written == -EPIPE) ++underruns;
        check(snd_pcm_recover(pcm_, static_cast<int>(written), 1));
        continue;
      }
      samples = samples.subspan(static_cast<std::size_t>(written) * kChannels);
    }
    return underruns;
  }

  double latency() override {
    snd_pcm_sframes_t frames = 0;
    if (snd_pcm_delay(pcm_, &frames) < 0) return 0;
    return static_cast<double>(std::max<snd_pcm_sframes_t>(0, frames)) / kRate;
  }

 private:
  void check(int result) const {
    if (result < 0) throw no_sound(device_, snd_strerror(result));
  }

  const std::string device_;
  snd_pcm_t* pcm_ = nullptr;
};

}  // namespace

std::unique_ptr<SoundOutput> open_sound(const std::string& device) {
  return std::make_unique<AlsaOutput>(device);
}

}  // namespace palpate::runner::sound
