#include "runner/sound/sound_file.h"

#include <samplerate.h>
#include <sndfile.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <memory>

#include "runner/sound/sound_output.h"

namespace palpate::runner::sound {
namespace {

constexpr double kLongest = 10;  // s

/// The bytes of a file as libsndfile reads them.
struct Bytes {
  const std::string& all;
  sf_count_t at = 0;
};

sf_count_t length_of(void* user) {
  return static_cast<sf_count_t>(static_cast<const Bytes*>(user)->all.size());
}

sf_count_t seek(sf_count_t offset, int whence, void* user) {
  auto& bytes = *static_cast<Bytes*>(user);
  const sf_count_t from = whence == SEEK_SET ? 0 : whence == SEEK_CUR ? bytes.at : length_of(user);
  bytes.at = std::clamp<sf_count_t>(from + offset, 0, length_of(user));
  return bytes.at;
}

sf_count_t read(void* to, sf_count_t count, void* user) {
  auto& bytes = *static_cast<Bytes*>(user);
  count = std::min(count, length_of(user) - bytes.at);
  std::memcpy(to, bytes.all.data() + bytes.at, static_cast<std::size_t>(count));
  bytes.at += count;
  return count;
}

sf_count_t write(const void*, sf_count_t, void*) { return 0; }

sf_count_t tell(void* user) { return static_cast<const Bytes*>(user)->at; }

struct CloseFile {
  void operator()(SNDFILE* file) const { sf_close(file); }
};

[[noreturn]] void refuse(const std::string& name, const std::string& why) {
  throw SoundError("sound file '" + name + "': " + why);
}

std::vector<float> resampled(const std::vector<float>& from, double ratio,
                             const std::string& name) {
  std::vector<float> to(
      static_cast<std::size_t>(std::ceil(static_cast<double>(from.size()) * ratio)) + 1);
  SRC_DATA data{};
  data.data_in = from.data();
  data.data_out = to.data();
  data.input_frames = static_cast<long>(from.size());
  data.output_frames = static_cast<long>(to.size());
  data.src_ratio = ratio;
  if (const int error = src_simple(&data, SRC_SINC_MEDIUM_QUALITY, 1); error != 0)
    refuse(name, src_strerror(error));
  to.resize(static_cast<std::size_t>(data.output_frames_gen));
  return to;
}

}  // namespace

std::vector<double> read_sound_file(const std::string& bytes, const std::string& name,
                                    double rate) {
  SF_VIRTUAL_IO io{length_of, seek, read, write, tell};
  Bytes source{bytes};
  SF_INFO info{};
  const std::unique_ptr<SNDFILE, CloseFile> file(sf_open_virtual(&io, SFM_READ, &info, &source));
  if (!file) refuse(name, std::string("expected a WAV, FLAC or OGG file; ") + sf_strerror(nullptr));
  if (info.samplerate < 4000 || info.samplerate > 192000 || info.channels > 8)
    refuse(name, "expected 4000 to 192000 samples a second and at most 8 channels");
  const double seconds = static_cast<double>(info.frames) / info.samplerate;
  if (!(info.frames > 0)) refuse(name, "expected at least one sample");
  if (!(seconds <= kLongest))
    refuse(name, "expected at most 10 s, found " + std::to_string(std::lround(seconds)) + " s");
  const auto channels = static_cast<std::size_t>(info.channels);
  std::vector<float> interleaved(static_cast<std::size_t>(info.frames) * channels);
  const sf_count_t frames = sf_readf_float(file.get(), interleaved.data(), info.frames);
  if (frames != info.frames) refuse(name, "it ends before its last sample");
  std::vector<float> mono(static_cast<std::size_t>(frames), 0);
  for (std::size_t i = 0; i < interleaved.size(); ++i)
    mono[i / channels] += interleaved[i] / static_cast<float>(channels);
  if (info.samplerate != rate) mono = resampled(mono, rate / info.samplerate, name);
  return {mono.begin(), mono.end()};
}

}  // namespace palpate::runner::sound
