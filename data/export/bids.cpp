#include "data/export/bids.h"

#include <algorithm>
#include <optional>
#include <regex>

#include "data/export/bids_recording.h"
#include "data/export/column_values.h"
#include "data/export/dataset_description.h"
#include "data/export/dataset_writer.h"
#include "data/export/sample_slots.h"
#include "data/files/text_sink.h"
#include "data/files/utc.h"

namespace palpate::data {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kBidsVersion = "1.9.0";

/// The columns of trials.csv without participant_id, which is in the file name.
std::span<const Column> beh_columns(const ExportClock& clock) {
  return trial_columns(clock.times(), clock.tasks(), clock.torque().any()).subspan(1);
}

const Column kOnset{"onset",
                    "First tick with forces on (of several intervals: in the first one), from that "
                    "of the first row",
                    "s"};
const Column kDuration{"duration", "From onset to the response, or the limit for a time-out", "s"};

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
                        bool relative, const StudyAbout& about) {
  return dataset_name(labels, simulated) + "\n\n" + dataset_description(labels, simulated) +
         "\n\n" + about_text(about) +
         "sub-CODE/ses-S/beh/ holds the trials of session S of a participant, one row a trial, "
         "sorted by\nonset. Every column is described in the JSON file beside the table. The "
         "protocol that was run\nis in sourcedata/, byte for byte; protocol_sha256 is its "
         "checksum.\n\n"
         "Where a table's name has run-N, servo-rate samples were kept: recording-haptic beside "
         "it "
         "holds\nthose of all its trials, one row a period of the servo, and its JSON file where "
         "each trial stands,\nwhich object was felt, how it was turned and with which renderer. A "
         "new run begins with every\nstart of the program and after more than a minute between "
         "two trials. Periods between trials, and\nthose whose tick was missed, are rows of n/a. "
         "Places are rounded to 1 nm, forces to 1 uN and\ntorques to 1 uN m.\n\n" +
         (relative ? kRelativeSentence : "") + kGuardSentence +
         "\n"
         "sourcedata/attempts.csv, where it is there, lists attempts that were cut off; their "
         "trials were\nshown again. They are in no other table. sourcedata/pages.csv, where it is "
         "there, "
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
    std::string rest;  // from the second column on, with the line end
  };
  /// The session, or with samples the BIDS run, whose rows are being collected.
  struct Table {
    std::string stem;  // of its files, with folders
    const StudyLabel* study = nullptr;
    Participant person;
    std::vector<Row> rows;
    std::vector<RunInfo> runs;
  };
  void begin_session(const StoredTrial& trial);
  void add_row(const StoredTrial& trial);
  void write_table();
  void write_sidecar();
  void describe_participants();

  std::map<std::string, std::string> participants_;  // code -> value of the column simulated
  std::int64_t participant_ = -1;
  int session_ = 0;
  std::string session_stem_;
  int run_ = 0;  // of BIDS, within the session; 0: it has no servo samples
  Table table_;
  std::optional<BidsRecording> recording_;
  DelimitedRow row_{DelimitedFormat::tsv};
};

void BidsWriter::begin_session(const StoredTrial& trial) {
  const std::string who = "sub-" + trial.participant.code;
  const std::string when = "ses-" + std::to_string(trial.record.session);
  participant_ = trial.participant.id;
  session_ = trial.record.session;
  session_stem_ = who + "/" + when + "/beh/" + who + "_" + when + "_task-" +
                  labels_.at(trial.protocol_sha256).label;
  run_ = store_.has_samples(trial.participant, session_) ? 1 : 0;
  const std::string simulated = trial.participant.simulated ? "1" : "0";
  const auto [at, added] = participants_.emplace(trial.participant.code, simulated);
  if (!added && at->second != simulated) at->second = "mixed";
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
    if (run_ > 0) recording_.emplace(trial, *table_.study);
  }
  add_row(trial);
  if (!recording_) return;
  recording_->add(trial, folder_.prepare(table_.stem + "_recording-haptic_physio.tsv.gz"));
  samples_ += static_cast<std::int64_t>(trial.record.samples.size());
}

void BidsWriter::add_row(const StoredTrial& trial) {
  row_ << duration_of(trial.record);
  put_trial_without_participant(row_, trial, clock_);
  table_.rows.push_back({to_unix_ns(trial.run.clock, first_onset_ns(trial.record)), row_.end()});
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
  if (recording_) {
    if (const auto about = recording_->finish(settings_.fault_bits)) {
      write(table_.stem + "_recording-haptic_physio.json", json_text(*about));
    }
  }
  recording_.reset();
  table_ = {};
}

void BidsWriter::write_table() {
  auto& rows = table_.rows;
  std::stable_sort(rows.begin(), rows.end(),
                   [](const Row& a, const Row& b) { return a.onset_ns < b.onset_ns; });
  FileSink file(folder_.prepare(table_.stem + "_beh.tsv"));
  row_ << kOnset.name << kDuration.name << beh_columns(clock_);
  file.write(row_.end());
  for (const Row& row : rows) {
    // Unsigned: damaged times may differ by more than 63 bits.
    const auto since = static_cast<std::uint64_t>(row.onset_ns) -
                       static_cast<std::uint64_t>(rows.front().onset_ns);
    row_ << static_cast<double>(since) / 1e9;
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
  std::string table = "participant_id\tsimulated\n";
  for (const auto& [code, simulated] : participants_)
    table += "sub-" + code + "\t" + simulated + "\n";
  write("participants.tsv", table);
  const Json json{
      {"participant_id", {{"Description", "Pseudonym of the participant"}}},
      {"simulated",
       {{"Description", "Who took part"},
        {"Levels",
         {{"0", "a person"},
          {"1", "a SIMULATED participant: no person"},
          {"mixed", "simulated with one protocol, a person with another: see the beh.tsv"}}}}}};
  write("participants.json", json_text(json));
}

void BidsWriter::describe_dataset(bool simulated) {
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
  write("README", readme_text(labels_, simulated, clock_.relative(), settings_.about));
}

bool BidsWriter::has_file(const std::string& name) {
  static const std::regex pattern(
      R"(dataset_description\.json|README|participants\.(tsv|json)|)"
      R"(sourcedata/([0-9A-Za-z]+_protocol\.json|attempts\.csv|pages\.(csv|json))|stimuli/[0-9A-Za-z]+/[^/]+|)"
      R"(sub-[0-9A-Za-z]+/ses-\d+/beh/sub-[0-9A-Za-z]+_ses-\d+_task-[0-9A-Za-z]+(_run-\d+)?)"
      R"((_beh\.(tsv|json)|_recording-haptic_physio\.(tsv\.gz|json)))");
  return std::regex_match(name, pattern);
}

}  // namespace

ExportResult export_bids(Store& store, const std::string& path, const ExportSettings& settings) {
  return export_dataset<BidsWriter>(store, path, settings, "bids");
}

}  // namespace palpate::data
