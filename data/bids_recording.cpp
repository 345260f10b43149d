#include "data/bids_recording.h"

#include <string>

#include "data/dataset.h"
#include "data/table_fields.h"

namespace palpate {
namespace {

constexpr std::uint32_t kLongestGap = 600'000;  // ticks: ten minutes at 1 kHz

void require_sound_ticks(const StoredTrial& trial) {
  const auto& samples = trial.record.samples;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const std::uint32_t before = samples[i - 1].tick, tick = samples[i].tick;
    if (tick > before && tick - before <= kLongestGap) continue;
    throw StoreRefused("participant " + trial.participant.code + ", session " +
                       std::to_string(trial.record.session) + ", trial " +
                       std::to_string(trial.record.trial) + ": the samples are damaged: tick " +
                       std::to_string(tick) + " follows tick " + std::to_string(before));
  }
}

}  // namespace

nlohmann::ordered_json describe_recording(const StoredTrial& trial, double servo_rate) {
  require_sound_ticks(trial);
  nlohmann::ordered_json json{
      {"SamplingFrequency", servo_rate},
      {"StartTime", trial.record.samples.front().tick / servo_rate},
      {"StartTimeReference", "onset in the beh.tsv of the same run: the first tick with forces on"},
      {"Simulated", trial.participant.simulated},
      {"Device", trial.run.device}};
  for (const Column& column : sample_columns()) json["Columns"].push_back(column.name);
  for (const Column& column : sample_columns()) {
    auto& about = json[column.name] = {{"Description", column.description}};
    if (*column.unit != '\0') about["Units"] = column.unit;
    if (const auto levels = levels_of(column, {}); !levels.is_null()) about["Levels"] = levels;
  }
  return json;
}

void write_recording(const std::vector<SampleRecord>& samples, TextSink& out) {
  GzipSink gzip(out);
  TableRow row(TableStyle::tsv);
  for (std::size_t i = 0; i < samples.size(); ++i) {
    for (std::uint32_t lost = i > 0 ? samples[i - 1].tick + 1 : samples[i].tick;
         lost < samples[i].tick; ++lost) {
      for (std::size_t k = 0; k < sample_columns().size(); ++k) row << "";
      gzip.write(row.end());
    }
    put_sample(row, samples[i]);
    gzip.write(row.end());
  }
  gzip.finish();
}

}  // namespace palpate
