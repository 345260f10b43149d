#include "data/export/bids_recording.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string_view>
#include <utility>

#include "data/base/json_text.h"
#include "data/export/column_values.h"
#include "data/export/delimited_row.h"
#include "data/export/sample_slots.h"
#include "data/files/utc.h"

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

std::vector<Column> event_columns(const ProtocolFacts& facts) {
  std::vector<Column> all = {
      {"onset", "From the first row of the motion file of the same run", "s"},
      {"duration", "To the response of a trial; in a time-out, the time limit", "s"},
      {"trial_type",
       "Kind of the row",
       "",
       {{"trial", "a trial, from forces on to its answer"},
        {"interval", "one of several intervals of a trial"}}},
      {"trial", "Trial within the session, from 1", "1"},
      {"interval", "Interval of the trial, from 1; missing for a trial as a whole", "1"},
      {"renderer", "How the stimulus was rendered", ""},
      {"shape", "The stimulus shown; missing: none", "", {}, Column::Names::stimuli},
      {"level", "Level of an interval; missing: the stimulus unchanged from the protocol", "1"},
      {"response", "The answer; missing: none", "", {}, Column::Names::answers},
      {"correct",
       "Whether the answer is right; missing if no answer is right or wrong",
       "",
       {{"0", "no"}, {"1", "yes"}}},
      {"orientation_w", "Orientation of the stimulus, unit quaternion, w", "1"},
      {"orientation_x", "Orientation of the stimulus, unit quaternion, x", "1"},
      {"orientation_y", "Orientation of the stimulus, unit quaternion, y", "1"},
      {"orientation_z", "Orientation of the stimulus, unit quaternion, z", "1"},
  };
  if (facts.seen)
    all.push_back(
        {"seen_on",
         "From the onset of the trial to the first frame in which something was drawn, by "
         "the program's clock; missing: nothing was",
         "s"});
  if (facts.heard)
    all.push_back({"sound",
                   "From the onset of the trial to the first contact that was heard, without what "
                   "the sound card adds; missing: none was",
                   "s"});
  return all;
}

/// Required fields of ..._motion.json other than the task. \param rows of the recording
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

constexpr double kLongestGap = 60;  // s

const Column kTrialOfSample{"trial", "Trial within the session, from 1, to which the tick belongs",
                            "1"};

std::vector<Column> recording_columns(const StudyLabel& study, bool contacts) {
  std::vector<Column> all{kTrialOfSample};
  for (const Column& column : dataset_form(study.facts).intervals) all.push_back(column);
  all.insert(all.end(), sample_columns().begin(), sample_columns().end());
  if (has_bodies(study.facts)) all.insert(all.end(), body_columns().begin(), body_columns().end());
  if (contacts) all.insert(all.end(), contact_columns().begin(), contact_columns().end());
  return all;
}

/// The stimulus of each interval.
nlohmann::ordered_json intervals_json(const TaskRecord& task) {
  nlohmann::ordered_json all = nlohmann::ordered_json::array();
  for (const IntervalRecord& interval : task.intervals) {
    auto& one =
        all.emplace_back(nlohmann::ordered_json{{"renderer", guarded_text(interval.renderer)}});
    one["shape"] = interval.stimulus.empty()
                       ? nlohmann::ordered_json()
                       : nlohmann::ordered_json(guarded_text(interval.stimulus));
    one["level"] =
        interval.level ? nlohmann::ordered_json(*interval.level) : nlohmann::ordered_json();
  }
  return all;
}

std::string empty_row(std::size_t columns) {
  DelimitedRow all(DelimitedFormat::tsv);
  for (std::size_t k = 0; k < columns; ++k) all << "";
  return all.end();
}

/// Replaces file names of the protocol by their BIDS URIs in the dataset.
void rename_files(nlohmann::ordered_json& object, const StudyLabel& study) {
  if (const auto file = object.find("file"); file != object.end() && file->is_string()) {
    const auto found = study.files.find(file->get<std::string>());
    if (found != study.files.end()) {
      *file = "bids::stimuli/" + study.label + "/" + found->second;
    }
  }
  if (const auto parts = object.find("parts"); parts != object.end() && parts->is_array()) {
    for (auto& part : *parts) {
      if (part.is_object()) rename_files(part, study);
    }
  }
}

nlohmann::ordered_json objects_of(const StudyLabel& study) {
  nlohmann::ordered_json objects = nlohmann::ordered_json::object();
  for (const StimulusFacts& stimulus : study.facts.stimuli) {
    auto& object = objects[guarded_text(stimulus.name)] = read_ordered_json(stimulus.object);
    rename_files(object, study);
  }
  return objects;
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
    // A row writes "" as n/a.
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
  const std::int64_t begin = first_onset_ns(record);
  const auto seconds = [](std::int64_t from_ns, std::int64_t to_ns) {
    return (static_cast<double>(to_ns) - static_cast<double>(from_ns)) / 1e9;
  };
  if (const auto& seen = record.task.seen; seen && seen->first_ns != 0)
    event.seen_on = seconds(begin, seen->first_ns);
  if (const auto& heard = record.task.heard) event.sound = seconds(begin, heard->first_ns);
  events_.push_back(event);
  if (record.task.intervals.empty()) return;
  event.seen_on.reset();
  event.sound.reset();
  event.response.clear();
  event.correct.reset();
  for (const IntervalRecord& interval : record.task.intervals) {
    ++event.interval;
    if (interval.onset_ns == 0) continue;  // never shown
    event.since = seconds(begin, interval.onset_ns);
    event.duration = interval.end_ns == 0 ? 0 : seconds(interval.onset_ns, interval.end_ns);
    event.renderer = interval.renderer;
    event.shape = interval.stimulus;
    event.level = interval.level;
    events_.push_back(event);
  }
}

std::string MotionEvents::table(std::int64_t first_row, const ProtocolFacts& facts) const {
  DelimitedRow row(DelimitedFormat::tsv);
  row << std::span<const Column>(event_columns(facts));
  std::string table = row.end();
  for (const Event& event : events_) {
    row << static_cast<double>(event.slot - first_row) / facts.servo_rate + event.since
        << event.duration << (event.interval > 0 ? "interval" : "trial") << event.trial;
    if (event.interval > 0)
      row << event.interval;
    else
      row << "";
    row << event.renderer << event.shape << event.level << event.response << event.correct;
    for (const double q : event.orientation_wxyz) row << q;
    if (facts.seen) row << event.seen_on;
    if (facts.heard) row << event.sound;
    table += row.end();
  }
  return table;
}

nlohmann::ordered_json MotionEvents::description(const ProtocolFacts& facts) {
  nlohmann::ordered_json json;
  for (const Column& column : event_columns(facts))
    json[column.name] = describe_column(column, facts, {});
  return json;
}

BidsRecording::BidsRecording(const StoredTrial& first, const StudyLabel& study,
                             const ExportSettings& settings)
    : study_(study),
      settings_(settings),
      run_(first.run),
      simulated_(first.participant.simulated),
      columns_(recording_columns(study, settings.contacts != nullptr)),
      begin_ns_(to_unix_ns(first.run.clock, first_onset_ns(first.record))) {}

std::optional<std::int64_t> BidsRecording::slot_of(std::int64_t unix_ns) const {
  if (unix_ns < begin_ns_) return std::nullopt;
  constexpr double kMostSlots = 1e12;  // 30 years at 1 kHz: damaged times
  const auto since = static_cast<std::uint64_t>(unix_ns) - static_cast<std::uint64_t>(begin_ns_);
  const double slot = std::round(static_cast<double>(since) / 1e9 * study_.facts.servo_rate);
  if (slot > kMostSlots) return std::nullopt;
  return static_cast<std::int64_t>(slot);
}

bool BidsRecording::continues_with(const StoredTrial& trial) const {
  const ClockStamp &a = run_.clock, &b = trial.run.clock;
  if (a.utc_ns != b.utc_ns || a.monotonic_ns != b.monotonic_ns) return false;
  const auto slot = slot_of(to_unix_ns(b, first_onset_ns(trial.record)));
  if (!slot || *slot < free_) return false;
  return static_cast<double>(*slot - free_) <= kLongestGap * study_.facts.servo_rate;
}

void BidsRecording::add(const StoredTrial& trial, const std::string& path) {
  const TrialRecord& record = trial.record;
  const std::int64_t onset =
      slot_of(to_unix_ns(trial.run.clock, first_onset_ns(record))).value_or(free_);
  const double length = std::ceil(duration_of(record) * study_.facts.servo_rate);
  free_ = onset + static_cast<std::int64_t>(std::clamp(length, 0.0, 1e9));
  if (record.samples.empty()) return;
  SampleSlots slots(trial, study_.facts.servo_rate);
  const bool bodies = has_bodies(study_.facts);
  const std::span<const Column> intervals = dataset_form(study_.facts).intervals;
  const std::string nothing = empty_row(columns_.size());
  std::vector<std::optional<TickContact>> contacts;
  if (settings_.contacts) contacts = settings_.contacts(trial);
  contacts.resize(record.samples.size());
  auto contact = contacts.begin();
  DelimitedRow row(DelimitedFormat::tsv);
  std::int64_t first = 0;
  for (const SampleRecord& sample : record.samples) {
    const std::int64_t slot = onset + slots.next();
    if (!file_) {
      file_ = std::make_unique<File>(path, settings_.motion ? 0 : settings_.jobs);
      first_row_ = next_row_ = slot;
    }
    if (&sample == &record.samples.front()) first = slot;
    for (; next_row_ < slot; ++next_row_) file_->write(nothing);
    row << record.trial;
    put_interval(row, intervals, slots.interval());
    put_sample(row, sample);
    if (bodies) put_body(row, record, sample);
    if (settings_.contacts) put_contact(row, *contact++);
    file_->write(row.end());
    ++next_row_;
  }
  free_ = std::max(free_, next_row_);
  auto& about = trials_.emplace_back(
      nlohmann::ordered_json{{"trial", record.trial},
                             {"onset", static_cast<double>(onset) / study_.facts.servo_rate},
                             {"first_row", first - first_row_},
                             {"rows", next_row_ - first},
                             {"renderer", guarded_text(record.renderer)},
                             {"shape", guarded_text(record.shape)},
                             {"orientation_wxyz", record.orientation_wxyz}});
  if (!record.task.intervals.empty()) about["intervals"] = intervals_json(record.task);
  if (settings_.motion) events_.add(trial, onset);
}

std::unique_ptr<BidsRecording::File> BidsRecording::finish() { return std::move(file_); }

nlohmann::ordered_json BidsRecording::physio_sidecar() const {
  nlohmann::ordered_json json{
      {"SamplingFrequency", study_.facts.servo_rate},
      {"StartTime", static_cast<double>(first_row_) / study_.facts.servo_rate},
      {"StartTimeReference",
       "onset 0 in the beh.tsv of the same run: the first tick with forces on of its first trial"},
      {"Simulated", simulated_},
      {"Device", run_.device}};
  for (const Column& column : columns_) json["Columns"].push_back(column.name);
  for (const Column& column : columns_)
    json[column.name] = describe_column(column, {}, settings_.fault_bits);
  put_trials(json);
  return json;
}

nlohmann::ordered_json BidsRecording::motion_sidecar() const {
  // BIDS has no other key for this.
  const std::string label = simulated_ ? "SIMULATED participant, not a person. " : "";
  nlohmann::ordered_json json{{"TaskName", study_.protocol.name},
                              {"TaskDescription", label + study_.facts.title}};
  json.update(motion_facts(columns_, study_.facts.servo_rate, next_row_ - first_row_, run_));
  return json;
}

void BidsRecording::put_trials(nlohmann::ordered_json& sidecar) const {
  sidecar["TrialsDescription"] =
      "Rows of each trial (first_row counts from 0, onset in s) and its stimulus: the object "
      "of that name in Objects, rotated by the quaternion about the origin of the world frame; "
      "intervals, if a trial has "
      "them: the stimulus of each, null for nothing, or its level";
  sidecar["Trials"] = trials_;
  sidecar["ObjectsDescription"] =
      "The protocol's stimuli: position_m, if present, and orientation_wxyz place the "
      "object before it is rotated; lengths in m";
  sidecar["Objects"] = objects_of(study_);
}

std::string BidsRecording::motion_events() const { return events_.table(first_row_, study_.facts); }

std::int64_t BidsRecording::first_row_ns() const {
  return begin_ns_ + static_cast<std::int64_t>(std::llround(static_cast<double>(first_row_) * 1e9 /
                                                            study_.facts.servo_rate));
}

}  // namespace palpate::data
