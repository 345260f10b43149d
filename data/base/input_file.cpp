#include "data/base/input_file.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace palpate {
namespace {

[[noreturn]] void refuse(const std::string& why) { throw std::runtime_error(why); }

std::string size_text(std::uintmax_t bytes) {
  return bytes >> 20U > 0 ? std::to_string(bytes >> 20U) + " MB" : std::to_string(bytes) + " bytes";
}

}  // namespace

// O_NONBLOCK: opening a pipe does not wait for its writer.
InputFile::InputFile(const std::string& path, std::uintmax_t most_bytes)
    : file_(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOCTTY | O_NONBLOCK)), most_(most_bytes) {
  if (file_ < 0) refuse(errno == ENOENT ? "no such file" : std::strerror(errno));
  struct stat is {};
  const bool known = ::fstat(file_, &is) == 0;
  if (known && !S_ISDIR(is.st_mode)) return;
  ::close(file_);
  refuse(known ? "this is a folder" : "it cannot be read");
}

InputFile::~InputFile() { ::close(file_); }

void InputFile::wait() const {
  pollfd ready{file_, POLLIN, 0};
  const int found = ::poll(&ready, 1, 1000 * kPatienceSeconds);
  if (found == 0) {
    refuse("nothing was written into this pipe for " + std::to_string(kPatienceSeconds) +
           " s; is the program at its other end running? Or write to a file first");
  }
  if (found < 0 && errno != EINTR) refuse(std::strerror(errno));
}

std::size_t InputFile::read(char* to, std::size_t size) {
  for (;;) {
    wait();
    const ssize_t got = ::read(file_, to, size);
    if (got >= 0) {
      so_far_ += static_cast<std::uintmax_t>(got);
      if (so_far_ > most_) refuse("it has more than " + size_text(most_));
      return static_cast<std::size_t>(got);
    }
    if (errno != EAGAIN && errno != EINTR) refuse(std::strerror(errno));
  }
}

std::string read_whole(const std::string& path, std::uintmax_t most_bytes) {
  InputFile file(path, most_bytes);
  std::string text;
  std::array<char, 1 << 16> buffer{};
  while (const std::size_t got = file.read(buffer.data(), buffer.size()))
    text.append(buffer.data(), got);
  return text;
}

}  // namespace palpate
