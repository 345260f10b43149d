#include "data/export_psychds.h"

#include <optional>
#include <regex>
#include <set>
#include <string_view>

#include "data/dataset.h"
#include "data/export_dataset.h"
#include "data/table_fields.h"
#include "data/text_sink.h"

namespace palpate {
namespace {

using Json = nlohmann::ordered_json;

const Column kTimeOfTick{"time", "Time of the tick, from the first tick with forces on", "s"};

class PsychDsWriter {
 public:
  PsychDsWriter(Store& store, const std::string& path, const ExportSettings& settings)
      : labels_(label_protocols(store, settings)), folder_(path) {}

  /// Whether an export of ours has such a file.
  static bool has_file(const std::string& name);

  DraftFolder& folder() { return folder_; }
  void add(const StoredTrial& trial);
  void end_table();
  void use(std::span<const Column> columns) {
    for (const Column& column : columns) used_.insert(column.name);
  }
  void describe_dataset(const std::string& version, bool simulated);
  /// One table for all: an attempt names its participant and its protocol.
  std::string begin_attempts() {
    use(attempt_columns());
    return "data/study-" + labels_.begin()->second.label + "_description-attempts_data.csv";
  }
  std::int64_t samples() const { return samples_; }

 private:
  void write(const std::string& name, const std::string& text) {
    FileSink file(folder_.place(name));
    file.write(text);
    file.close(false);
  }
  void write_samples(const StoredTrial& trial, const std::string& stem, double servo_rate);
  Json variables() const;

  const std::map<std::string, StudyLabel> labels_;
  DraftFolder folder_;
  std::set<std::string> used_;  // columns
  std::int64_t participant_ = -1;
  std::optional<FileSink> table_;
  TableRow row_{TableStyle::csv};
  std::int64_t samples_ = 0;
};

void PsychDsWriter::add(const StoredTrial& trial) {
  const std::string who = "subject-" + trial.participant.code;
  const StudyLabel& study = labels_.at(trial.protocol_sha256);
  const std::string stem = "data/" + who + "/study-" + study.label + "_" + who;
  if (trial.participant.id != participant_) {
    end_table();
    participant_ = trial.participant.id;
    table_.emplace(folder_.place(stem + "_data.csv"));
    row_ << trial_columns();
    table_->write(row_.end());
    use(trial_columns());
  }
  put_trial(row_, trial);
  table_->write(row_.end());
  if (!trial.record.samples.empty()) write_samples(trial, stem, study.facts.servo_rate);
}

void PsychDsWriter::end_table() {
  if (table_) table_->close(false);
  table_.reset();
}

void PsychDsWriter::write_samples(const StoredTrial& trial, const std::string& stem,
                                  double servo_rate) {
  const TrialRecord& record = trial.record;
  FileSink file(folder_.place(stem + "_session-" + std::to_string(record.session) + "_trial-" +
                              std::to_string(record.trial) + "_description-haptic_data.csv"));
  row_ << "participant_id"
       << "session"
       << "trial" << kTimeOfTick.name << sample_columns();
  file.write(row_.end());
  for (const SampleRecord& sample : record.samples) {
    row_ << trial.participant.code << record.session << record.trial << sample.tick / servo_rate;
    put_sample(row_, sample);
    file.write(row_.end());
  }
  file.close(false);
  use({&kTimeOfTick, 1});
  use(sample_columns());
  samples_ += static_cast<std::int64_t>(record.samples.size());
}

Json PsychDsWriter::variables() const {
  ProtocolFacts facts;
  for (const auto& [sha256, study] : labels_) {
    facts.stimuli.insert(facts.stimuli.end(), study.facts.stimuli.begin(),
                         study.facts.stimuli.end());
  }
  Json all = Json::array();
  std::set<std::string> named;
  const auto add = [&](std::span<const Column> columns) {
    for (const Column& column : columns) {
      if (!used_.contains(column.name) || !named.insert(column.name).second) continue;
      std::string text = column.description;
      if (const Json levels = levels_of(column, facts); !levels.is_null()) {
        text += ". Values:";
        for (const auto& [value, meaning] : levels.items()) {
          text += " " + value + " = " + meaning.get<std::string>() + ";";
        }
        text.back() = '.';
      }
      Json& one = all.emplace_back(
          Json{{"@type", "PropertyValue"}, {"name", column.name}, {"description", text}});
      if (*column.unit != '\0') one["unitText"] = column.unit;
    }
  };
  add(trial_columns());
  add(attempt_columns());
  add({&kTimeOfTick, 1});
  add(sample_columns());
  return all;
}

void PsychDsWriter::describe_dataset(const std::string& version, bool simulated) {
  for (const auto& [sha256, study] : labels_) {
    write("materials/" + study.label + "_protocol.json", study.protocol.text);
  }
  const std::string name = dataset_name(labels_, simulated),
                    about = dataset_description(labels_, simulated);
  write("dataset_description.json", json_text({{"@context", "https://schema.org/"},
                                               {"@type", "Dataset"},
                                               {"name", name},
                                               {"description", about},
                                               {"measurementTechnique", "palpate " + version},
                                               {"variableMeasured", variables()}}));
  write("README.md",
        "# " + name + "\n\n" + about +
            "\n\n"
            "`data/subject-CODE/study-T_subject-CODE_data.csv` holds all trials of a participant, "
            "one row a trial.\n"
            "`..._session-S_trial-N_description-haptic_data.csv`, where it is there, holds the "
            "servo-rate samples of\ntrial N of session S, one row a tick; `time` counts from the "
            "first tick with forces on, which is the\n`onset_utc` of that trial.\n"
            "`data/study-T_description-attempts_data.csv`, where it is there, lists attempts that "
            "were cut off; their\ntrials were shown again.\n"
            "Every column is described in `dataset_description.json`; an empty field is a missing "
            "value. The protocol\nthat was run is in `materials/`, byte for byte; "
            "`protocol_sha256` is its checksum.\n");
}

bool PsychDsWriter::has_file(const std::string& name) {
  static const std::regex pattern(
      R"(dataset_description\.json|README\.md|materials/[0-9A-Za-z]+_protocol\.json|)"
      R"(data/study-[0-9A-Za-z]+_description-attempts_data\.csv|)"
      R"(data/subject-[0-9A-Za-z]+/study-[0-9A-Za-z]+_subject-[0-9A-Za-z]+)"
      R"((_session-\d+_trial-\d+_description-haptic)?_data\.csv)");
  return std::regex_match(name, pattern);
}

}  // namespace

ExportDone export_psychds(Store& store, const std::string& path, const ExportSettings& settings) {
  return export_dataset<PsychDsWriter>(store, path, settings, "psych-ds");
}

}  // namespace palpate
