#pragma once
// What must not be written over: databases, what a command reads, what is no file.

#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace palpate::data {

/// "-wal", "-shm", "-journal": what SQLite keeps beside a database.
const std::vector<std::string>& sqlite_file_suffixes();

/// A database of any program, or one's log, by how it begins. A file that may not be read may be
/// one.
bool may_be_database(const std::string& path);

/// Whether the name is, or would be, that of a log or lock beside a database that is there.
bool belongs_to_database(const std::string& path);

/// The open descriptor that a path means: "/dev/stdout", "/dev/fd/63" (as shells name pipes).
std::optional<int> descriptor_of_path(const std::string& path);

/// Files that are not to be written over, each with why: what a command reads, its other outputs.
class ProtectedFiles {
 public:
  /// \param why "--db reads it". A database is there with what SQLite keeps beside it.
  void add(const std::string& path, const std::string& why);
  /// Why the file that `path` leads to, under this name or another, is taken; "" where it is not.
  std::string why(const std::string& path) const;

 private:
  struct Taken {
    std::string place;  ///< links followed
    std::string why;
  };
  std::vector<Taken> taken_;
};

/// Why no text may be written to `path`, in words that follow the path; "" where it may.
/// \param force a file that is there may be replaced; never a database or what is taken
std::string write_refusal(const std::string& path, bool force, const ProtectedFiles& taken = {});

}  // namespace palpate::data
