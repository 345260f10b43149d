#include "data/export_csv.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <system_error>

#include "data/attempts_file.h"
#include "data/export_log.h"
#include "data/table_fields.h"
#include "data/text_sink.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

/// A file that appears whole, under its name, or not at all.
class NewFile {
 public:
  explicit NewFile(const fs::path& path) : path_(path), draft_(path.string() + ".XXXXXX") {
    // 0600: the data are about people
    const int descriptor = ::mkostemp(draft_.data(), O_CLOEXEC);
    if (descriptor < 0) draft_.clear();
    sink_.emplace(descriptor, path_.string());
  }
  ~NewFile() {
    if (!draft_.empty()) ::unlink(draft_.c_str());
  }
  NewFile(const NewFile&) = delete;
  NewFile& operator=(const NewFile&) = delete;

  FileSink& sink() { return *sink_; }

  void give_name(bool force) {
    const unsigned flags = force ? 0 : RENAME_NOREPLACE;
    int status = ::renameat2(AT_FDCWD, draft_.c_str(), AT_FDCWD, path_.c_str(), flags);
    if (status != 0 && errno == EINVAL) status = std::rename(draft_.c_str(), path_.c_str());
    if (status != 0) {
      throw StoreError(path_.string() +
                       ": cannot be given its name: " + std::generic_category().message(errno) +
                       "; nothing was exported. Check the folder and its permissions");
    }
    draft_.clear();
  }

 private:
  fs::path path_;
  std::string draft_;
  std::optional<FileSink> sink_;
};

void require_place(const fs::path& path, bool force) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (!fs::exists(status)) return;
  if (!fs::is_regular_file(status)) {
    throw StoreRefused(path.string() + ": is not a file; name the CSV file to be written");
  }
  if (!force)
    throw StoreRefused(path.string() +
                       ": is there already; give --force to replace it, or another name");
}

}  // namespace

ExportDone export_csv(Store& store, const std::string& path, const ExportSettings& settings) {
  const fs::path trials_path(path);
  const fs::path attempts_path = trials_path.parent_path() / "attempts.csv";
  if (trials_path.filename().empty())
    throw StoreRefused("'" + path + "' names no file to write to");
  if (trials_path.filename() == attempts_path.filename()) {
    throw StoreRefused(path +
                       ": that name is kept for the attempts that were cut off; choose another");
  }
  for (const char* end : {"", "-wal", "-shm", ".lock"}) {
    std::error_code error;
    if (fs::equivalent(trials_path, store.path() + end, error) && !error) {
      throw StoreRefused(path + ": is the database itself; name another file");
    }
  }
  const bool with_attempts = store.counts().cut_off > 0;
  require_place(trials_path, settings.force);
  if (with_attempts) require_place(attempts_path, settings.force);

  ExportDone done;
  ExportedPeople people;
  ProgressCounter counter(settings);
  TableRow row(TableStyle::csv);
  NewFile trials(trials_path);
  row << trial_columns();
  trials.sink().write(row.end());
  store.for_each_trial([&](const StoredTrial& trial) {
    put_trial(row, trial);
    trials.sink().write(row.end());
    people.add(trial.participant);
    ++done.trials;
    counter.next();
  });
  trials.sink().close(true);
  std::optional<NewFile> attempts;
  if (with_attempts) {
    attempts.emplace(attempts_path);
    done.attempts = write_attempts(store, attempts->sink(), people, counter);
    attempts->sink().close(true);
    done.attempts_path = attempts_path.string();
  }
  done.simulated = people.any_simulated();
  done.not_recorded = people.record(store.path(), path, "csv");
  if (attempts) attempts->give_name(settings.force);
  trials.give_name(settings.force);
  return done;
}

}  // namespace palpate
