#pragma once
// Internal to data/export: the part that BIDS and Psych-DS have in common: a folder of tables that
// appears complete or not at all, and that the database records.

#include <cstdint>
#include <map>
#include <string>

#include "data/export/clock.h"
#include "data/export/cut_off_attempts.h"
#include "data/export/dataset_description.h"
#include "data/export/page_table.h"
#include "data/export/settings.h"
#include "data/files/atomic_folder.h"
#include "data/files/text_sink.h"
#include "data/store/export_log.h"
#include "data/store/store.h"

namespace palpate::data {

/// Writes the files of one dataset. A format derives from it and decides which files there are; it
/// has a static has_file(name) as well: whether its exports contain such a file.
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
  /// Writes what describes the tables, after all of them. \param simulated participants are in it
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
