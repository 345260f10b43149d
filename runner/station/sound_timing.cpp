#include "runner/station/sound_timing.h"

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "data/base/json_text.h"
#include "data/files/atomic_file.h"
#include "protocols/json_document.h"
#include "protocols/object_reader.h"

namespace palpate::runner::station {
namespace {

using nlohmann::ordered_json;

constexpr int kVersion = 1;
constexpr std::size_t kMostSounds = 100, kMostWord = 200;

ordered_json to_json(const SoundTiming& timing) {
  ordered_json out = {{"device", timing.device},           {"input", timing.input},
                      {"clicks", timing.clicks},           {"missed", timing.missed},
                      {"latency_median_s", timing.median}, {"latency_p99_s", timing.p99},
                      {"made_utc", timing.made_utc}};
  out["sha256"] = json_checksum(nlohmann::json(out));
  return out;
}

SoundTiming read_timing(protocols::ObjectReader& one) {
  constexpr auto kRequired = protocols::Presence::required;
  SoundTiming out;
  if (!one.sealed()) one.faults().add(one.pointer("sha256"), "missing: measure again");
  one.text("device", out.device, kMostWord);
  one.text("input", out.input, kMostWord);
  one.integer("clicks", out.clicks, {1, 1e6}, kRequired);
  one.integer("missed", out.missed, {0, 1e6}, kRequired);
  one.number("latency_median_s", out.median, {0, 10, "s"}, kRequired);
  one.number("latency_p99_s", out.p99, {0, 10, "s"}, kRequired);
  one.text("made_utc", out.made_utc, kMostWord);
  return out;
}

}  // namespace

std::string sound_timing_file(const std::string& calibration) {
  return std::filesystem::path(calibration).replace_extension(".sound.json").string();
}

std::vector<SoundTiming> stored_sound_timings(const std::string& path) {
  if (!std::filesystem::exists(path)) return {};
  protocols::FaultList faults(path);
  const nlohmann::json read = protocols::read_json(protocols::read_text_file(path), faults);
  protocols::ObjectReader root(read, "", faults);
  int version = 0;
  root.integer("version", version, {kVersion, kVersion}, protocols::Presence::required);
  std::vector<SoundTiming> out;
  if (const auto* list = root.array("sounds", 0, kMostSounds, protocols::Presence::required)) {
    for (std::size_t i = 0; i < list->size(); ++i) {
      protocols::ObjectReader one((*list)[i], protocols::child_pointer("/sounds", i), faults);
      out.push_back(read_timing(one));
      one.refuse_unknown_keys();
    }
  }
  root.refuse_unknown_keys();
  faults.throw_if_any();
  return out;
}

void store_sound_timing(const std::string& path, const SoundTiming& timing) {
  std::vector<SoundTiming> all = stored_sound_timings(path);
  std::erase_if(all, [&](const SoundTiming& one) { return one.device == timing.device; });
  all.push_back(timing);
  ordered_json sounds = ordered_json::array();
  for (const SoundTiming& one : all) sounds.push_back(to_json(one));
  data::AtomicFile file(path);
  file.write(ordered_json{{"version", kVersion}, {"sounds", sounds}}.dump(2) + "\n");
  file.sync();
  file.commit(true);
}

}  // namespace palpate::runner::station
