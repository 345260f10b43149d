#pragma once
// Which file a path leads to, by device and inode: two paths with the same identity are one file.

#include <sys/types.h>

#include <string>

namespace palpate::data {

/// {0, 0}: there is no file.
struct FileIdentity {
  dev_t device = 0;
  ino_t inode = 0;
  bool operator==(const FileIdentity&) const = default;
};

/// Follows symbolic links.
FileIdentity identity_of(const std::string& path);

}  // namespace palpate::data
