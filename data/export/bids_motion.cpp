#include "data/export/bids_motion.h"

#include <algorithm>
#include <array>
#include <map>
#include <string_view>

#include "data/export/delimited_row.h"
#include "data/export/sample_slots.h"

namespace palpate::data {
namespace {

struct Channel {
  std::string component = "n/a", type = "MISC", tracked_point = kTrackingSystem;
};

/// "tip_x" is the component x of tip.
Channel channel_of(std::string_view name) {
  Channel channel;
  const std::size_t bar = name.rfind('_');
  const std::string_view of = name.substr(0, bar);
  const std::string_view end = bar == std::string_view::npos ? "" : name.substr(bar + 1);
  if (of == "body") {
    channel.tracked_point = "stimulus";
    channel.type = end.starts_with('q')   ? "ORNT"
                   : end.starts_with('v') ? "VEL"
                   : end.starts_with('w') ? "GYRO"
                                          : "POS";
    channel.component = (channel.type == "ORNT" ? "quat_" : "") + std::string(1, end.back());
    return channel;
  }
  if (end == "x" || end == "y" || end == "z") channel.component = end;
  if (of == "tip" || of == "tail") {
    channel.type = "POS";
    channel.tracked_point = of;
  }
  if (of == "device1") channel.tracked_point = "tip";
  if (of == "device2") channel.tracked_point = "tail";
  return channel;
}

std::string unit_or_none(const Column& column) {
  const std::string_view unit = column.unit;
  return unit.empty() || unit == "1" ? "n/a" : std::string(unit);
}

const std::vector<Column>& event_columns() {
  static const std::vector<Column> all = {
      {"onset", "From the first row of the motion file of the same run", "s"},
      {"duration", "Of a trial to the response, or the limit for a time-out", "s"},
      {"trial_type",
       "What the row is",
       "",
       {{"trial", "a trial, from forces on to its answer"},
        {"interval", "one of several intervals of a trial"}}},
      {"trial", "Trial within the session, from 1", "1"},
      {"interval", "Interval of the trial, from 1; missing for a trial as a whole", "1"},
      {"renderer", "How the stimulus was rendered", ""},
      {"shape", "The stimulus shown; missing: none", "", {}, Column::Names::stimuli},
      {"level", "Level of an interval; missing: the stimulus as the protocol has it", "1"},
      {"response", "The answer; missing: none", "", {}, Column::Names::answers},
      {"correct",
       "Whether the answer is right; missing where none is right",
       "",
       {{"0", "no"}, {"1", "yes"}}},
      {"orientation_w", "Orientation of the stimulus, unit quaternion, w", "1"},
      {"orientation_x", "Orientation of the stimulus, unit quaternion, x", "1"},
      {"orientation_y", "Orientation of the stimulus, unit quaternion, y", "1"},
      {"orientation_z", "Orientation of the stimulus, unit quaternion, z", "1"},
  };
  return all;
}

}  // namespace

std::string motion_channels(const std::vector<Column>& columns) {
  DelimitedRow row(DelimitedFormat::tsv);
  row << "name"
      << "component"
      << "type"
      << "tracked_point"
      << "units"
      << "reference_frame"
      << "description";
  std::string table = row.end();
  for (const Column& column : columns) {
    const Channel channel = channel_of(column.name);
    // "" is how a row says n/a.
    const auto put = [&row](const std::string& text) { row << (text == "n/a" ? "" : text); };
    row << column.name;
    put(channel.component);
    row << channel.type << channel.tracked_point;
    put(unit_or_none(column));
    put(channel.component == "n/a" ? "n/a" : "world");
    row << column.description;
    table += row.end();
  }
  return table;
}

nlohmann::ordered_json motion_frames() {
  return {{"reference_frame",
           {{"Description",
             "The world: x to the right, y away from the participant, z up; its origin is the "
             "middle of the device's workspace"},
            {"Levels", {{"world", {{"SpatialAxes", "RAS"}, {"RotationRule", "right-hand"}}}}}}}};
}

nlohmann::ordered_json motion_facts(const std::vector<Column>& columns, double rate,
                                    std::int64_t rows, const RunInfo& run) {
  std::map<std::string, int> types;
  bool moves = false;
  for (const Column& column : columns) {
    const Channel channel = channel_of(column.name);
    ++types[channel.type];
    moves |= channel.tracked_point == "stimulus";
  }
  nlohmann::ordered_json json{{"SamplingFrequency", rate},
                              {"RecordingType", "continuous"},
                              {"RecordingDuration", static_cast<double>(rows) / rate},
                              {"TrackingSystemName", kTrackingSystem},
                              {"ManufacturersModelName", run.device},
                              {"SoftwareVersions", "palpate " + run.program_version},
                              {"MissingValues", "n/a"},
                              {"MotionChannelCount", columns.size()},
                              {"TrackedPointsCount", moves ? 3 : 2}};
  for (const auto& [type, count] : types) json[type + "ChannelCount"] = count;
  return json;
}

void MotionEvents::add(const StoredTrial& trial, std::int64_t slot) {
  const TrialRecord& record = trial.record;
  Event event;
  event.slot = slot;
  event.duration = duration_of(record);
  event.trial = record.trial;
  event.renderer = record.renderer;
  event.shape = record.shape;
  event.response = record.response;
  event.correct = correct_of(record);
  event.orientation_wxyz = record.orientation_wxyz;
  events_.push_back(event);
  if (!record.task) return;
  const std::int64_t begin = first_onset_ns(record);
  const auto seconds = [](std::int64_t from_ns, std::int64_t to_ns) {
    return (static_cast<double>(to_ns) - static_cast<double>(from_ns)) / 1e9;
  };
  event.response.clear();
  event.correct.reset();
  for (const IntervalRecord& interval : record.task->intervals) {
    ++event.interval;
    if (interval.onset_ns == 0) continue;  // it was not reached
    event.since = seconds(begin, interval.onset_ns);
    event.duration = interval.end_ns == 0 ? 0 : seconds(interval.onset_ns, interval.end_ns);
    event.renderer = interval.renderer;
    event.shape = interval.stimulus;
    event.level = interval.level;
    events_.push_back(event);
  }
}

std::string MotionEvents::table(std::int64_t first_row, double rate) const {
  DelimitedRow row(DelimitedFormat::tsv);
  row << std::span<const Column>(event_columns());
  std::string table = row.end();
  for (const Event& event : events_) {
    row << static_cast<double>(event.slot - first_row) / rate + event.since << event.duration
        << (event.interval > 0 ? "interval" : "trial") << event.trial;
    if (event.interval > 0)
      row << event.interval;
    else
      row << "";
    row << event.renderer << event.shape << event.level << event.response << event.correct;
    for (const double q : event.orientation_wxyz) row << q;
    table += row.end();
  }
  return table;
}

nlohmann::ordered_json MotionEvents::description(const ProtocolFacts& facts) {
  nlohmann::ordered_json json;
  for (const Column& column : event_columns())
    json[column.name] = describe_column(column, facts, {});
  return json;
}

}  // namespace palpate::data
