#include "protocols/parse_sound.h"

#include <algorithm>
#include <cstddef>

namespace palpate::protocols {
namespace {

using nlohmann::json;

constexpr std::size_t kMostModes = 16;
constexpr NumberRange kFrequency{20, 20000, "Hz"};
constexpr NumberRange kDecay{1, 10000, "1/s"};
constexpr NumberRange kModeGain{0, 1};
constexpr NumberRange kGain{0, 100, "1/(m/s)"};
constexpr NumberRange kScrape{0, 100, "1/W"};
constexpr NumberRange kSoundDelay{0, 1, "s"};
constexpr NumberRange kPan{-1, 1};

void read_modes(ObjectReader& section, SoundSpec& sound) {
  const json* const list = section.array("modes", 1, kMostModes, Presence::required);
  double loudest = 0;
  for (std::size_t i = 0; list != nullptr && i < list->size(); ++i) {
    ObjectReader item((*list)[i], child_pointer(section.pointer("modes"), i), section.faults());
    SoundSpec::Mode& mode = sound.modes.emplace_back();
    item.number("frequency_hz", mode.frequency, kFrequency, Presence::required);
    item.number("decay_per_s", mode.decay, kDecay, Presence::required);
    item.number("gain", mode.gain, kModeGain);
    item.refuse_unknown_keys();
    loudest = std::max(loudest, mode.gain);
  }
  if (list != nullptr && loudest == 0)
    section.faults().add(section.pointer("modes"), "expected a gain above 0");
}

void read_sound_keys(ObjectReader& section, const MeshFiles& files, SoundSpec& sound) {
  enum class Kind { modal, file } kind = Kind::modal;
  section.choice("kind", kind, {{"modal", Kind::modal}, {"file", Kind::file}}, Presence::required);
  section.number("gain_per_m_per_s", sound.gain, kGain);
  section.number("scrape", sound.scrape, kScrape);
  section.number("delay_s", sound.delay, kSoundDelay);
  section.number("pan", sound.pan, kPan);
  if (kind == Kind::modal) {
    read_modes(section, sound);
    if (section.member("file") != nullptr)
      section.faults().add(section.pointer("file"), "expected on kind file only");
    return;
  }
  section.text("file", sound.file_name);
  if (section.member("file", Presence::required) != nullptr)
    sound.file_bytes = read_kept_file(section, "file", "sound file", files);
  if (section.member("modes") != nullptr)
    section.faults().add(section.pointer("modes"), "expected on kind modal only");
  if (sound.scrape > 0)
    section.faults().add(section.pointer("scrape"),
                         "expected on kind modal only: noise sounds through its modes");
}

}  // namespace

void read_sound(ObjectReader& reader, const MeshFiles& files, StimulusSpec& stimulus) {
  reader.section("sound", [&](ObjectReader& section) {
    read_sound_keys(section, files, stimulus.sound.emplace());
  });
}

}  // namespace palpate::protocols
