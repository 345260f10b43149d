#pragma once
// Whether other users of the computer can read or replace a database, or have put files beside it.

#include <sys/types.h>

#include <cstdint>
#include <string>

namespace palpate::data {

/// Which file a path leads to, by device and inode: two paths with the same identity are one file.
/// {0, 0}: there is no file.
struct FileIdentity {
  dev_t device = 0;
  ino_t inode = 0;
  bool operator==(const FileIdentity&) const = default;
};

/// Follows symbolic links.
FileIdentity identity_of(const std::string& path);

/// The number of hard links of the file that `path` leads to; 0: there is no file.
std::uint64_t names_of_file(const std::string& path);

/// A path that is to be written, with its symbolic links resolved.
struct ResolvedPath {
  std::string path;  ///< absolute, links resolved
  std::string
      fault;  ///< why it was not resolved, to be appended to the path in a message; "": resolved
};

/// The file that `path` leads to; the last component need not exist. In a shared folder another
/// user could place a link that redirects the output: only links of this user and of root are
/// followed.
ResolvedPath resolve_trusted_links(const std::string& path);

/// The -wal, -shm and -journal of a database, where they exist, must be regular files of this user,
/// root or the owner of the database, without hard links, and with no wider permissions than the
/// database: another user's file would receive participants' data, or inject content. To be called
/// before SQLite opens them and again afterwards. \param file links resolved \throws StoreRefused
void require_private_sqlite_files(const std::string& file);

/// A sentence on how other users could access the database or put files beside it; "": they cannot.
std::string access_warning(const std::string& database);

/// Reason why a file or folder must not be run or trusted, to be appended to its path in a message;
/// "": it is safely this user's own. Checks that the name itself is not a link, its owner, its
/// permissions, and the folders above it.
std::string ownership_fault(const std::string& path);

}  // namespace palpate::data
