#include <optional>
#include <regex>
#include <set>
#include <string_view>

#include "data/base/markdown.h"
#include "data/export/column_values.h"
#include "data/export/dataset_description.h"
#include "data/export/datasets.h"
#include "data/export/delimited_row.h"
#include "data/export/derived_table.h"
#include "data/export/exported_columns.h"
#include "data/export/page_table.h"
#include "data/export/sample_slots.h"
#include "data/files/text_sink.h"

namespace palpate::data {
namespace {

using Json = nlohmann::ordered_json;

const Column kTimeOfTick{"time", "Time of the tick, from the first tick with forces on", "s"};

/// ". Values: 0 = no; 1 = yes." \param meanings value -> meaning; null: none
std::string listed_meanings(const char* title, const Json& meanings) {
  if (meanings.is_null()) return "";
  std::string text = std::string(". ") + title + ":";
  for (const auto& [value, meaning] : meanings.items()) {
    text += " " + value + " = " + meaning.get<std::string>() + ";";
  }
  text.back() = '.';
  return text;
}

/// An entry of variableMeasured: https://schema.org/PropertyValue
Json describe_variable(const Column& column, const ProtocolFacts& facts,
                       const std::vector<FaultMeaning>& fault_bits) {
  const std::string text = column.description +
                           listed_meanings("Values", column_levels(column, facts)) +
                           listed_meanings("Bits", column_bits(column, fault_bits));
  Json variable{{"@type", "PropertyValue"}, {"name", column.name}, {"description", text}};
  if (*column.unit != '\0') variable["unitText"] = unit_of(column, facts);
  return variable;
}

std::string dataset_readme(const std::string& name, const std::string& description, bool relative,
                           const ExportSettings& settings) {
  const std::string derived =
      settings.derived ? "`..._description-movement_data.csv` holds measures derived from the "
                         "samples, one row per trial.\n" +
                             settings.derived->how + "\n"
                       : "";
  return "# " + as_markdown(name) + "\n\n" + as_paragraph(description) + "\n\n" +
         about_text(settings.about) +
         "`data/subject-CODE/study-T_subject-CODE_data.csv` holds all trials of a participant, "
         "one row per trial.\n"
         "`..._session-S_description-haptic_data.csv`, if present, holds the servo-rate "
         "samples of session S,\none row per tick; `time` counts from the first tick with forces "
         "on "
         "of its trial, which is the `onset_utc` of\nthat trial (with several intervals, from that "
         "of the "
         "first one). The stimulus, its orientation and\nthe renderer are in the "
         "trial's "
         "row. Positions are rounded to 1 nm, forces to "
         "1 uN and torques to 1 uN m.\n" +
         derived +
         "`data/study-T_description-attempts_data.csv`, if present, lists attempts that "
         "were cut off; their\ntrials were shown again.\n"
         "`data/study-T_description-pages_data.csv`, if present, has the participants' "
         "answers "
         "to pages:\npersonal data.\n"
         "Every column is described in `dataset_description.json`; an empty field is a missing "
         "value. The protocol\nthat was run is in `materials/`, byte for byte; "
         "`protocol_sha256` is its checksum.\n\n" +
         (relative ? kRelativeSentence : "") + kGuardSentence;
}

class PsychDsWriter : public DatasetWriter {
 public:
  using DatasetWriter::DatasetWriter;

  /// Whether an export of palpate has such a file.
  static bool has_file(const std::string& name);

  void add(const StoredTrial& trial) override;
  void end_table() override;
  void describe_dataset(bool simulated) override;
  /// One table for all participants and protocols, which are columns of it.
  std::string begin_attempts() override {
    use(attempt_columns(clock_));
    return "data/study-" + labels_.begin()->second.label + "_description-attempts_data.csv";
  }
  std::string begin_pages() override {
    use(page_columns());
    return "data/study-" + labels_.begin()->second.label + "_description-pages_data.csv";
  }

 private:
  void use(std::span<const Column> columns) {
    for (const Column& column : columns) used_.insert(column.name);
  }
  void write_samples(const StoredTrial& trial, const std::string& stem, const ProtocolFacts& facts);
  Json variables() const;

  const std::span<const Column> intervals_ = dataset_form(all_facts(labels_)).intervals;
  std::set<std::string> used_;  // columns
  std::int64_t participant_ = -1;
  int session_ = 0;  // of haptic_
  std::optional<FileSink> table_, haptic_;
  std::optional<DerivedTable> derived_;
  DelimitedRow row_{DelimitedFormat::csv};
};

void PsychDsWriter::add(const StoredTrial& trial) {
  const std::string who = "subject-" + trial.participant.code;
  const StudyLabel& study = labels_.at(trial.protocol_sha256);
  const std::string stem = "data/" + who + "/study-" + study.label + "_" + who;
  if (trial.participant.id != participant_) {
    end_table();
    participant_ = trial.participant.id;
    table_.emplace(folder_.prepare(stem + "_data.csv"));
    row_ << trial_columns(clock_);
    table_->write(row_.end());
    use(trial_columns(clock_));
    if (settings_.derived) {
      derived_.emplace(
          folder_.prepare(stem + "_description-" + settings_.derived->name + "_data.csv"),
          DelimitedFormat::csv, *settings_.derived);
    }
  }
  if (derived_ && !trial.record.practice) derived_->add(trial);
  put_trial(row_, trial, clock_);
  table_->write(row_.end());
  if (!trial.record.samples.empty()) write_samples(trial, stem, study.facts);
}

void PsychDsWriter::end_table() {
  for (std::optional<FileSink>* file : {&table_, &haptic_}) {
    if (*file) (*file)->close(false);
    file->reset();
  }
  if (derived_) derived_->close();
  derived_.reset();
}

void PsychDsWriter::write_samples(const StoredTrial& trial, const std::string& stem,
                                  const ProtocolFacts& facts) {
  const TrialRecord& record = trial.record;
  const bool bodies = has_bodies(facts);
  if (haptic_ && session_ != record.session) {
    haptic_->close(false);
    haptic_.reset();
  }
  if (!haptic_) {
    session_ = record.session;
    haptic_.emplace(folder_.prepare(stem + "_session-" + std::to_string(session_) +
                                    "_description-haptic_data.csv"));
    row_ << "participant_id"
         << "session"
         << "trial";
    row_ << intervals_ << kTimeOfTick.name << sample_columns();
    if (bodies) row_ << body_columns();
    if (settings_.contacts) row_ << contact_columns();
    haptic_->write(row_.end());
    use(intervals_);
    use({&kTimeOfTick, 1});
    use(sample_columns());
    if (bodies) use(body_columns());
    if (settings_.contacts) use(contact_columns());
  }
  std::vector<std::optional<TickContact>> contacts;
  if (settings_.contacts) contacts = settings_.contacts(trial);
  contacts.resize(record.samples.size());
  auto contact = contacts.begin();
  SampleSlots slots(trial, facts.servo_rate);
  for (const SampleRecord& sample : record.samples) {
    const std::int64_t slot = slots.next();
    row_ << trial.participant.code << record.session << record.trial;
    put_interval(row_, intervals_, slots.interval());
    row_ << static_cast<double>(slot) / facts.servo_rate;
    put_sample(row_, sample);
    if (bodies) put_body(row_, record, sample);
    if (settings_.contacts) put_contact(row_, *contact++);
    haptic_->write(row_.end());
  }
  samples_ += static_cast<std::int64_t>(record.samples.size());
}

Json PsychDsWriter::variables() const {
  const ProtocolFacts facts = all_facts(labels_);
  Json all = Json::array();
  std::set<std::string> described;
  const auto add = [&](std::span<const Column> columns) {
    for (const Column& column : columns) {
      if (!used_.contains(column.name) || !described.insert(column.name).second) continue;
      all.push_back(describe_variable(column, facts, settings_.fault_bits));
    }
  };
  add(trial_columns(clock_));
  add(attempt_columns(clock_));
  add(intervals_);
  add({&kTimeOfTick, 1});
  add(sample_columns());
  add(body_columns());
  add(contact_columns());
  add(page_columns());
  if (settings_.derived) {
    for (const DerivedColumn& column : settings_.derived->columns) {
      if (!described.insert(column.name).second) continue;  // a trial's own column of that name
      Json variable{
          {"@type", "PropertyValue"}, {"name", column.name}, {"description", column.description}};
      if (column.unit != "1") variable["unitText"] = column.unit;
      all.push_back(std::move(variable));
    }
    all.push_back(describe_variable(DerivedTable::missing(), facts, {}));
  }
  return all;
}

void PsychDsWriter::describe_dataset(bool simulated) {
  for (const auto& [sha256, study] : labels_) {
    write("materials/" + study.label + "_protocol.json", study.protocol.text);
    write_protocol_files(store_, study, "materials", folder_);
  }
  const std::string name = dataset_name(labels_, simulated),
                    description = dataset_description(labels_, simulated);
  Json json{{"@context", "https://schema.org/"},
            {"@type", "Dataset"},
            {"name", name},
            {"description", description}};
  json.update(schema_org_terms(settings_.about));
  json["measurementTechnique"] = "palpate " + settings_.program_version;
  json["variableMeasured"] = variables();
  write("dataset_description.json", json_text(json));
  write("README.md", dataset_readme(name, description, clock_.relative(), settings_));
}

bool PsychDsWriter::has_file(const std::string& name) {
  static const std::regex pattern(
      R"(dataset_description\.json|README\.md|materials/[0-9A-Za-z]+(_protocol\.json|/[^/]+)|)"
      R"(data/study-[0-9A-Za-z]+_description-(attempts|pages)_data\.csv|)"
      R"(data/subject-[0-9A-Za-z]+/study-[0-9A-Za-z]+_subject-[0-9A-Za-z]+)"
      R"(((_session-\d+(_trial-\d+)?_description-haptic|_description-movement))?_data\.csv)");
  return std::regex_match(name, pattern);
}

}  // namespace

ExportResult export_psychds(Store& store, const std::string& path, const ExportSettings& settings) {
  return export_dataset<PsychDsWriter>(store, path, settings, "psych-ds");
}

}  // namespace palpate::data
