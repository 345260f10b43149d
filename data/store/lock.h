#pragma once
// Internal to data/: one writer a database.

#include <string>

namespace palpate::data {

/// Advisory lock on `path`.palpate-lock, held until destruction or the death of the process. The
/// file names the holder's process and is removed with the lock; one that a killed program left is
/// taken over. Beside the database, not on it: closing any descriptor of the database itself would
/// drop SQLite's own locks.
class WriterLock {
 public:
  /// \throws StoreRefused, naming the process, when another writer holds it, and when a file that
  /// is not a lock of ours has its name; StoreError when the lock file cannot be made.
  explicit WriterLock(const std::string& path);
  ~WriterLock();
  WriterLock(const WriterLock&) = delete;
  WriterLock& operator=(const WriterLock&) = delete;

 private:
  std::string file_;
  int descriptor_ = -1;
};

}  // namespace palpate::data
