#include "data/store_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <system_error>

#include "data/store.h"

namespace palpate {
namespace {

int open_lock_file(const std::string& file, const std::string& path) {
  const int descriptor = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0600);
  if (descriptor >= 0) return descriptor;
  throw StoreError(path + ": cannot be opened for writing, its lock file " + file +
                   " cannot be made: " + std::generic_category().message(errno) +
                   "; check that the folder exists and that you may write there");
}

std::string holder(int descriptor) {
  std::array<char, 32> text{};
  const ssize_t length = ::pread(descriptor, text.data(), text.size(), 0);
  std::string pid;
  for (ssize_t i = 0; i < length && text[i] >= '0' && text[i] <= '9'; ++i) pid += text[i];
  return pid.empty() ? "another program" : "process " + pid;
}

[[noreturn]] void refuse_second_writer(const std::string& path, const std::string& who) {
  throw StoreRefused(path + ": is open for writing in " + who +
                     "; wait until that has ended, or use another database and merge later");
}

// Whether the path still leads to the open file: an ending writer removes it.
bool is_current(int descriptor, const std::string& file) {
  struct stat opened {
  }, found{};
  return ::fstat(descriptor, &opened) == 0 && ::stat(file.c_str(), &found) == 0 &&
         opened.st_dev == found.st_dev && opened.st_ino == found.st_ino;
}

}  // namespace

WriterLock::WriterLock(const std::string& path) : file_(path + ".lock") {
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
    if (is_current(descriptor_, file_)) break;
    ::close(descriptor_);
  }
  const std::string pid = std::to_string(::getpid()) + "\n";
  // Who holds it is for the message only: the lock stands even where a full disk keeps it empty.
  if (::ftruncate(descriptor_, 0) == 0 && ::pwrite(descriptor_, pid.data(), pid.size(), 0) < 0) {
    errno = 0;
  }
}

WriterLock::~WriterLock() {
  ::unlink(file_.c_str());
  ::close(descriptor_);
}

}  // namespace palpate
