#pragma once
// Internal to data/store: one writer per database, across processes.

#include <string>

namespace palpate::data {

/// Advisory lock (flock) on the file `path`.palpate-lock, held until destruction or until the
/// process ends. The file contains the process id of the holder and is removed with the lock; one
/// that a killed process left is reused. Not on the database itself: closing any descriptor of it
/// would release SQLite's POSIX locks (https://www.sqlite.org/howtocorrupt.html, 2.2).
class WriterLock {
 public:
  /// \throws StoreRefused: another writer holds it (names the process), or the file is not a lock
  /// of palpate; StoreError: the lock file cannot be created.
  explicit WriterLock(const std::string& path);
  ~WriterLock();
  WriterLock(const WriterLock&) = delete;
  WriterLock& operator=(const WriterLock&) = delete;

 private:
  std::string file_;
  int descriptor_ = -1;
};

}  // namespace palpate::data
