#pragma once
// Folders of a dataset, and the texts and JSON with which they describe themselves: labels of
// protocols, names, columns.

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "data/export/clock.h"
#include "data/export/csv.h"
#include "data/export/exported_columns.h"
#include "data/export/page_table.h"
#include "data/export/settings.h"
#include "data/files/atomic_folder.h"
#include "data/files/text_sink.h"
#include "data/store/export_log.h"
#include "data/store/store.h"

namespace palpate::data {

/// A protocol and its names in the files of a dataset.
struct StudyLabel {
  std::string label;  ///< letters and digits only, unique within the dataset
  ProtocolInfo protocol;
  ProtocolFacts facts;
  std::map<std::string, std::string> files = {};  ///< named in the protocol -> name in the dataset
};

/// SHA-256 -> label, for all protocols of the database. A label is the letters and digits of the
/// name; equal labels get the checksum appended.
std::map<std::string, StudyLabel> label_protocols(Store& store, const ExportSettings& settings);

/// Writes the files that a protocol names to `folder`/LABEL/ in the dataset.
void write_protocol_files(Store& store, const StudyLabel& study, const std::string& folder,
                          const AtomicFolder& draft);

/// \throws StoreRefused: two codes differ in case only (on case-insensitive file systems their
/// files would collide), or there is no completed trial.
void require_exportable(Store& store);

/// "ho2000", or "ho2000 (SIMULATED participants)".
std::string dataset_name(const std::map<std::string, StudyLabel>& labels, bool simulated);
/// A sentence on the task and the participants.
std::string dataset_description(const std::map<std::string, StudyLabel>& labels, bool simulated);

/// In every description of data with simulated participants.
inline constexpr const char* kSimulatedSentence =
    "The participants marked simulated = 1 are SIMULATED: a mechanistic model of a hand and an "
    "observer, not people.";

/// Value -> meaning, including the names of stimuli as written in the table; null: the values are
/// not codes.
nlohmann::ordered_json column_levels(const Column& column, const ProtocolFacts& facts);
/// The unit from the protocols, if all name the same one.
std::string unit_of(const Column& column, const ProtocolFacts& facts);
/// Fault bit -> meaning for the columns of fault bits; null for others.
nlohmann::ordered_json column_bits(const Column& column,
                                   const std::vector<FaultMeaning>& fault_bits);
/// {"Description": ..., "Units": ..., "Levels": ..., "Bits": ...}
nlohmann::ordered_json describe_column(const Column& column, const ProtocolFacts& facts,
                                       const std::vector<FaultMeaning>& fault_bits);
/// The stimuli of all protocols together.
ProtocolFacts all_facts(const std::map<std::string, StudyLabel>& labels);
/// A text as written in a table, with a guard against formulas if needed.
std::string guarded_text(std::string_view text);

/// Explains relative times.
inline constexpr const char* kRelativeSentence =
    "Dates are shifted: the first trial of every participant is at 1900-01-01T00:00:00Z, and "
    "elapsed "
    "counts\nthe seconds from it. Intervals are true. palpate export --times absolute gives the "
    "true dates.\n\n";

/// Explains how to read guarded texts.
inline constexpr const char* kGuardSentence =
    "A text that begins with = + - @, a tab or a line break has a ' in front, so that no "
    "spreadsheet runs it;\nso has a text that begins with ' and one of these. Remove the first ' "
    "to restore the "
    "text; palpate analyze --csv does.\n";

/// JSON as the text of a file. Invalid UTF-8 is replaced.
std::string json_text(const nlohmann::ordered_json& json);

/// The codebook of trials.csv and attempts.csv (csv.h), with its header.
std::vector<CodebookRow> codebook_rows(const ProtocolFacts& facts, const ExportSettings& settings,
                                       const ExportClock& clock);

/// Writes the files of one dataset: the common part of BIDS and Psych-DS, a folder of tables that
/// appears complete or not at all and is recorded in the database. Each format derives from it and
/// chooses its files; it also has a static has_file(name): whether its exports contain such a file.
class DatasetWriter {
 public:
  DatasetWriter(Store& store, const std::string& path, const ExportSettings& settings,
                const ExportClock& clock)
      : store_(store),
        settings_(settings),
        clock_(clock),
        labels_(label_protocols(store, settings)),
        folder_(path) {}
  virtual ~DatasetWriter() = default;
  DatasetWriter(const DatasetWriter&) = delete;
  DatasetWriter& operator=(const DatasetWriter&) = delete;

  AtomicFolder& folder() { return folder_; }
  virtual void add(const StoredTrial& trial) = 0;
  virtual void end_table() = 0;  ///< after the last trial
  /// \return the name of the table of attempts that were cut off
  virtual std::string begin_attempts() = 0;
  /// \return the name of the table of answers to pages
  virtual std::string begin_pages() = 0;
  /// Writes the descriptions, after all tables. \param simulated the dataset has such participants
  virtual void describe_dataset(bool simulated) = 0;
  std::int64_t samples() const { return samples_; }  ///< written so far

 protected:
  void write(const std::string& name, const std::string& text);

  Store& store_;
  const ExportSettings& settings_;
  const ExportClock& clock_;
  const std::map<std::string, StudyLabel> labels_;  // by the protocol's SHA-256
  AtomicFolder folder_;
  std::int64_t samples_ = 0;
};

/// Exports all completed trials, then the attempts that were cut off, then the descriptions.
/// \tparam Writer  a DatasetWriter
/// \param format   its name, as recorded in the database
/// \throws StoreRefused, StoreError as require_replaceable and AtomicFolder do.
template <class Writer>
ExportResult export_dataset(Store& store, const std::string& path, const ExportSettings& settings,
                            const std::string& format) {
  require_replaceable(path, settings.force, Writer::has_file);
  require_exportable(store);
  ExportResult result;
  ExportedParticipants participants;
  ProgressCounter counter(settings);
  const ExportClock clock(store, settings.times);
  Writer writer(store, path, settings, clock);
  store.for_each_trial(
      [&](const StoredTrial& trial) {
        writer.add(trial);
        participants.add(trial.participant);
        ++result.trials;
        counter.next();
      },
      store.counts().sampled > 0);
  writer.end_table();
  result.samples = writer.samples();
  if (store.counts().cut_off > 0) {
    FileSink file(writer.folder().prepare(writer.begin_attempts()));
    result.attempts = write_attempts(store, file, clock, participants, counter);
    file.close(false);
  }
  if (settings.pages) {
    FileSink file(writer.folder().prepare(writer.begin_pages()));
    result.answers = write_pages(store, file, clock, participants);
    file.close(false);
  }
  result.simulated = participants.any_simulated();
  writer.describe_dataset(result.simulated);
  result.not_recorded = participants.record(
      store.path(), settings.recorded_as.empty() ? path : settings.recorded_as, format);
  writer.folder().commit(settings.force);
  return result;
}

}  // namespace palpate::data
