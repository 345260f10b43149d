#include "runner/station/sound_timing.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>

#include "data/base/json_text.h"
#include "data/files/atomic_file.h"
#include "protocols/json_document.h"
#include "runner/station/opening.h"
#include "runner/usage_error.h"

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

std::optional<double> measured_lag(const RunSettings& settings) {
  if (settings.calibration.empty()) return std::nullopt;
  for (const SoundTiming& timing : stored_sound_timings(sound_timing_file(settings.calibration))) {
    if (timing.device == settings.sound_device) return timing.median;
  }
  return std::nullopt;
}

/// s, the median of the newest run that has any.
std::optional<double> newest_lag(data::Store& store) {
  std::vector<double> lags;
  std::int64_t newest_ns = 0;
  store.for_each_trial([&](const data::StoredTrial& trial) {
    if (!trial.record.task.heard || trial.run.clock.utc_ns < newest_ns) return;
    if (trial.run.clock.utc_ns > newest_ns) lags.clear();
    newest_ns = trial.run.clock.utc_ns;
    lags.push_back(trial.record.task.heard->lag);
  });
  if (lags.empty()) return std::nullopt;
  std::ranges::sort(lags);
  return lags[lags.size() / 2];
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

std::string check_sound_lag(data::Store& store, const protocols::Protocol& protocol,
                            const RunSettings& settings) {
  if (!has_contact_sound(protocol) || settings.without_noise) return {};
  const std::optional<double> measured = measured_lag(settings);
  const std::optional<double> lag = measured ? measured : newest_lag(store);
  if (!lag || *lag <= data::HeardRecord::kMostLag) return {};
  const std::string found = std::to_string(std::lround(1000 * *lag)) + " ms";
  const std::string where = measured ? "by the measurement beside the calibration"
                                     : "in the newest session of this database";
  if (!protocol.sounds || !protocol.sounds->lag_accepted)
    throw UsageError("contacts are heard " + found + " late " + where +
                     ", more than 12 ms, half of what people notice: allow real-time scheduling, "
                     "name another --sound-device, or write "
                     R"("lag": "accepted" into the protocol's sounds, which is on record)");
  return ordered_json{{"sound_lag_accepted_s", *lag}}.dump();
}

}  // namespace palpate::runner::station
