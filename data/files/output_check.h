#pragma once
// Decides whether a path may be written to. Never overwritten: databases and their -wal, -shm,
// -journal and lock files, inputs of the same command, devices.

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace palpate::data {

/// A writer's lock stands beside its database under the name with this end.
inline constexpr const char* kLockEnd = ".palpate-lock";

/// "-wal", "-shm", "-journal": suffixes of the files that SQLite creates beside a database
/// (https://www.sqlite.org/tempfiles.html).
const std::vector<std::string>& sqlite_file_suffixes();

/// Whether the file begins like a SQLite database, -wal or -journal, of any program. True for a
/// file that cannot be read.
bool may_be_database(const std::string& path);

/// Whether the name is that of a -wal, -shm, -journal or lock file of an existing database.
bool belongs_to_database(const std::string& path);

/// The open descriptor that a path names: "/dev/stdout", "/dev/fd/63" (process substitution).
std::optional<int> descriptor_of_path(const std::string& path);

/// Why writing failed, for a message. \param error an errno; a limit on the size of files (ulimit
/// -f) reads like a full disk
std::string write_fault(int error);

/// Refuses "-" as the name of a file or folder to be written: its user expects a stream.
/// \throws StoreRefused
void require_name(const std::string& path);

/// Files that must not be overwritten, each with the reason: inputs and other outputs of a command.
class ProtectedFiles {
 public:
  /// \param reason "--db reads it". Of a database, its -wal, -shm and -journal are protected, too.
  void add(const std::string& path, const std::string& reason);
  /// Why the file that `path` leads to (also by another name) is protected; "": it is not.
  std::string reason(const std::string& path) const;

 private:
  struct Entry {
    std::string file;  ///< absolute, links resolved
    std::string reason;
  };
  std::vector<Entry> entries_;
};

/// Why `path` must not be written to, to be appended to the path in a message; "": it may be.
/// \param force an existing file may be replaced; never a database or a protected file
std::string write_refusal(const std::string& path, bool force,
                          const ProtectedFiles& protected_files = {});

}  // namespace palpate::data
