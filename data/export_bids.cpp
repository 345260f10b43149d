#include "data/export_bids.h"

#include <algorithm>
#include <regex>

#include "data/bids_recording.h"
#include "data/dataset.h"
#include "data/export_dataset.h"
#include "data/table_fields.h"
#include "data/text_sink.h"
#include "data/utc.h"

namespace palpate {
namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kBidsVersion = "1.9.0";

/// The columns of trials.csv that a beh.tsv has: whose they are is in its name.
std::span<const Column> beh_columns() { return trial_columns().subspan(1); }

const Column kOnset{"onset", "First tick with forces on, from that of the first row", "s"};
const Column kDuration{"duration", "From onset to the response, or the limit for a time-out", "s"};

Json describe(const Column& column, const ProtocolFacts& facts) {
  Json json{{"Description", column.description}};
  if (*column.unit != '\0') json["Units"] = column.unit;
  if (const Json levels = levels_of(column, facts); !levels.is_null()) json["Levels"] = levels;
  return json;
}

/// The values of the columns that name what a session was run with.
Json found_in(const std::string& column, const std::vector<RunInfo>& runs,
              const StudyLabel& study) {
  Json levels;
  if (column == "protocol_sha256") {
    levels[study.protocol.sha256] = "sourcedata/" + study.label + "_protocol.json";
  }
  for (const RunInfo& run : runs) {
    if (column == "device") levels[run.device] = "as given to palpate run --device";
    if (column == "program_version") levels[run.program_version] = "palpate " + run.program_version;
    if (column == "observer_sha256" && run.observer_sha256.empty()) levels["n/a"] = "a person";
    if (column == "observer_sha256" && !run.observer_sha256.empty()) {
      levels[run.observer_sha256] = "settings of the simulated participant";
    }
  }
  return levels;
}

Json describe(const RunInfo& run) {
  Json json{{"StartedUTC", format_utc(run.clock.utc_ns)},
            {"ProgramVersion", run.program_version},
            {"Build", run.build},
            {"Device", run.device},
            {"DeviceCalibration", run.device_calibration},
            {"ResponseDevice", run.response_device},
            {"Hand", run.hand}};
  json["ResponseLatency"] = run.response_latency ? Json(*run.response_latency) : Json("unknown");
  return json;
}

std::string padded(int number, std::size_t digits) {
  const std::string text = std::to_string(number);
  return std::string(digits - std::min(digits, text.size()), '0') + text;
}

class BidsWriter {
 public:
  BidsWriter(Store& store, const std::string& path, const ExportSettings& settings)
      : store_(store), labels_(label_protocols(store, settings)), folder_(path) {}

  /// Whether an export of ours has such a file.
  static bool has_file(const std::string& name);

  DraftFolder& folder() { return folder_; }
  static std::string begin_attempts() { return "sourcedata/attempts.csv"; }
  void add(const StoredTrial& trial);
  void end_table();
  void describe_dataset(const std::string& version, bool all_simulated);
  std::int64_t samples() const { return samples_; }

 private:
  struct Row {
    std::int64_t onset_ns = 0;
    std::string rest;  // from the second column on, with its end
  };
  /// The session, or with samples the trial, that is being gathered.
  struct Table {
    std::string stem;  // of its files, with folders
    const StudyLabel* study = nullptr;
    std::vector<Row> rows;
    std::vector<RunInfo> runs;
    bool simulated = false;
  };
  void write(const std::string& name, const std::string& text) {
    FileSink file(folder_.place(name));
    file.write(text);
    file.close(false);
  }
  void add_row(Table& table, const StoredTrial& trial);
  void write_table(Table& table);
  void describe_participants();

  Store& store_;
  const std::map<std::string, StudyLabel> labels_;
  DraftFolder folder_;
  std::map<std::string, std::string> people_;  // code -> simulated
  std::int64_t participant_ = -1;
  int session_ = 0;
  bool sampled_ = false;  // the session has servo samples
  Table table_;
  TableRow row_{TableStyle::tsv};
  std::int64_t samples_ = 0;
};

void BidsWriter::add(const StoredTrial& trial) {
  const TrialRecord& record = trial.record;
  const std::string who = "sub-" + trial.participant.code;
  const std::string when = "ses-" + std::to_string(record.session);
  if (trial.participant.id != participant_ || record.session != session_) {
    end_table();
    participant_ = trial.participant.id;
    session_ = record.session;
    sampled_ = store_.has_samples(trial.participant, session_);
    table_.study = &labels_.at(trial.protocol_sha256);
    table_.stem = who + "/" + when + "/beh/" + who + "_" + when + "_task-" + table_.study->label;
    table_.simulated = trial.participant.simulated;
    const std::string simulated = trial.participant.simulated ? "1" : "0";
    const auto [at, added] = people_.emplace(trial.participant.code, simulated);
    if (!added && at->second != simulated) at->second = "mixed";
  }
  if (!sampled_) {
    add_row(table_, trial);
    return;
  }
  Table one = table_;
  one.stem += "_run-" + padded(record.trial, 4);
  add_row(one, trial);
  write_table(one);
  if (record.samples.empty()) return;
  write(one.stem + "_recording-haptic_physio.json",
        json_text(describe_recording(trial, one.study->facts.servo_rate)));
  FileSink file(folder_.place(one.stem + "_recording-haptic_physio.tsv.gz"));
  write_recording(record.samples, file);
  file.close(false);
  samples_ += static_cast<std::int64_t>(record.samples.size());
}

void BidsWriter::add_row(Table& table, const StoredTrial& trial) {
  row_ << trial.record.response_time;
  put_trial_but_who(row_, trial);
  table.rows.push_back({to_unix_ns(trial.run.clock, trial.record.onset_ns), row_.end()});
  const ClockStamp& clock = trial.run.clock;
  if (table.runs.empty() || table.runs.back().clock.utc_ns != clock.utc_ns ||
      table.runs.back().clock.monotonic_ns != clock.monotonic_ns) {
    table.runs.push_back(trial.run);
  }
}

void BidsWriter::end_table() {
  if (!table_.rows.empty()) write_table(table_);
  table_ = {};
}

void BidsWriter::write_table(Table& table) {
  std::stable_sort(table.rows.begin(), table.rows.end(),
                   [](const Row& a, const Row& b) { return a.onset_ns < b.onset_ns; });
  FileSink file(folder_.place(table.stem + "_beh.tsv"));
  row_ << kOnset.name << kDuration.name << beh_columns();
  file.write(row_.end());
  for (const Row& row : table.rows) {
    // Without sign: damaged times may lie further apart than 63 bits reach.
    const auto since = static_cast<std::uint64_t>(row.onset_ns) -
                       static_cast<std::uint64_t>(table.rows.front().onset_ns);
    row_ << static_cast<double>(since) / 1e9;
    const std::string_view onset = row_.end();
    file.write(onset.substr(0, onset.size() - 1));
    file.write("\t");
    file.write(row.rest);
  }
  file.close(false);

  Json json{{"TaskName", table.study->protocol.name},
            {"TaskDescription", table.study->facts.title},
            {"Simulated", table.simulated}};
  if (table.simulated) json["SimulatedNote"] = kSimulatedSentence;
  for (const RunInfo& run : table.runs) json["Sittings"].push_back(describe(run));
  for (const Column& column : {kOnset, kDuration}) {
    json[column.name] = describe(column, table.study->facts);
  }
  for (const Column& column : beh_columns()) {
    Json& about = json[column.name] = describe(column, table.study->facts);
    const Json levels = found_in(column.name, table.runs, *table.study);
    if (!levels.is_null()) about["Levels"] = levels;
  }
  write(table.stem + "_beh.json", json_text(json));
}

void BidsWriter::describe_participants() {
  std::string table = "participant_id\tsimulated\n";
  for (const auto& [code, simulated] : people_) table += "sub-" + code + "\t" + simulated + "\n";
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

void BidsWriter::describe_dataset(const std::string& version, bool simulated) {
  describe_participants();
  for (const auto& [sha256, study] : labels_) {
    write("sourcedata/" + study.label + "_protocol.json", study.protocol.text);
  }
  const Json json{
      {"Name", dataset_name(labels_, simulated)},
      {"BIDSVersion", kBidsVersion},
      {"DatasetType", "raw"},
      {"GeneratedBy",
       {{{"Name", "palpate"},
         {"Version", version},
         {"Description", "palpate export --format bids; trials recorded by palpate"}}}}};
  write("dataset_description.json", json_text(json));
  write("README",
        dataset_name(labels_, simulated) + "\n\n" + dataset_description(labels_, simulated) +
            "\n\n"
            "sub-CODE/ses-S/beh/ holds the trials of session S of a participant, one row a trial, "
            "sorted by\nonset. Every column is described in the JSON file beside the table. The "
            "protocol that was run\nis in sourcedata/, byte for byte; protocol_sha256 is its "
            "checksum.\n\n"
            "Where a table's name has run-N, servo-rate samples were kept: run N is trial N of the "
            "session,\nits table has one row with onset 0, and recording-haptic has one row a "
            "servo tick. StartTime\nis counted from that onset, the first tick with forces on. "
            "Ticks that were not recorded are\nrows of n/a. Trials of a session follow each other "
            "by onset_utc.\n\n"
            "sourcedata/attempts.csv, where it is there, lists attempts that were cut off; their "
            "trials were\nshown again. They are in no other table.\n");
}

bool BidsWriter::has_file(const std::string& name) {
  static const std::regex pattern(
      R"(dataset_description\.json|README|participants\.(tsv|json)|)"
      R"(sourcedata/([0-9A-Za-z]+_protocol\.json|attempts\.csv)|)"
      R"(sub-[0-9A-Za-z]+/ses-\d+/beh/sub-[0-9A-Za-z]+_ses-\d+_task-[0-9A-Za-z]+(_run-\d+)?)"
      R"((_beh\.(tsv|json)|_recording-haptic_physio\.(tsv\.gz|json)))");
  return std::regex_match(name, pattern);
}

}  // namespace

ExportDone export_bids(Store& store, const std::string& path, const ExportSettings& settings) {
  return export_dataset<BidsWriter>(store, path, settings, "bids");
}

}  // namespace palpate
