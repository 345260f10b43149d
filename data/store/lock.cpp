#include "data/store/lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <string_view>
#include <system_error>

#include "data/errors.h"

namespace palpate::data {
namespace {

constexpr std::string_view kMark = "palpate ";  // and the process's number

[[noreturn]] void refuse_foreign_lock(const std::string& file, const std::string& path,
                                      const std::string& why) {
  throw StoreRefused(path + ": its lock file " + file + " is not one of yours (" + why +
                     ") and is not used. Move it away if no palpate writes to the database");
}

std::string text_of(int descriptor) {
  std::array<char, 48> text{};
  const ssize_t length = ::pread(descriptor, text.data(), text.size(), 0);
  return {text.data(), length > 0 ? static_cast<std::size_t>(length) : 0};
}

/// A file of another program or user is neither locked nor changed.
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
  if (!text.empty() && !text.starts_with(kMark)) {
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
    // Left by a killed process, or held by a running one.
    const int old = open_old_lock(file, path);
    if (old >= 0) return old;
  }
}

std::string holder(int descriptor) {
  const std::string text = text_of(descriptor);
  std::string pid;
  for (std::size_t i = kMark.size(); i < text.size() && text[i] >= '0' && text[i] <= '9'; ++i) {
    pid += text[i];
  }
  return pid.empty() ? "another program" : "process " + pid;
}

[[noreturn]] void refuse_second_writer(const std::string& path, const std::string& who) {
  throw StoreRefused(path + ": is open for writing in " + who +
                     "; wait until that has ended, or use another database and merge later");
}

// Whether the path still names the open file: a writer that ends removes it.
bool is_same_file(int descriptor, const std::string& file) {
  struct stat opened {
  }, found{};
  return ::fstat(descriptor, &opened) == 0 && ::lstat(file.c_str(), &found) == 0 &&
         opened.st_dev == found.st_dev && opened.st_ino == found.st_ino;
}

}  // namespace

WriterLock::WriterLock(const std::string& path) : file_(path + ".palpate-lock") {
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
  const std::string text = std::string(kMark) + std::to_string(::getpid()) + "\n";
  // The process id is for messages only: the lock holds even if a full disk leaves the file empty.
  if (::ftruncate(descriptor_, 0) == 0 && ::pwrite(descriptor_, text.data(), text.size(), 0) < 0) {
    errno = 0;
  }
}

WriterLock::~WriterLock() {
  if (is_same_file(descriptor_, file_)) ::unlink(file_.c_str());
  ::close(descriptor_);
}

}  // namespace palpate::data
