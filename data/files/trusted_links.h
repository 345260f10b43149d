#pragma once
// Symbolic links on the way to a file that is to be written.

#include <string>

namespace palpate::data {

struct ResolvedPath {
  std::string path;   ///< absolute, without links
  std::string fault;  ///< why it was not followed, in words that follow the path; "" where it was
};

/// Where `path` leads when links are followed: those of this user and of the system alone. What
/// another user laid in a shared folder could carry a text anywhere. The last name need not exist.
ResolvedPath resolve_trusted_links(const std::string& path);

}  // namespace palpate::data
