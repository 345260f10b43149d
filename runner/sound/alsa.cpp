#include <alsa/asoundlib.h>

#include <algorithm>
#include <cerrno>
#include <memory>
#include <utility>

#include "runner/sound/sound_output.h"

namespace palpate::runner::sound {
namespace {

constexpr unsigned kRate = 48000;               // Hz
constexpr unsigned kChannels = 2;               // of an output
constexpr int kPatience_ms = 1000;              // for a card that takes nothing
constexpr snd_pcm_uframes_t kInputBlock = 256;  // frames

SoundError no_sound(const std::string& device, const std::string& what) {
  return SoundError("no sound from '" + device + "': " + what +
                    "\nplug in headphones and name them by --sound-device ('aplay -L' lists the "
                    "names); --without-noise runs the session without masking noise and sounds");
}

SoundError no_input(const std::string& device, const std::string& what) {
  return SoundError("no sound into '" + device + "': " + what + "\n'arecord -L' lists the names");
}

/// Suppresses ALSA's messages: the SoundError has the reason.
void ignore_message(const char*, int, const char*, int, const char*, ...) {}

struct Close {
  void operator()(snd_pcm_t* pcm) const { snd_pcm_close(pcm); }
};
using Pcm = std::unique_ptr<snd_pcm_t, Close>;

/// 0, or the first error.
int open_pcm(const std::string& device, snd_pcm_stream_t direction, Pcm& pcm) {
  snd_lib_error_set_handler(&ignore_message);
  snd_pcm_t* opened = nullptr;
  const int error = snd_pcm_open(&opened, device.c_str(), direction, 0);
  pcm.reset(opened);
  return error;
}

/// Asks for a format and the nearest block and buffer that the card has. \return 0 or an error
int configure(snd_pcm_t* pcm, unsigned channels, snd_pcm_uframes_t& block,
              snd_pcm_uframes_t& buffer) {
  snd_pcm_hw_params_t* hardware = nullptr;
  snd_pcm_hw_params_alloca(&hardware);
  int error = snd_pcm_hw_params_any(pcm, hardware);
  unsigned rate = kRate;
  const auto ask = [&](int result) { error = error < 0 ? error : result; };
  ask(snd_pcm_hw_params_set_rate_resample(pcm, hardware, 1));
  ask(snd_pcm_hw_params_set_access(pcm, hardware, SND_PCM_ACCESS_RW_INTERLEAVED));
  ask(snd_pcm_hw_params_set_format(pcm, hardware, SND_PCM_FORMAT_S16));
  ask(snd_pcm_hw_params_set_channels(pcm, hardware, channels));
  ask(snd_pcm_hw_params_set_rate(pcm, hardware, rate, 0));
  ask(snd_pcm_hw_params_set_period_size_near(pcm, hardware, &block, nullptr));
  ask(snd_pcm_hw_params_set_buffer_size_near(pcm, hardware, &buffer));
  ask(snd_pcm_hw_params(pcm, hardware));
  if (error < 0) return error;
  ask(snd_pcm_get_params(pcm, &buffer, &block));
  snd_pcm_sw_params_t* software = nullptr;
  snd_pcm_sw_params_alloca(&software);
  ask(snd_pcm_sw_params_current(pcm, software));
  ask(snd_pcm_sw_params_set_avail_min(pcm, software, block));
  if (snd_pcm_stream(pcm) == SND_PCM_STREAM_PLAYBACK)
    ask(snd_pcm_sw_params_set_start_threshold(pcm, software, buffer / block * block));
  ask(snd_pcm_sw_params(pcm, software));
  return error;
}

class AlsaOutput final : public SoundOutput {
 public:
  AlsaOutput(const std::string& device, const SoundBuffer& wanted) : device_(device) {
    check(open_pcm(device, SND_PCM_STREAM_PLAYBACK, pcm_));
    block_ = wanted.block;
    buffer_ = snd_pcm_uframes_t{wanted.block} * wanted.blocks;
    check(configure(pcm_.get(), kChannels, block_, buffer_));
  }
  AlsaOutput(const AlsaOutput&) = delete;
  AlsaOutput& operator=(const AlsaOutput&) = delete;
  ~AlsaOutput() override {
    snd_pcm_drain(pcm_.get());  // plays the end of a fade
  }

  double rate() const override { return kRate; }
  SoundBuffer buffer() const override {
    return {static_cast<unsigned>(block_),
            static_cast<unsigned>(std::max<snd_pcm_uframes_t>(1, buffer_ / block_))};
  }

  void wait() override {
    if (snd_pcm_state(pcm_.get()) != SND_PCM_STATE_RUNNING) return;
    const int result = snd_pcm_wait(pcm_.get(), kPatience_ms);
    if (result == 0) throw no_sound(device_, "it has stopped");
    if (result < 0) recover(result);
  }

  int write(std::span<const std::int16_t> samples) override {
    while (!samples.empty()) {
      const snd_pcm_sframes_t written =
          snd_pcm_writei(pcm_.get(), samples.data(), samples.size() / kChannels);
      if (written < 0) {
        recover(static_cast<int>(written));
        continue;
      }
      samples = samples.subspan(static_cast<std::size_t>(written) * kChannels);
    }
    return std::exchange(underruns_, 0);
  }

  double latency() override {
    snd_pcm_sframes_t frames = 0;
    if (snd_pcm_delay(pcm_.get(), &frames) < 0) return 0;
    return static_cast<double>(std::max<snd_pcm_sframes_t>(0, frames)) / kRate;
  }

 private:
  void check(int result) const {
    if (result < 0) throw no_sound(device_, snd_strerror(result));
  }
  void recover(int error) {
    if (error == -EPIPE) ++underruns_;
    check(snd_pcm_recover(pcm_.get(), error, 1));
  }

  const std::string device_;
  Pcm pcm_;
  snd_pcm_uframes_t block_ = 0, buffer_ = 0;
  int underruns_ = 0;
};

class AlsaInput final : public SoundInput {
 public:
  explicit AlsaInput(const std::string& device) : device_(device) {
    check(open_pcm(device, SND_PCM_STREAM_CAPTURE, pcm_));
    snd_pcm_uframes_t block = kInputBlock, buffer = 16 * kInputBlock;
    check(configure(pcm_.get(), 1, block, buffer));
    check(snd_pcm_start(pcm_.get()));
  }

  double rate() const override { return kRate; }

  double read(std::span<std::int16_t> samples) override {
    while (!samples.empty()) {
      const snd_pcm_sframes_t count = snd_pcm_readi(pcm_.get(), samples.data(), samples.size());
      if (count < 0) throw no_input(device_, snd_strerror(static_cast<int>(count)));
      samples = samples.subspan(static_cast<std::size_t>(count));
    }
    snd_pcm_sframes_t waiting = 0;
    check(snd_pcm_delay(pcm_.get(), &waiting));
    return static_cast<double>(std::max<snd_pcm_sframes_t>(0, waiting)) / kRate;
  }

 private:
  void check(int result) const {
    if (result < 0) throw no_input(device_, snd_strerror(result));
  }

  const std::string device_;
  Pcm pcm_;
};

}  // namespace

std::unique_ptr<SoundOutput> open_sound(const std::string& device, const SoundBuffer& wanted) {
  return std::make_unique<AlsaOutput>(device, wanted);
}

std::unique_ptr<SoundInput> open_sound_input(const std::string& device) {
  return std::make_unique<AlsaInput>(device);
}

}  // namespace palpate::runner::sound
