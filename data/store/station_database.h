#pragma once
// The database of one station (a computer that runs part of a study), opened for merge: read,
// verified, and never written to.

#include <SQLiteCpp/Database.h>

#include <memory>
#include <optional>
#include <string>

#include "data/files/file_permissions.h"
#include "data/store/writer_lock.h"

namespace palpate::data {

/// Gives the content as after Store::open for writing: current schema, -wal checkpointed, runs of
/// crashed processes marked as interrupted. If the file differs from that, reads a private copy
/// brought to this state. Holds the writer's lock, so that no other process writes meanwhile.
class StationDatabase {
 public:
  /// \param scratch path for the private copy; must not exist. \throws as Store::open.
  StationDatabase(const std::string& path, const std::string& scratch);

  const std::string& path() const { return path_; }  ///< as given
  SQLite::Database& db() { return *db_; }

  /// \throws StoreError: the file has changed since it was opened.
  void require_unchanged() const;

 private:
  /// Changes when the file is written to.
  struct FileState {
    FileIdentity identity;
    std::int64_t size = 0, modified_ns = 0;
    bool operator==(const FileState&) const = default;
  };
  static FileState state_of_file(const std::string& file);
  bool is_current();
  void take_copy(const std::string& scratch);

  std::string path_, file_;
  std::optional<WriterLock> lock_;
  FileState opened_;
  std::optional<SQLite::Database> db_;
};

}  // namespace palpate::data
