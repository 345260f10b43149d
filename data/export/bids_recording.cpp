#include "data/export/bids_recording.h"

#include <algorithm>
#include <cmath>

#include "data/base/json_text.h"
#include "data/export/column_values.h"
#include "data/export/sample_slots.h"
#include "data/files/utc.h"

namespace palpate::data {
namespace {

constexpr double kLongestGap = 60;  // s

const Column kTrialOfSample{"trial", "Trial within the session, from 1, that the tick is of", "1"};

std::vector<Column> columns_of(const StudyLabel& study, bool contacts) {
  std::vector<Column> all{kTrialOfSample};
  if (!study.facts.blocks.empty()) all.push_back(interval_column());
  all.insert(all.end(), sample_columns().begin(), sample_columns().end());
  if (has_bodies(study.facts)) all.insert(all.end(), body_columns().begin(), body_columns().end());
  if (contacts) all.insert(all.end(), contact_columns().begin(), contact_columns().end());
  return all;
}

/// What was felt in each interval.
nlohmann::ordered_json intervals_of(const TaskRecord& task) {
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

BidsRecording::BidsRecording(const StoredTrial& first, const StudyLabel& study,
                             const ExportSettings& settings)
    : study_(study),
      settings_(settings),
      run_(first.run),
      simulated_(first.participant.simulated),
      columns_(columns_of(study, settings.contacts != nullptr)),
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
      file_.emplace(path, !settings_.motion);
      first_row_ = next_row_ = slot;
    }
    if (&sample == &record.samples.front()) first = slot;
    for (; next_row_ < slot; ++next_row_) file_->write(nothing);
    row << record.trial;
    if (!study_.facts.blocks.empty()) row << slots.interval();
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
  if (record.task) about["intervals"] = intervals_of(*record.task);
  if (settings_.motion) events_.add(trial, onset);
}

bool BidsRecording::finish() {
  if (!file_) return false;
  if (file_->gzip) file_->gzip->finish();
  file_->sink.close(false);
  return true;
}

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
  // BIDS has no other key that could say it.
  const std::string label = simulated_ ? "SIMULATED participant, no person. " : "";
  nlohmann::ordered_json json{{"TaskName", study_.protocol.name},
                              {"TaskDescription", label + study_.facts.title}};
  json.update(motion_facts(columns_, study_.facts.servo_rate, next_row_ - first_row_, run_));
  return json;
}

void BidsRecording::put_trials(nlohmann::ordered_json& sidecar) const {
  sidecar["TrialsDescription"] =
      "Where each trial stands (first_row counts from 0, onset in s) and what was felt: the object "
      "of that name in Objects, turned by the quaternion about the origin of the world frame; "
      "intervals, where a trial has "
      "them: what was felt in each, null for nothing, or a level of its own";
  sidecar["Trials"] = trials_;
  sidecar["ObjectsDescription"] =
      "The protocol's stimuli: position_m, where it is there, and orientation_wxyz place the "
      "object before it is turned; lengths in m";
  sidecar["Objects"] = objects_of(study_);
}

std::string BidsRecording::motion_events() const {
  return events_.table(first_row_, study_.facts.servo_rate);
}

std::int64_t BidsRecording::first_row_ns() const {
  return begin_ns_ + static_cast<std::int64_t>(std::llround(static_cast<double>(first_row_) * 1e9 /
                                                            study_.facts.servo_rate));
}

}  // namespace palpate::data
