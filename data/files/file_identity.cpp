#include "data/files/file_identity.h"

#include <sys/stat.h>

namespace palpate::data {

FileIdentity identity_of(const std::string& path) {
  struct stat found {};
  if (::stat(path.c_str(), &found) != 0) return {};
  return {found.st_dev, found.st_ino};
}

}  // namespace palpate::data
