#include "data/files/output_check.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <filesystem>
#include <string_view>
#include <system_error>

#include "data/errors.h"
#include "data/files/file_permissions.h"

namespace palpate::data {
namespace {

namespace fs = std::filesystem;

std::optional<struct stat> stat_of(const std::string& path) {
  struct stat found {};
  if (::stat(path.c_str(), &found) != 0) return std::nullopt;
  return found;
}

std::string resolved(const std::string& path) {
  std::error_code error;
  const fs::path place = fs::weakly_canonical(fs::absolute(path, error), error);
  return error ? path : place.string();
}

bool same_file(const std::string& a, const std::string& b) {
  if (a == b) return true;
  const auto first = stat_of(a), second = stat_of(b);
  return first && second && first->st_dev == second->st_dev && first->st_ino == second->st_ino;
}

bool is_null_device(const struct stat& found) {
  return S_ISCHR(found.st_mode) && found.st_rdev == makedev(1, 3);
}

/// Why a file that is not regular cannot be written to; "" for pipes, terminals and descriptors
/// that the shell opened.
std::string stream_refusal(const struct stat& found, std::optional<int> descriptor) {
  if (S_ISDIR(found.st_mode)) return "is a folder; must be a file";
  if (is_null_device(found)) return "";
  if (S_ISFIFO(found.st_mode)) {
    const bool ours = descriptor || found.st_uid == ::geteuid() || found.st_uid == 0;
    return ours ? "" : "is a pipe of another user; name a file";
  }
  if (S_ISSOCK(found.st_mode) && descriptor) return "";
  const bool terminal =
      descriptor ? ::isatty(*descriptor) == 1 : found.st_rdev == makedev(5, 0);  // /dev/tty
  if (S_ISCHR(found.st_mode) && terminal) return "";
  return "is a device; name a file";
}

constexpr const char* kNoName = "names no file or folder here; for a file of this name write ./-";

}  // namespace

const std::vector<std::string>& sqlite_file_suffixes() {
  static const std::vector<std::string> ends = {"-wal", "-shm", "-journal"};
  return ends;
}

bool may_be_database(const std::string& path) {
  const auto found = stat_of(path);
  // Do not open a pipe: its writer would take this process for the reader.
  if (!found || !S_ISREG(found->st_mode)) return false;
  const int file = ::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  if (file < 0) return true;
  std::array<char, 16> begin{};
  const ssize_t length = ::pread(file, begin.data(), begin.size(), 0);
  ::close(file);
  if (length < 0) return true;
  const std::string_view text(begin.data(), static_cast<std::size_t>(length));
  using namespace std::string_view_literals;
  for (const std::string_view magic :
       {"SQLite format 3\0"sv, "\x37\x7f\x06\x82"sv, "\x37\x7f\x06\x83"sv,
        "\xd9\xd5\x05\xf9\x20\xa1\x63\xd7"sv}) {
    if (text.starts_with(magic)) return true;
  }
  return false;
}

bool belongs_to_database(const std::string& path) {
  const std::string place = resolved(path);
  for (std::string_view end : {"-wal", "-shm", "-journal", kLockEnd}) {
    if (!place.ends_with(end)) continue;
    const std::string database = place.substr(0, place.size() - end.size());
    if (may_be_database(database)) return true;
  }
  return false;
}

std::optional<int> descriptor_of_path(const std::string& path) {
  if (path == "/dev/stdout") return STDOUT_FILENO;
  if (path == "/dev/stderr") return STDERR_FILENO;
  for (const std::string_view begin : {"/dev/fd/", "/proc/self/fd/"}) {
    if (!path.starts_with(begin)) continue;
    const std::string_view digits = std::string_view(path).substr(begin.size());
    int number = 0;
    const auto [end, error] = std::from_chars(digits.begin(), digits.end(), number);
    if (error == std::errc() && end == digits.end() && number >= 0) return number;
  }
  return std::nullopt;
}

std::string write_fault(int error) {
  // A copy within the system (copy_file_range) tells of the limit as of a broken disk.
  struct rlimit limit {};
  const bool limited = ::getrlimit(RLIMIT_FSIZE, &limit) == 0 && limit.rlim_cur != RLIM_INFINITY;
  if (error == EFBIG || (error == EIO && limited))
    return "the limit on the size of a file is reached, as if the disk were full (ulimit -f shows "
           "it)";
  return std::generic_category().message(error);
}

void require_name(const std::string& path) {
  if (path == "-") throw StoreRefused(path + ": " + kNoName);
}

void ProtectedFiles::add(const std::string& path, const std::string& reason) {
  if (path.empty()) return;
  const std::string file = resolved(path);
  entries_.push_back({file, reason});
  if (!may_be_database(file)) return;
  for (const std::string& suffix : sqlite_file_suffixes()) {
    entries_.push_back({file + suffix, "SQLite's file beside a database: " + reason});
  }
}

std::string ProtectedFiles::reason(const std::string& path) const {
  const auto found = stat_of(path);
  // A terminal or a pipe may be input and output at once.
  if (found && !S_ISREG(found->st_mode)) return "";
  const std::string file = resolved(path);
  for (const Entry& one : entries_) {
    if (same_file(one.file, file)) return one.reason;
  }
  return "";
}

std::string write_refusal(const std::string& path, bool force,
                          const ProtectedFiles& protected_files) {
  if (path.empty()) return "must not be empty";
  if (path == "-") return kNoName;
  const auto found = stat_of(path);
  const auto descriptor = descriptor_of_path(path);
  if (descriptor) {
    const int mode = ::fcntl(*descriptor, F_GETFL);
    if (mode < 0 || (mode & O_ACCMODE) == O_RDONLY) return "is not open for writing";
  }
  if (found && !S_ISREG(found->st_mode)) return stream_refusal(*found, descriptor);
  std::string why = protected_files.reason(path);
  if (!why.empty()) return why;
  const std::string place = resolved(path);
  const bool logged = found && (stat_of(place + "-wal") || stat_of(place + "-journal"));
  if (logged || may_be_database(path) || belongs_to_database(path)) {
    return "is a database or a file of one, and is never overwritten; name another file";
  }
  if (descriptor) return "";
  if (place.starts_with("/dev/") && !place.starts_with("/dev/shm/")) {
    return "is in the folder of devices; name a file in another folder";
  }
  why = resolve_trusted_links(path).fault;
  if (!why.empty()) return why;
  struct stat link {};
  if (!found && ::lstat(path.c_str(), &link) == 0) return "is a link to nothing";
  if (found && !force) return "exists already; --force replaces it";
  return "";
}

}  // namespace palpate::data
