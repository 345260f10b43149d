#include "data/export/csv.h"

#include <fcntl.h>

#include <deque>
#include <filesystem>
#include <system_error>

#include "data/export/codebook.h"
#include "data/export/column_values.h"
#include "data/export/cut_off_attempts.h"
#include "data/files/atomic_file.h"
#include "data/files/output_check.h"
#include "data/files/text_sink.h"
#include "data/store/export_log.h"

namespace palpate::data {
namespace {

namespace fs = std::filesystem;

/// Large texts in large pieces; the descriptor stays the draft's.
FileSink sink_of(const AtomicFile& draft, const fs::path& path) {
  return {::fcntl(draft.descriptor(), F_DUPFD_CLOEXEC, 0), path.string()};
}

/// \throws StoreRefused
void require_place(const fs::path& path, bool force, const ProtectedFiles& taken) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    throw StoreRefused(path.string() + ": is not a file; name the CSV file to be written");
  }
  const std::string why = write_refusal(path.string(), force, taken);
  if (!why.empty()) throw StoreRefused(path.string() + ": " + why);
}

}  // namespace

ExportResult export_csv(Store& store, const std::string& path, const ExportSettings& settings) {
  const fs::path trials_path(path);
  const fs::path attempts_path = trials_path.parent_path() / "attempts.csv";
  if (trials_path.filename().empty())
    throw StoreRefused("'" + path + "' names no file to write to");
  if (trials_path.filename() == attempts_path.filename()) {
    throw StoreRefused(path +
                       ": that name is kept for the attempts that were cut off; choose another");
  }
  ProtectedFiles taken;
  taken.add(store.path(), "it is the database itself, or SQLite's file beside it");
  const bool with_attempts = store.counts().cut_off > 0;
  require_place(trials_path, settings.force, taken);
  if (with_attempts) require_place(attempts_path, settings.force, taken);
  if (!settings.codebook.empty()) {
    taken.add(trials_path.string(), "the trials go there");
    taken.add(attempts_path.string(), "that name is kept for the attempts that were cut off");
    require_place(settings.codebook, settings.force, taken);
  }

  ExportResult done;
  ExportedParticipants people;
  ProgressCounter counter(settings);
  const ExportClock clock(store, settings.times);
  DelimitedRow row(DelimitedFormat::csv);
  std::deque<AtomicFile> drafts;
  FileSink trials = sink_of(drafts.emplace_back(trials_path.string()), trials_path);
  row << trial_columns(settings.times);
  trials.write(row.end());
  store.for_each_trial([&](const StoredTrial& trial) {
    put_trial(row, trial, clock);
    trials.write(row.end());
    people.add(trial.participant);
    ++done.trials;
    counter.next();
  });
  trials.close(true);
  if (with_attempts) {
    FileSink attempts = sink_of(drafts.emplace_back(attempts_path.string()), attempts_path);
    done.attempts = write_attempts(store, attempts, clock, people, counter);
    attempts.close(true);
    done.attempts_path = attempts_path.string();
  }
  if (!settings.codebook.empty()) {
    FileSink codebook = sink_of(drafts.emplace_back(settings.codebook), settings.codebook);
    write_codebook(codebook, all_facts(label_protocols(store, settings)), settings);
    codebook.close(true);
  }
  done.simulated = people.any_simulated();
  done.not_recorded = people.record(store.path(), path, "csv");
  commit_all(drafts, settings.force);
  return done;
}

}  // namespace palpate::data
