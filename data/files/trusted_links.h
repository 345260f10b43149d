#pragma once
// Resolves symbolic links of a path that is to be written. In a shared folder another user could
// lay a link that redirects the output: only links of this user and of root are followed.

#include <string>

namespace palpate::data {

struct ResolvedPath {
  std::string path;  ///< absolute, links resolved
  std::string
      fault;  ///< why it was not resolved, to be appended to the path in a message; "": resolved
};

/// The file that `path` leads to; the last component need not exist.
ResolvedPath resolve_trusted_links(const std::string& path);

}  // namespace palpate::data
