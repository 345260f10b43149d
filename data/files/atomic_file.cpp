#include "data/files/atomic_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdint>
#include <filesystem>
#include <string_view>
#include <system_error>
#include <utility>

#include "data/errors.h"
#include "data/files/file_permissions.h"
#include "data/files/output_check.h"

namespace palpate::data {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLetters = 6;
constexpr std::string_view kDraftMark = ".palpate-";

/// Removes this user's temporary entries of the folder that no process has locked.
template <class IsTemporary>
void remove_unlocked(const fs::path& folder, IsTemporary is_temporary) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder.empty() ? "." : folder, error)) {
    if (!is_temporary(entry.path().filename().string())) continue;
    const std::string path = (folder / entry.path().filename()).string();
    struct stat found {};
    if (::lstat(path.c_str(), &found) != 0 || found.st_uid != ::geteuid()) continue;
    if (!S_ISDIR(found.st_mode) && !(S_ISREG(found.st_mode) && found.st_nlink == 1)) continue;
    const int temporary = ::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (temporary < 0) continue;
    if (::flock(temporary, LOCK_EX | LOCK_NB) == 0) fs::remove_all(path, error);
    ::close(temporary);
  }
}

/// Whether `name` in `folder` is the open file.
bool leads_to(int folder, const std::string& name, int descriptor) {
  struct stat named {
  }, opened{};
  return ::fstat(descriptor, &opened) == 0 &&
         ::fstatat(folder, name.c_str(), &named, AT_SYMLINK_NOFOLLOW) == 0 &&
         named.st_dev == opened.st_dev && named.st_ino == opened.st_ino;
}

}  // namespace

std::string random_letters() {
  constexpr std::string_view kAlphabet =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
  std::array<std::uint8_t, kLetters> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
    throw StoreError("the system provides no random numbers");
  }
  std::string letters;
  for (const std::uint8_t byte : bytes) letters += kAlphabet[byte % kAlphabet.size()];
  return letters;
}

std::string temporary_prefix(const std::string& target) {
  const fs::path path(target);
  constexpr std::size_t kMost = 200;  // bytes; a name has at most 255
  return (path.parent_path() /
          ("." + path.filename().string().substr(0, kMost) + std::string(kDraftMark)))
      .string();
}

void remove_stale_temporaries(const std::string& target) {
  const std::string stem = fs::path(temporary_prefix(target)).filename().string();
  remove_unlocked(fs::path(target).parent_path(), [&](const std::string& name) {
    return name.starts_with(stem) && name.size() == stem.size() + kLetters;
  });
}

void remove_stale_temporaries_in(const std::string& folder) {
  remove_unlocked(folder, [](const std::string& name) {
    const std::size_t letters = name.rfind(kDraftMark);
    return name.starts_with('.') && letters != std::string::npos && letters > 1 &&
           name.size() == letters + kDraftMark.size() + kLetters;
  });
}

AtomicFile::AtomicFile(const std::string& target) : target_(target) {
  require_name(target);
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
  ::fsync(folder_);  // may fail: a writable folder need not be readable
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
  throw StoreError(target_ + ": " + what + ": " + write_fault(error) +
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
  if (opened < 0) return true;  // a writable folder need not be readable
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
