#pragma once
// One writer per database, across processes.

#include <string>

namespace palpate::data {

/// Two advisory locks (flock), held until destruction or until the process ends. The first is on
/// the file `path`.palpate-lock, which contains the process id of the holder and is removed with
/// the lock; the file of a killed process is reused. The second is on the database itself, because
/// one database may have several names (hard links, a file mounted elsewhere, a file that was
/// moved), and each name has a lock file and a log of its own.
///
/// Closing a descriptor of the database releases SQLite's POSIX locks of this process
/// (https://www.sqlite.org/howtocorrupt.html, 2.2): destroy the lock after the database is closed.
class WriterLock {
 public:
  /// \param path of the database, links resolved; need not exist
  /// \throws StoreRefused: another writer holds it (names the process), or the file is not a lock
  /// of palpate; StoreError: the lock file cannot be created.
  explicit WriterLock(const std::string& path);
  ~WriterLock();
  WriterLock(const WriterLock&) = delete;
  WriterLock& operator=(const WriterLock&) = delete;

  /// Locks the file that `path` names by now: after it was created or replaced. To be called while
  /// the database is closed. \throws StoreRefused: a writer holds it under another name
  void lock_database();

 private:
  void release();

  std::string path_, file_;
  int descriptor_ = -1, database_ = -1;
};

/// Refuses to write to a database with several hard links: under each name SQLite keeps another
/// log, so that trials acknowledged under one name would be overwritten under the other. \param
/// file links resolved \throws StoreRefused
void require_one_name(const std::string& file, const std::string& path);

/// Refuses an export, which records itself beside a session without the lock, where a writer has
/// opened the database by another name: its newest trials are in the log of that name. To be called
/// while the database is closed. \param file links resolved \throws StoreRefused
void require_no_writer_by_another_name(const std::string& file, const std::string& path);

}  // namespace palpate::data
