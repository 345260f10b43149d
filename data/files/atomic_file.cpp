#include "data/files/atomic_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <system_error>
#include <utility>

#include "data/errors.h"
#include "data/files/temporary_names.h"
#include "data/files/trusted_links.h"

namespace palpate::data {
namespace {

namespace fs = std::filesystem;

/// Whether `name` in `folder` is the open file.
bool leads_to(int folder, const std::string& name, int descriptor) {
  struct stat named {
  }, opened{};
  return ::fstat(descriptor, &opened) == 0 &&
         ::fstatat(folder, name.c_str(), &named, AT_SYMLINK_NOFOLLOW) == 0 &&
         named.st_dev == opened.st_dev && named.st_ino == opened.st_ino;
}

}  // namespace

AtomicFile::AtomicFile(const std::string& target) : target_(target) {
  const ResolvedPath resolved = resolve_trusted_links(target);
  if (!resolved.fault.empty()) throw StoreRefused(target + ": " + resolved.fault);
  open_folder(resolved.path);
  remove_stale_temporaries(resolved.path);
  create();
}

void AtomicFile::open_folder(const std::string& path) {
  name_ = fs::path(path).filename().string();
  const std::string folder = fs::path(path).parent_path().string();
  folder_ = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  if (folder_ < 0) folder_ = ::open(folder.c_str(), O_PATH | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  if (folder_ < 0) fail("cannot be written", errno);
}

void AtomicFile::create() {
  const std::string stem = temporary_prefix(name_);
  for (int tries = 0; tries < 100; ++tries) {
    temporary_ = stem + random_letters();
    descriptor_ = ::openat(folder_, temporary_.c_str(),
                           O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600);
    if (descriptor_ < 0 && errno == EEXIST) continue;
    if (descriptor_ < 0) break;
    // Between creation and lock, another process may have removed it as stale.
    if (::flock(descriptor_, LOCK_EX | LOCK_NB) == 0 &&
        leads_to(folder_, temporary_, descriptor_)) {
      return;
    }
    ::unlinkat(folder_, temporary_.c_str(), 0);
    ::close(std::exchange(descriptor_, -1));
  }
  const int error = errno;
  ::close(folder_);
  fail("cannot be created", error);
}

AtomicFile::~AtomicFile() {
  if (state_ == State::temporary || state_ == State::exchanged) {
    ::unlinkat(folder_, temporary_.c_str(), 0);
  }
  ::close(descriptor_);
  ::close(folder_);
}

void AtomicFile::write(std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(descriptor_, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) fail("cannot be written", errno);
    text.remove_prefix(static_cast<std::size_t>(written));
  }
}

void AtomicFile::sync() {
  if (::fsync(descriptor_) != 0) fail("cannot be written", errno);
}

void AtomicFile::commit(bool replace) {
  const auto rename = [&](unsigned flags) {
    return ::renameat2(folder_, temporary_.c_str(), folder_, name_.c_str(), flags) == 0;
  };
  struct stat found {};
  const bool exists =
      replace && ::fstatat(folder_, name_.c_str(), &found, AT_SYMLINK_NOFOLLOW) == 0;
  if (exists && !S_ISREG(found.st_mode)) fail("cannot be replaced", EEXIST);
  if (exists && rename(RENAME_EXCHANGE)) {
    state_ = State::exchanged;  // the previous file has the temporary name
  } else if (rename(RENAME_NOREPLACE)) {
    state_ = State::renamed;
  } else if (errno != EINVAL && errno != ENOSYS && !(exists && errno == EEXIST)) {
    fail("cannot be renamed to its final name", errno);
  } else if (replace) {  // a file system without RENAME_EXCHANGE
    if (!rename(0)) fail("cannot be renamed to its final name", errno);
    state_ = State::replaced;
  } else {
    if (::linkat(folder_, temporary_.c_str(), folder_, name_.c_str(), 0) != 0) {
      fail("cannot be renamed to its final name", errno);
    }
    ::unlinkat(folder_, temporary_.c_str(), 0);
    state_ = State::renamed;
  }
  ::fsync(folder_);  // may fail: a folder that can be written need not be readable
}

void AtomicFile::roll_back() {
  if (state_ == State::temporary || state_ == State::replaced) return;
  if (state_ == State::renamed) {
    if (leads_to(folder_, name_, descriptor_)) ::unlinkat(folder_, name_.c_str(), 0);
  } else if (::renameat2(folder_, name_.c_str(), folder_, temporary_.c_str(), RENAME_EXCHANGE) !=
             0) {
    return;
  }
  state_ = State::temporary;
}

void AtomicFile::fail(const char* what, int error) const {
  throw StoreError(target_ + ": " + what + ": " + std::generic_category().message(error) +
                   "; nothing was written. Check the folder, its permissions and the free space");
}

bool rename_if_absent(const std::string& temporary, const std::string& path) {
  int status = ::renameat2(AT_FDCWD, temporary.c_str(), AT_FDCWD, path.c_str(), RENAME_NOREPLACE);
  if (status != 0 && (errno == EINVAL || errno == ENOSYS)) {  // not supported by every file system
    status = ::link(temporary.c_str(), path.c_str());
    if (status == 0) ::unlink(temporary.c_str());
  }
  if (status != 0 && errno == EEXIST) return false;
  if (status != 0) {
    throw StoreError(path + ": cannot be renamed to its final name: " +
                     std::generic_category().message(errno) + "; nothing was written");
  }
  const fs::path folder = fs::path(path).parent_path();
  const int opened = ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_CLOEXEC);
  if (opened < 0) return true;  // a folder that can be written need not be readable
  ::fsync(opened);
  ::close(opened);
  return true;
}

void commit_all(std::deque<AtomicFile>& files, bool replace) {
  try {
    for (AtomicFile& file : files) file.commit(replace);
  } catch (...) {
    for (AtomicFile& file : files) file.roll_back();
    throw;
  }
}

}  // namespace palpate::data
