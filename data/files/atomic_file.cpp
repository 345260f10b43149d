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

/// Whether `name` in `folder` is the file that is open.
bool leads_to(int folder, const std::string& name, int descriptor) {
  struct stat named {
  }, opened{};
  return ::fstat(descriptor, &opened) == 0 &&
         ::fstatat(folder, name.c_str(), &named, AT_SYMLINK_NOFOLLOW) == 0 &&
         named.st_dev == opened.st_dev && named.st_ino == opened.st_ino;
}

}  // namespace

AtomicFile::AtomicFile(const std::string& target) : target_(target) {
  const ResolvedPath followed = resolve_trusted_links(target);
  if (!followed.fault.empty()) throw StoreRefused(target + ": " + followed.fault);
  open_folder(followed.path);
  remove_stale_temporaries(followed.path);
  make();
}

void AtomicFile::open_folder(const std::string& path) {
  name_ = fs::path(path).filename().string();
  const std::string folder = fs::path(path).parent_path().string();
  folder_ = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  if (folder_ < 0) folder_ = ::open(folder.c_str(), O_PATH | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  if (folder_ < 0) fail("cannot be written", errno);
}

void AtomicFile::make() {
  const std::string stem = temporary_prefix(name_);
  for (int tries = 0; tries < 100; ++tries) {
    draft_ = stem + random_letters();
    descriptor_ =
        ::openat(folder_, draft_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600);
    if (descriptor_ < 0 && errno == EEXIST) continue;
    if (descriptor_ < 0) break;
    // Another program that clears up may have taken it for dead before it was locked.
    if (::flock(descriptor_, LOCK_EX | LOCK_NB) == 0 && leads_to(folder_, draft_, descriptor_)) {
      return;
    }
    ::unlinkat(folder_, draft_.c_str(), 0);
    ::close(std::exchange(descriptor_, -1));
  }
  const int error = errno;
  ::close(folder_);
  fail("cannot be created", error);
}

AtomicFile::~AtomicFile() {
  if (state_ == State::draft || state_ == State::exchanged) {
    ::unlinkat(folder_, draft_.c_str(), 0);
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
    return ::renameat2(folder_, draft_.c_str(), folder_, name_.c_str(), flags) == 0;
  };
  struct stat found {};
  const bool there = replace && ::fstatat(folder_, name_.c_str(), &found, AT_SYMLINK_NOFOLLOW) == 0;
  if (there && !S_ISREG(found.st_mode)) fail("cannot be replaced", EEXIST);
  if (there && rename(RENAME_EXCHANGE)) {
    state_ = State::exchanged;  // what was there has the draft's name
  } else if (rename(RENAME_NOREPLACE)) {
    state_ = State::named;
  } else if (errno != EINVAL && errno != ENOSYS && !(there && errno == EEXIST)) {
    fail("cannot be given its name", errno);
  } else if (replace) {  // a file system that cannot exchange
    if (!rename(0)) fail("cannot be given its name", errno);
    state_ = State::replaced;
  } else {
    if (::linkat(folder_, draft_.c_str(), folder_, name_.c_str(), 0) != 0) {
      fail("cannot be given its name", errno);
    }
    ::unlinkat(folder_, draft_.c_str(), 0);
    state_ = State::named;
  }
  ::fsync(folder_);  // not every folder that may be written may be read, and so synced
}

void AtomicFile::roll_back() {
  if (state_ == State::draft || state_ == State::replaced) return;
  if (state_ == State::named) {
    if (leads_to(folder_, name_, descriptor_)) ::unlinkat(folder_, name_.c_str(), 0);
  } else if (::renameat2(folder_, name_.c_str(), folder_, draft_.c_str(), RENAME_EXCHANGE) != 0) {
    return;
  }
  state_ = State::draft;
}

void AtomicFile::fail(const char* what, int error) const {
  throw StoreError(target_ + ": " + what + ": " + std::generic_category().message(error) +
                   "; nothing was written. Check the folder, its permissions and the free space");
}

bool rename_if_absent(const std::string& draft, const std::string& path) {
  int status = ::renameat2(AT_FDCWD, draft.c_str(), AT_FDCWD, path.c_str(), RENAME_NOREPLACE);
  if (status != 0 && (errno == EINVAL || errno == ENOSYS)) {  // not every file system can
    status = ::link(draft.c_str(), path.c_str());
    if (status == 0) ::unlink(draft.c_str());
  }
  if (status != 0 && errno == EEXIST) return false;
  if (status != 0) {
    throw StoreError(path + ": cannot be given its name: " +
                     std::generic_category().message(errno) + "; nothing was written");
  }
  const fs::path folder = fs::path(path).parent_path();
  const int opened = ::open(folder.empty() ? "." : folder.c_str(), O_RDONLY | O_CLOEXEC);
  if (opened < 0) return true;  // not every folder that may be written may be read
  ::fsync(opened);
  ::close(opened);
  return true;
}

void commit_all(std::deque<AtomicFile>& drafts, bool replace) {
  try {
    for (AtomicFile& draft : drafts) draft.commit(replace);
  } catch (...) {
    for (AtomicFile& draft : drafts) draft.roll_back();
    throw;
  }
}

}  // namespace palpate::data
