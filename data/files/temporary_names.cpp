#include "data/files/temporary_names.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <string_view>
#include <system_error>

#include "data/errors.h"

namespace palpate::data {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLetters = 6;
constexpr std::string_view kMark = ".palpate-";

/// Removes entries of the folder with such a name, of this user, that no process has locked.
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

}  // namespace

std::string random_letters() {
  constexpr std::string_view kAlphabet =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_";
  std::array<std::uint8_t, kLetters> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
    throw StoreError("the system gives no random numbers");
  }
  std::string letters;
  for (const std::uint8_t byte : bytes) letters += kAlphabet[byte % kAlphabet.size()];
  return letters;
}

std::string temporary_prefix(const std::string& target) {
  const fs::path path(target);
  constexpr std::size_t kMost = 200;  // bytes; a name has at most 255
  return (path.parent_path() /
          ("." + path.filename().string().substr(0, kMost) + std::string(kMark)))
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
    const std::size_t letters = name.rfind(kMark);
    return name.starts_with('.') && letters != std::string::npos && letters > 1 &&
           name.size() == letters + kMark.size() + kLetters;
  });
}

}  // namespace palpate::data
