#pragma once
// Internal to data/: a database that is read and not touched.

#include <SQLiteCpp/Database.h>

#include <memory>
#include <optional>
#include <string>

#include "data/files/file_identity.h"
#include "data/store/lock.h"

namespace palpate::data {

/// A station's database as it would be if a writer opened it now: of this schema, its log played
/// in, what a dead process left running marked. Where that is not so, a private copy is; the file
/// itself is never written to, and no writer gets at it meanwhile.
class StationDatabase {
 public:
  /// \param scratch the copy's place, a file that is not there. \throws as Store::open.
  StationDatabase(const std::string& path, const std::string& scratch);

  const std::string& path() const { return path_; }  ///< as given
  SQLite::Database& db() { return *db_; }

  /// \throws StoreError: the file has changed since it was opened.
  void require_unchanged() const;

 private:
  /// What shows that a file was written to.
  struct Looks {
    FileIdentity identity;
    std::int64_t size = 0, modified_ns = 0;
    bool operator==(const Looks&) const = default;
  };
  static Looks looks_of(const std::string& file);
  bool is_current();
  void take_copy(const std::string& scratch);

  std::string path_, file_;
  std::optional<WriterLock> lock_;
  Looks looks_;
  std::optional<SQLite::Database> db_;
};

}  // namespace palpate::data
