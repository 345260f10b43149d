#include <algorithm>
#include <cstdint>
#include <deque>
#include <future>
#include <map>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <regex>
#include <string>
#include <string_view>
#include <vector>

#include "data/base/markdown.h"
#include "data/export/bids_recording.h"
#include "data/export/column_values.h"
#include "data/export/dataset_description.h"
#include "data/export/datasets.h"
#include "data/export/delimited_row.h"
#include "data/export/derived_table.h"
#include "data/export/exported_columns.h"
#include "data/export/page_table.h"
#include "data/export/sample_slots.h"
#include "data/files/text_sink.h"
#include "data/files/utc.h"
#include "data/store/participant_columns.h"
#include "data/store/store.h"

namespace palpate::data {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kBidsVersion = "1.9.0";

/// The columns of trials.csv without participant_id, which is in the file name.
std::span<const Column> beh_columns(const ExportClock& clock) { return columns_of_trial(clock); }

const Column kOnset{
    "onset",
    "First tick with forces on (with several intervals: in the first one), from that "
    "of the first row; negative where the computer's clock was set back between sittings",
    "s"};
const Column kDuration{"duration", "From onset to the response; in a time-out, the time limit",
                       "s"};

/// Negative where the clock was set back. Damaged times may differ by more than 63 bits.
double seconds_between(std::int64_t from_ns, std::int64_t to_ns) {
  const auto from = static_cast<std::uint64_t>(from_ns), to = static_cast<std::uint64_t>(to_ns);
  return to_ns >= from_ns ? static_cast<double>(to - from) / 1e9
                          : -static_cast<double>(from - to) / 1e9;
}

/// Levels of the columns whose values come from the runs: device, version, protocol, observer.
Json recorded_levels(const std::string& column, const std::vector<RunInfo>& runs,
                     const StudyLabel& study) {
  Json levels;
  if (column == "protocol_sha256") {
    levels[study.protocol.sha256] = "sourcedata/" + study.label + "_protocol.json";
  }
  for (const RunInfo& run : runs) {
    if (column == "device") levels[guarded_text(run.device)] = "as given to palpate run --device";
    if (column == "program_version") {
      levels[guarded_text(run.program_version)] = "palpate " + run.program_version;
    }
    if (column == "observer_sha256" && run.observer_sha256.empty()) levels["n/a"] = "a person";
    if (column == "observer_sha256" && !run.observer_sha256.empty()) {
      levels[run.observer_sha256] = "settings of the simulated participant";
    }
  }
  return levels;
}

Json describe_run(const RunInfo& run, const Participant& person, const ExportClock& clock) {
  Json json{{"StartedUTC", clock.utc(person, run.clock.utc_ns)},
            {"ProgramVersion", run.program_version},
            {"Build", run.build},
            {"Device", run.device},
            {"DeviceCalibration", clock.without_dates(run.device_calibration)},
            {"ResponseDevice", run.response_device},
            {"Hand", run.hand}};
  if (clock.torque().left_out(person, run))
    json["Torque"] = "left out: the device drives force alone";
  json["ResponseLatency"] = run.response_latency ? Json(*run.response_latency) : Json("unknown");
  return json;
}

std::string readme_text(const std::map<std::string, StudyLabel>& labels, bool simulated,
                        bool relative, const ExportSettings& settings) {
  const std::string samples =
      settings.motion
          ? "If a table's name has run-N, servo-rate samples were kept: motion/ beside beh/ "
            "holds those of\nall its trials as a motion recording, one row per servo period; "
            "channels.tsv names the columns,\nevents.tsv gives the time of each trial, and the "
            "table's "
            "JSON file its rows, the object that was\nfelt, its orientation and the "
            "renderer. "
          : "If a table's name has run-N, servo-rate samples were kept: recording-haptic beside "
            "it holds\nthose of all its trials, one row per servo period, and its JSON file "
            "gives the rows of each trial,\nthe object that was felt, its orientation and the "
            "renderer. ";
  return as_paragraph(dataset_name(labels, simulated)) + "\n\n" +
         as_paragraph(dataset_description(labels, simulated)) + "\n\n" +
         about_text(settings.about) +
         "sub-CODE/ses-S/beh/ holds the trials of session S of a participant, one row per trial, "
         "in the\norder in which they were shown. Every column is described in the JSON file "
         "beside the table. The "
         "protocol that was run\nis in sourcedata/, byte for byte; protocol_sha256 is its "
         "checksum.\n\n" +
         samples +
         "A new run begins with every\nstart of the program and after more than a minute between "
         "two trials. Periods between trials, and\nmissed ticks, are rows of n/a. "
         "Positions are rounded to 1 nm, forces to 1 uN and\ntorques to 1 uN m.\n\n" +
         (settings.derived ? "derivatives/palpate/ holds measures derived from the "
                             "samples, one row per trial, with a\nJSON file that defines each. " +
                                 settings.derived->how + "\n\n"
                           : "") +
         (relative ? kRelativeSentence : "") + kGuardSentence +
         "\n"
         "sourcedata/attempts.csv, if present, lists attempts that were cut off; their "
         "trials were\nshown again. They are in no other table. sourcedata/pages.csv, if "
         "present, "
         "has the\nparticipants' answers to pages: personal data.\n";
}

class BidsWriter : public DatasetWriter {
 public:
  using DatasetWriter::DatasetWriter;

  /// Whether an export of palpate has such a file.
  static bool has_file(const std::string& name);

  std::string begin_attempts() override { return "sourcedata/attempts.csv"; }
  std::string begin_pages() override;
  void add(const StoredTrial& trial) override;
  void end_table() override;
  void describe_dataset(bool simulated) override;

 private:
  struct Row {
    std::int64_t onset_ns = 0;
    int trial = 0;
    std::string rest;  // from the second column on, with the line end
  };
  /// The session, or with samples the BIDS run, whose rows are being collected.
  struct Table {
    std::string stem;         // of its files, with folders
    std::string motion, run;  // of the motion files, before and after tracksys
    const StudyLabel* study = nullptr;
    Participant person;
    std::vector<Row> rows;
    std::vector<RunInfo> runs;
  };
  void begin_session(const StoredTrial& trial);
  void add_row(const StoredTrial& trial);
  void write_table();
  void write_sidecar();
  void note_clock(Json& json) const;
  std::string recording_name() const;
  void write_recording();
  void close(std::unique_ptr<BidsRecording::File> file);
  void wait_for_one();
  void end_session();
  void describe_derivatives(bool simulated);
  void describe_participants();

  struct Described {
    std::string simulated, group;
  };
  std::map<std::string, Described> participants_;  // by code
  std::int64_t participant_ = -1;
  int session_ = 0;
  std::string session_stem_, scans_stem_;
  int run_ = 0;  // of BIDS, within the session; 0: it has no servo samples
  Table table_;
  std::optional<BidsRecording> recording_;
  // Rows by scans_stem_; the participants of several protocols may share a session's files.
  std::map<std::string, std::string> scans_;
  std::optional<DerivedTable> derived_;  // of the session
  DelimitedRow row_{DelimitedFormat::tsv};
  std::deque<std::future<void>> closing_;  // files under way
};

/// "sub-S001/ses-1/KIND/sub-S001_ses-1": begin of the names of a session's files.
std::string session_files(const StoredTrial& trial, const std::string& kind) {
  const std::string who = "sub-" + trial.participant.code;
  const std::string when = "ses-" + std::to_string(trial.record.session);
  return who + "/" + when + "/" + (kind.empty() ? "" : kind + "/") + who + "_" + when;
}

void BidsWriter::begin_session(const StoredTrial& trial) {
  end_session();
  const std::string who = "sub-" + trial.participant.code;
  const std::string when = "ses-" + std::to_string(trial.record.session);
  participant_ = trial.participant.id;
  session_ = trial.record.session;
  session_stem_ = who + "/" + when + "/beh/" + who + "_" + when + "_task-" +
                  labels_.at(trial.protocol_sha256).label;
  run_ = store_.has_samples(trial.participant, session_) ? 1 : 0;
  const std::string simulated = trial.participant.simulated ? "1" : "0";
  const std::string group = clock_.groups().of(trial.participant, trial.protocol_sha256);
  const auto [at, added] =
      participants_.emplace(trial.participant.code, Described{simulated, group});
  if (!added && at->second.simulated != simulated) at->second.simulated = "mixed";
  if (!added && at->second.group != group) at->second.group = "mixed";
  scans_stem_ = session_files(trial, "");
  if (!settings_.derived) return;
  const std::string stem =
      "derivatives/palpate/" + session_stem_ + "_desc-" + settings_.derived->name + "_beh";
  derived_.emplace(folder_.prepare(stem + ".tsv"), DelimitedFormat::tsv, *settings_.derived);
  write(stem + ".json",
        json_text(describe_derived(*settings_.derived, labels_.at(trial.protocol_sha256).facts)));
}

void BidsWriter::end_session() {
  if (derived_) derived_->close();
  derived_.reset();
}

void BidsWriter::add(const StoredTrial& trial) {
  if (trial.participant.id != participant_ || trial.record.session != session_) {
    end_table();
    begin_session(trial);
  } else if (recording_ && !recording_->continues_with(trial)) {
    end_table();
    ++run_;
  }
  if (table_.rows.empty()) {
    table_.study = &labels_.at(trial.protocol_sha256);
    table_.stem = session_stem_ + (run_ > 0 ? "_run-" + std::to_string(run_) : "");
    table_.person = trial.participant;
    const std::string run = run_ > 0 ? "_run-" + std::to_string(run_) : "";
    const std::string task = "_task-" + table_.study->label;
    table_.motion = session_files(trial, "motion") + task;
    table_.run = run;
    if (run_ > 0) recording_.emplace(trial, *table_.study, settings_);
  }
  add_row(trial);
  if (derived_ && !trial.record.practice) derived_->add(trial);
  if (!recording_) return;
  recording_->add(trial, folder_.prepare(recording_name()));
  samples_ += static_cast<std::int64_t>(trial.record.samples.size());
}

void BidsWriter::add_row(const StoredTrial& trial) {
  row_ << duration_of(trial.record);
  put_columns_of_trial(row_, trial, clock_);
  table_.rows.push_back(
      {to_unix_ns(trial.run.clock, first_onset_ns(trial.record)), trial.record.trial, row_.end()});
  const ClockStamp& clock = trial.run.clock;
  if (table_.runs.empty() || table_.runs.back().clock.utc_ns != clock.utc_ns ||
      table_.runs.back().clock.monotonic_ns != clock.monotonic_ns) {
    table_.runs.push_back(trial.run);
  }
}

void BidsWriter::end_table() {
  if (!table_.rows.empty()) {
    write_table();
    write_sidecar();
  }
  std::unique_ptr<BidsRecording::File> file;
  if (recording_) file = recording_->finish();
  if (file) write_recording();
  if (file) close(std::move(file));
  recording_.reset();
  table_ = {};
}

/// The next trials are written while the rest of this file is compressed.
void BidsWriter::close(std::unique_ptr<BidsRecording::File> file) {
  if (settings_.jobs == 1) {
    file->close();
    return;
  }
  if (closing_.size() == static_cast<std::size_t>(settings_.jobs)) wait_for_one();
  closing_.push_back(std::async(std::launch::async, [file = std::move(file)] { file->close(); }));
}

void BidsWriter::wait_for_one() {
  std::future<void> first = std::move(closing_.front());
  closing_.pop_front();
  first.get();
}

void BidsWriter::note_clock(Json& json) const {
  const auto& rows = table_.rows;
  Json notes = Json::array();
  for (std::size_t i = 1; i < rows.size(); ++i) {
    if (rows[i].onset_ns >= rows[i - 1].onset_ns) continue;
    notes.push_back({{"BeforeTrial", rows[i].trial},
                     {"Seconds", seconds_between(rows[i - 1].onset_ns, rows[i].onset_ns)}});
  }
  if (notes.empty()) return;
  json["ClockSetBack"] = std::move(notes);
  json["ClockSetBackNote"] =
      "The computer's clock was set back before these trials: by its time they began before the "
      "trial above them. The rows are in the order in which they were shown; onsets, dates and "
      "elapsed times do not compare across such a place";
}

std::string BidsWriter::recording_name() const {
  if (!settings_.motion) return table_.stem + "_recording-haptic_physio.tsv.gz";
  return table_.motion + "_tracksys-" + kTrackingSystem + table_.run + "_motion.tsv";
}

/// Writes the recording and its descriptions.
void BidsWriter::write_recording() {
  if (!settings_.motion) {
    write(table_.stem + "_recording-haptic_physio.json", json_text(recording_->physio_sidecar()));
    return;
  }
  const std::string tracked = table_.motion + "_tracksys-" + kTrackingSystem + table_.run;
  const std::string events = table_.motion + table_.run + "_events";
  write(tracked + "_motion.json", json_text(recording_->motion_sidecar()));
  write(tracked + "_channels.tsv", motion_channels(recording_->columns()));
  write(tracked + "_channels.json", json_text(motion_frames()));
  write(events + ".tsv", recording_->motion_events());
  write(events + ".json", json_text(MotionEvents::description(table_.study->facts)));
  const std::string name = recording_name();
  scans_[scans_stem_] += name.substr(name.find("/motion/") + 1) + "\t" +
                         clock_.utc(table_.person, recording_->first_row_ns()) + "\n";
}

void BidsWriter::write_table() {
  const auto& rows = table_.rows;
  FileSink file(folder_.prepare(table_.stem + "_beh.tsv"));
  row_ << kOnset.name << kDuration.name << beh_columns(clock_);
  file.write(row_.end());
  for (const Row& row : rows) {
    row_ << seconds_between(rows.front().onset_ns, row.onset_ns);
    const std::string_view onset = row_.end();
    file.write(onset.substr(0, onset.size() - 1));
    file.write("\t");
    file.write(row.rest);
  }
  file.close(false);
}

void BidsWriter::write_sidecar() {
  const StudyLabel& study = *table_.study;
  Json json{{"TaskName", study.protocol.name},
            {"TaskDescription", study.facts.title},
            {"Simulated", table_.person.simulated}};
  if (table_.person.simulated) json["SimulatedNote"] = kSimulatedSentence;
  note_clock(json);
  for (const RunInfo& run : table_.runs) {
    json["Sittings"].push_back(describe_run(run, table_.person, clock_));
  }
  for (const Column& column : {kOnset, kDuration}) {
    json[column.name] = describe_column(column, study.facts, settings_.fault_bits);
  }
  for (const Column& column : beh_columns(clock_)) {
    Json& about = json[column.name] = describe_column(column, study.facts, settings_.fault_bits);
    const Json levels = recorded_levels(column.name, table_.runs, study);
    if (!levels.is_null()) about["Levels"] = levels;
  }
  if (recording_ && settings_.motion) recording_->put_trials(json);
  write(table_.stem + "_beh.json", json_text(json));
}

std::string BidsWriter::begin_pages() {
  const ProtocolFacts facts = all_facts(labels_);
  Json json;
  for (const Column& column : page_columns())
    json[column.name] = describe_column(column, facts, settings_.fault_bits);
  for (const auto& [place, question] : facts.questions) json["item"]["Levels"][place] = question;
  write("sourcedata/pages.json", json_text(json));
  return "sourcedata/pages.csv";
}

void BidsWriter::describe_participants() {
  // Answers are personal data.
  const std::vector<ParticipantColumn> columns =
      settings_.pages ? participant_columns(store_) : std::vector<ParticipantColumn>();
  row_ << "participant_id"
       << "simulated";
  const bool groups = clock_.groups().any();
  if (groups) row_ << group_column().name;
  for (const ParticipantColumn& one : columns) row_ << one.from.column;
  std::string table(row_.end());
  for (const auto& [code, described] : participants_) {
    row_ << "sub-" + code << described.simulated;
    if (groups) row_ << described.group;
    for (const ParticipantColumn& one : columns) {
      const auto answer = one.answers.find(code);
      row_ << (answer == one.answers.end() ? std::string() : answer->second);
    }
    table += row_.end();
  }
  write("participants.tsv", table);
  Json json{
      {"participant_id", {{"Description", "Pseudonym of the participant"}}},
      {"simulated",
       {{"Description", "Person or simulated participant"},
        {"Levels",
         {{"0", "a person"},
          {"1", "a SIMULATED participant, not a person"},
          {"mixed", "simulated with one protocol, a person with another: see the beh.tsv"}}}}}};
  if (groups) {
    Json& about = json[group_column().name] = {
        {"Description", "Group of the participant; mixed: another one in another protocol"}};
    for (const std::string& name : clock_.groups().names())
      about["Levels"][name] = "a group of the protocol";
  }
  for (const ParticipantColumn& one : columns) {
    Json& about = json[one.from.column] = {{"Description", one.from.question}};
    if (one.from.column == "age") about["Units"] = "year";
    for (const std::string& choice : one.from.choices)
      about["Levels"][guarded_text(choice)] = "an answer to choose";
  }
  write("participants.json", json_text(json));
}

/// In BIDS, derivatives are a separate dataset.
void BidsWriter::describe_derivatives(bool simulated) {
  if (!settings_.derived) return;
  const Json json{
      {"Name", dataset_name(labels_, simulated) + ": " + settings_.derived->name},
      {"BIDSVersion", kBidsVersion},
      {"DatasetType", "derivative"},
      {"GeneratedBy",
       {{{"Name", "palpate"},
         {"Version", settings_.program_version},
         {"Description", "palpate export --movement. " + settings_.derived->how +
                             (simulated ? std::string(" ") + kSimulatedSentence : "")}}}}};
  write("derivatives/palpate/dataset_description.json", json_text(json));
}

void BidsWriter::describe_dataset(bool simulated) {
  end_session();
  while (!closing_.empty()) wait_for_one();
  for (const auto& [stem, rows] : scans_) write(stem + "_scans.tsv", "filename\tacq_time\n" + rows);
  describe_derivatives(simulated);
  describe_participants();
  for (const auto& [sha256, study] : labels_) {
    write("sourcedata/" + study.label + "_protocol.json", study.protocol.text);
    write_protocol_files(store_, study, "stimuli", folder_);
  }
  Json json{{"Name", dataset_name(labels_, simulated)},
            {"BIDSVersion", kBidsVersion},
            {"DatasetType", "raw"},
            {"GeneratedBy",
             {{{"Name", "palpate"},
               {"Version", settings_.program_version},
               {"Description", "palpate export --format bids; trials recorded by palpate"}}}}};
  json.update(bids_fields(settings_.about));
  write("dataset_description.json", json_text(json));
  write("README", readme_text(labels_, simulated, clock_.relative(), settings_));
}

bool BidsWriter::has_file(const std::string& name) {
  static const std::regex pattern(
      R"(dataset_description\.json|README|participants\.(tsv|json)|)"
      R"(sourcedata/([0-9A-Za-z]+_protocol\.json|attempts\.csv|pages\.(csv|json))|stimuli/[0-9A-Za-z]+/[^/]+|)"
      R"(sub-[0-9A-Za-z]+/ses-\d+/beh/sub-[0-9A-Za-z]+_ses-\d+_task-[0-9A-Za-z]+(_run-\d+)?)"
      R"((_beh\.(tsv|json)|_recording-haptic_physio\.(tsv\.gz|json))|)"
      R"(sub-[0-9A-Za-z]+/ses-\d+/sub-[0-9A-Za-z]+_ses-\d+_scans\.tsv|)"
      R"(sub-[0-9A-Za-z]+/ses-\d+/motion/sub-[0-9A-Za-z]+_ses-\d+_task-[0-9A-Za-z]+)"
      R"((_run-\d+_events|_tracksys-stylus_run-\d+_(motion|channels))\.(tsv|json)|)"
      R"(derivatives/palpate/(dataset_description\.json|)"
      R"(sub-[0-9A-Za-z]+/ses-\d+/beh/sub-[0-9A-Za-z]+_ses-\d+_task-[0-9A-Za-z]+_desc-movement_beh\.(tsv|json)))");
  return std::regex_match(name, pattern);
}

}  // namespace

ExportResult export_bids(Store& store, const std::string& path, const ExportSettings& settings) {
  return export_dataset<BidsWriter>(store, path, settings, "bids");
}

}  // namespace palpate::data
