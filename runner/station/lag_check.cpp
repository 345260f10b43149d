#include "runner/station/lag_check.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

#include "runner/station/opening.h"
#include "runner/station/sound_timing.h"
#include "runner/usage_error.h"

namespace palpate::runner::station {
namespace {

/// s, the median of the newest run that has any. \param record  of a trial, with its lag
template <class Record>
std::optional<double> newest_lag(data::Store& store,
                                 std::optional<Record> data::TaskRecord::*record) {
  std::vector<double> lags;
  std::int64_t newest_ns = 0;
  store.for_each_trial([&](const data::StoredTrial& trial) {
    const auto& one = trial.record.task.*record;
    if (!one || trial.run.clock.utc_ns < newest_ns) return;
    if (trial.run.clock.utc_ns > newest_ns) lags.clear();
    newest_ns = trial.run.clock.utc_ns;
    lags.push_back(one->lag);
  });
  if (lags.empty()) return std::nullopt;
  std::ranges::sort(lags);
  return lags[lags.size() / 2];
}

std::optional<double> measured_lag(const RunSettings& settings) {
  if (settings.calibration.empty()) return std::nullopt;
  for (const SoundTiming& timing : stored_sound_timings(sound_timing_file(settings.calibration))) {
    if (timing.device == settings.sound_device) return timing.median;
  }
  return std::nullopt;
}

std::string in_milliseconds(double lag) { return std::to_string(std::lround(1000 * lag)) + " ms"; }

}  // namespace

std::string check_seen_lag(data::Store& store, const protocols::Protocol& protocol) {
  if (!protocol.view) return {};
  const std::optional<double> lag = newest_lag(store, &data::TaskRecord::seen);
  if (!lag || *lag <= data::SeenRecord::kMostLag) return {};
  if (!protocol.view->lag_accepted)
    throw UsageError("what is seen was " + in_milliseconds(*lag) +
                     " late in the newest session of this database, more than 22 ms, half of what "
                     "people notice: use a faster graphics card or a smaller window, or write "
                     R"("lag": "accepted" into the protocol's view, which is on record)");
  return nlohmann::ordered_json{{"seen_lag_accepted_s", *lag}}.dump();
}

std::string check_sound_lag(data::Store& store, const protocols::Protocol& protocol,
                            const RunSettings& settings) {
  if (!has_contact_sound(protocol) || settings.without_noise) return {};
  const std::optional<double> measured = measured_lag(settings);
  const std::optional<double> lag =
      measured ? measured : newest_lag(store, &data::TaskRecord::heard);
  if (!lag || *lag <= data::HeardRecord::kMostLag) return {};
  const std::string where = measured ? "by the measurement beside the calibration"
                                     : "in the newest session of this database";
  if (!protocol.sounds || !protocol.sounds->lag_accepted)
    throw UsageError("contacts are heard " + in_milliseconds(*lag) + " late " + where +
                     ", more than 12 ms, half of what people notice: allow real-time scheduling, "
                     "name another --sound-device, or write "
                     R"("lag": "accepted" into the protocol's sounds, which is on record)");
  return nlohmann::ordered_json{{"sound_lag_accepted_s", *lag}}.dump();
}

}  // namespace palpate::runner::station
