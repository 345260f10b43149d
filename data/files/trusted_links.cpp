#include "data/files/trusted_links.h"

#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <system_error>

namespace palpate::data {
namespace {

namespace fs = std::filesystem;

bool is_trusted_owner(uid_t owner) { return owner == ::geteuid() || owner == 0; }

}  // namespace

ResolvedPath resolve_trusted_links(const std::string& path) {
  constexpr int kMostLinks = 40;
  std::error_code error;
  fs::path rest = fs::absolute(path, error), done = "/";
  if (path.empty() || error) return {"", "is not a path of a file"};
  for (int links = 0;;) {
    const fs::path ahead = rest.relative_path();
    auto part = ahead.begin();
    if (part == ahead.end()) return {done.string(), ""};
    const fs::path name = *part;
    rest.clear();
    while (++part != ahead.end()) rest /= *part;
    if (name == "." || name.empty()) continue;
    if (name == "..") {
      done = done.parent_path();
      continue;
    }
    const fs::path here = done / name;
    struct stat found {};
    if (::lstat(here.c_str(), &found) != 0 || !S_ISLNK(found.st_mode)) {
      done = here;
      continue;
    }
    if (!is_trusted_owner(found.st_uid)) {
      return {"", "leads through " + here.string() +
                      ", a link of another user, which is not followed; name the file itself, in a "
                      "folder of your own"};
    }
    const fs::path to = fs::read_symlink(here, error);
    if (error || ++links > kMostLinks) return {"", "is a link that leads nowhere"};
    rest = to / rest;
    if (to.is_absolute()) done = "/";
  }
}

}  // namespace palpate::data
