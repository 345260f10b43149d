#include "data/store/writer_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <system_error>

#include "data/errors.h"
#include "data/files/file_permissions.h"
#include "data/files/output_check.h"

namespace palpate::data {
namespace {

constexpr std::string_view kOwnerMark = "palpate ";  // and the process's number

[[noreturn]] void refuse_foreign_lock(const std::string& file, const std::string& path,
                                      const std::string& why) {
  throw StoreRefused(path + ": its lock file " + file + " was not written by your palpate (" + why +
                     ") and is not used. Move it away if no other palpate writes to the database");
}

std::string text_of(int descriptor) {
  std::array<char, 48> text{};
  const ssize_t length = ::pread(descriptor, text.data(), text.size(), 0);
  return {text.data(), length > 0 ? static_cast<std::size_t>(length) : 0};
}

/// Refuses a file of another program or user: it is neither locked nor changed.
void require_our_lock(const struct stat& found, const std::string& file, const std::string& path) {
  struct stat database {};
  const bool theirs = ::stat(path.c_str(), &database) == 0 && found.st_uid == database.st_uid;
  if (!S_ISREG(found.st_mode)) refuse_foreign_lock(file, path, "not a regular file");
  if (found.st_uid != ::geteuid() && found.st_uid != 0 && !theirs) {
    refuse_foreign_lock(file, path, "it belongs to user " + std::to_string(found.st_uid));
  }
  if ((found.st_mode & 077) != 0) refuse_foreign_lock(file, path, "others may access it");
  if (found.st_nlink > 1) refuse_foreign_lock(file, path, "it has a hard link");
}

/// \return -1: it has just been removed.
int open_old_lock(const std::string& file, const std::string& path) {
  struct stat found {};
  if (::lstat(file.c_str(), &found) != 0) return -1;
  require_our_lock(found, file, path);
  const int descriptor = ::open(file.c_str(), O_RDWR | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (descriptor < 0 && errno == ENOENT) return -1;
  if (descriptor < 0) {
    throw StoreRefused(path + ": its lock file " + file +
                       " cannot be opened: " + std::generic_category().message(errno) +
                       "; another user writes to the database, or did when the program was killed");
  }
  const std::string text = text_of(descriptor);
  if (::fstat(descriptor, &found) == 0) require_our_lock(found, file, path);
  if (!text.empty() && !text.starts_with(kOwnerMark)) {
    ::close(descriptor);
    refuse_foreign_lock(file, path, "palpate did not write it");
  }
  return descriptor;
}

int open_lock_file(const std::string& file, const std::string& path) {
  while (true) {
    const int made = ::open(file.c_str(), O_RDWR | O_CREAT | O_EXCL | O_NOFOLLOW | O_CLOEXEC, 0600);
    if (made >= 0) return made;
    if (errno != EEXIST) {
      throw StoreError(path + ": cannot be opened for writing, its lock file " + file +
                       " cannot be created: " + std::generic_category().message(errno) +
                       "; check that the folder exists and that you may write there");
    }
    // It was left by a killed process, or is held by a running one.
    const int old = open_old_lock(file, path);
    if (old >= 0) return old;
  }
}

std::string holder(int descriptor) {
  const std::string text = text_of(descriptor);
  std::string pid;
  for (std::size_t i = kOwnerMark.size(); i < text.size() && text[i] >= '0' && text[i] <= '9';
       ++i) {
    pid += text[i];
  }
  return pid.empty() ? "another program" : "process " + pid;
}

[[noreturn]] void refuse_second_writer(const std::string& path, const std::string& who) {
  throw StoreRefused(path + ": is open for writing in " + who +
                     "; wait until that has ended, or use another database and merge later");
}

// Whether the path still names the open file: a writer removes it when it ends.
bool is_same_file(int descriptor, const std::string& file) {
  struct stat opened {
  }, found{};
  return ::fstat(descriptor, &opened) == 0 && ::lstat(file.c_str(), &found) == 0 &&
         opened.st_dev == found.st_dev && opened.st_ino == found.st_ino;
}

/// On a network file system flock() is a POSIX lock of the whole file, which would exclude SQLite.
bool has_flock_of_its_own(int descriptor) {
  constexpr std::array<std::uint32_t, 4> kNetwork = {0x6969, 0x517B, 0xFF534D42, 0xFE534D42};
  struct statfs system {};
  return ::fstatfs(descriptor, &system) == 0 &&
         std::find(kNetwork.begin(), kNetwork.end(), static_cast<std::uint32_t>(system.f_type)) ==
             kNetwork.end();
}

/// \return -1: there is no such file, or it cannot be locked for another reason than a writer
/// \param taken set if another process holds the lock
int lock_file_itself(const std::string& path, bool& taken) {
  taken = false;
  const int descriptor =
      ::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
  if (descriptor < 0) return -1;
  struct stat found {};
  if (::fstat(descriptor, &found) == 0 && S_ISREG(found.st_mode) &&
      has_flock_of_its_own(descriptor)) {
    if (::flock(descriptor, LOCK_EX | LOCK_NB) == 0) return descriptor;
    taken = errno == EWOULDBLOCK;
  }
  ::close(descriptor);
  return -1;
}

bool is_locked(const std::string& file) {
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
  if (descriptor < 0) return false;
  const bool locked = ::flock(descriptor, LOCK_SH | LOCK_NB) != 0 && errno == EWOULDBLOCK;
  ::close(descriptor);
  return locked;
}

[[noreturn]] void refuse_writer_by_another_name(const std::string& path) {
  throw StoreRefused(path +
                     ": is open for writing in another program, under another name of the same "
                     "file (a hard link, a mount, or the name it had before it was moved); nothing "
                     "was written. Wait until that has ended, then go on under that name");
}

}  // namespace

WriterLock::WriterLock(const std::string& path) : path_(path), file_(path + kLockEnd) {
  while (true) {
    descriptor_ = open_lock_file(file_, path);
    if (::flock(descriptor_, LOCK_EX | LOCK_NB) != 0) {
      const int error = errno;
      const std::string who = holder(descriptor_);
      ::close(descriptor_);
      if (error == EINTR) continue;
      if (error != EWOULDBLOCK) {
        throw StoreError(path + ": cannot be locked: " + std::generic_category().message(error) +
                         "; keep the database on a local disk");
      }
      refuse_second_writer(path, who);
    }
    if (is_same_file(descriptor_, file_)) break;
    ::close(descriptor_);
  }
  const std::string text = std::string(kOwnerMark) + std::to_string(::getpid()) + "\n";
  // The process id is for messages only: the lock holds even if a full disk leaves the file empty.
  if (::ftruncate(descriptor_, 0) == 0 && ::pwrite(descriptor_, text.data(), text.size(), 0) < 0) {
    errno = 0;
  }
  try {
    lock_database();
  } catch (...) {
    release();
    throw;
  }
}

WriterLock::~WriterLock() { release(); }

void WriterLock::lock_database() {
  if (database_ >= 0 && is_same_file(database_, path_)) return;
  bool taken = false;
  const int locked = lock_file_itself(path_, taken);
  if (taken) refuse_writer_by_another_name(path_);
  if (database_ >= 0) ::close(database_);
  database_ = locked;
}

void WriterLock::release() {
  if (database_ >= 0) ::close(database_);
  if (is_same_file(descriptor_, file_)) ::unlink(file_.c_str());
  ::close(descriptor_);
}

void require_one_name(const std::string& file, const std::string& path) {
  const std::uint64_t names = names_of_file(file);
  if (names <= 1) return;
  throw StoreRefused(
      path + ": has " + std::to_string(names) +
      " names (hard links), and trials stored under one are lost under the other; it can be read, "
      "nothing was written. Find the names with: find / -xdev -samefile '" +
      file +
      "'. Remove those that are not needed, or make a file of its own for this one: cp -p '" +
      file + "' '" + file + ".own' && mv '" + file + ".own' '" + file +
      "'. A name with a -wal file beside it is the one to keep");
}

void require_no_writer_by_another_name(const std::string& file, const std::string& path) {
  if (is_locked(file + kLockEnd)) return;  // the writer uses this name
  bool taken = false;
  const int locked = lock_file_itself(file, taken);
  if (locked >= 0) ::close(locked);
  if (taken) refuse_writer_by_another_name(path);
}

}  // namespace palpate::data
