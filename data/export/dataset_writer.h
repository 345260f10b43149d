#pragma once
// Internal to data/: how an export that is a folder of tables comes about.

#include <string>

#include "data/export/clock.h"
#include "data/export/cut_off_attempts.h"
#include "data/export/settings.h"
#include "data/files/atomic_folder.h"
#include "data/files/text_sink.h"
#include "data/store/export_log.h"
#include "data/store/store.h"

namespace palpate::data {

/// All trials, then the attempts that were cut off, then what describes them. The folder appears
/// whole, or not at all, and the database knows of it.
/// \tparam Writer  of one format; it decides which files there are
/// \param format   its name
/// \throws StoreRefused, StoreError as require_replaceable and AtomicFolder do.
template <class Writer>
ExportResult export_dataset(Store& store, const std::string& path, const ExportSettings& settings,
                            const std::string& format) {
  require_replaceable(path, settings.force, Writer::has_file);
  require_exportable(store);
  ExportResult done;
  ExportedParticipants people;
  ProgressCounter counter(settings);
  const ExportClock clock(store, settings.times);
  Writer writer(store, path, settings, clock);
  store.for_each_trial(
      [&](const StoredTrial& trial) {
        writer.add(trial);
        people.add(trial.participant);
        ++done.trials;
        counter.next();
      },
      store.counts().sampled > 0);
  writer.end_table();
  done.samples = writer.samples();
  if (store.counts().cut_off > 0) {
    FileSink file(writer.folder().place(writer.begin_attempts()));
    done.attempts = write_attempts(store, file, clock, people, counter);
    file.close(false);
  }
  done.simulated = people.any_simulated();
  writer.describe_dataset(done.simulated);
  done.not_recorded = people.record(store.path(), path, format);
  writer.folder().commit(settings.force);
  return done;
}

}  // namespace palpate::data
