#pragma once
// Internal to data/: one writer a database.

#include <string>

namespace palpate {

/// Advisory lock on `path`.lock, held until destruction or the death of the process. The file names
/// the holder's process and is removed with the lock. Beside the database, not on it: closing any
/// descriptor of the database itself would drop SQLite's own locks.
class WriterLock {
 public:
  /// \throws StoreRefused, naming the process, when another writer holds it; StoreError when the
  /// lock file cannot be made.
  explicit WriterLock(const std::string& path);
  ~WriterLock();
  WriterLock(const WriterLock&) = delete;
  WriterLock& operator=(const WriterLock&) = delete;

 private:
  std::string file_;
  int descriptor_ = -1;
};

}  // namespace palpate
