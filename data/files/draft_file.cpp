#include "data/files/draft_file.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/random.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <system_error>
#include <utility>

#include "data/errors.h"

namespace palpate::data {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kLetters = 6;
constexpr std::string_view kMark = ".palpate-";

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

bool is_ours_or_the_systems(uid_t owner) { return owner == ::geteuid() || owner == 0; }

/// Whether `name` in `folder` is the file that is open.
bool leads_to(int folder, const std::string& name, int descriptor) {
  struct stat named {
  }, opened{};
  return ::fstat(descriptor, &opened) == 0 &&
         ::fstatat(folder, name.c_str(), &named, AT_SYMLINK_NOFOLLOW) == 0 &&
         named.st_dev == opened.st_dev && named.st_ino == opened.st_ino;
}

/// Removes what has such a name, is ours, and is locked by nobody.
template <class IsDraft>
void remove_dead(const fs::path& folder, IsDraft is_draft) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder.empty() ? "." : folder, error)) {
    if (!is_draft(entry.path().filename().string())) continue;
    const std::string path = (folder / entry.path().filename()).string();
    struct stat found {};
    if (::lstat(path.c_str(), &found) != 0 || found.st_uid != ::geteuid()) continue;
    if (!S_ISDIR(found.st_mode) && !(S_ISREG(found.st_mode) && found.st_nlink == 1)) continue;
    const int draft = ::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    if (draft < 0) continue;
    if (::flock(draft, LOCK_EX | LOCK_NB) == 0) fs::remove_all(path, error);
    ::close(draft);
  }
}

}  // namespace

std::string draft_stem(const std::string& target) {
  const fs::path path(target);
  constexpr std::size_t kMost = 200;  // bytes; a name has at most 255
  return (path.parent_path() /
          ("." + path.filename().string().substr(0, kMost) + std::string(kMark)))
      .string();
}

void remove_dead_drafts(const std::string& target) {
  const std::string stem = fs::path(draft_stem(target)).filename().string();
  remove_dead(fs::path(target).parent_path(), [&](const std::string& name) {
    return name.starts_with(stem) && name.size() == stem.size() + kLetters;
  });
}

void remove_dead_drafts_in(const std::string& folder) {
  remove_dead(folder, [](const std::string& name) {
    const std::size_t letters = name.rfind(kMark);
    return name.starts_with('.') && letters != std::string::npos && letters > 1 &&
           name.size() == letters + kMark.size() + kLetters;
  });
}

FollowedPath follow_own_links(const std::string& path) {
  constexpr int kMostLinks = 40;
  std::error_code error;
  fs::path rest = fs::absolute(path, error), done = "/";
  if (path.empty() || error) return {"", "is no path of a file"};
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
    if (!is_ours_or_the_systems(found.st_uid)) {
      return {"", "leads through " + here.string() +
                      ", a link of another user's, which is not followed; name the file itself, in "
                      "a folder of your own"};
    }
    const fs::path to = fs::read_symlink(here, error);
    if (error || ++links > kMostLinks) return {"", "is a link that leads nowhere"};
    rest = to / rest;
    if (to.is_absolute()) done = "/";
  }
}

DraftFile::DraftFile(const std::string& target) : target_(target) {
  const FollowedPath followed = follow_own_links(target);
  if (!followed.fault.empty()) throw StoreRefused(target + ": " + followed.fault);
  open_folder(followed.path);
  remove_dead_drafts(followed.path);
  make();
}

void DraftFile::open_folder(const std::string& path) {
  name_ = fs::path(path).filename().string();
  const std::string folder = fs::path(path).parent_path().string();
  folder_ = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  if (folder_ < 0) folder_ = ::open(folder.c_str(), O_PATH | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
  if (folder_ < 0) fail("cannot be written", errno);
}

void DraftFile::make() {
  const std::string stem = draft_stem(name_);
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

DraftFile::~DraftFile() {
  if (state_ == State::draft || state_ == State::exchanged) {
    ::unlinkat(folder_, draft_.c_str(), 0);
  }
  ::close(descriptor_);
  ::close(folder_);
}

void DraftFile::write(std::string_view text) {
  while (!text.empty()) {
    const ssize_t written = ::write(descriptor_, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) fail("cannot be written", errno);
    text.remove_prefix(static_cast<std::size_t>(written));
  }
}

void DraftFile::sync() {
  if (::fsync(descriptor_) != 0) fail("cannot be written", errno);
}

void DraftFile::give_name(bool replace) {
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

void DraftFile::take_back() {
  if (state_ == State::draft || state_ == State::replaced) return;
  if (state_ == State::named) {
    if (leads_to(folder_, name_, descriptor_)) ::unlinkat(folder_, name_.c_str(), 0);
  } else if (::renameat2(folder_, name_.c_str(), folder_, draft_.c_str(), RENAME_EXCHANGE) != 0) {
    return;
  }
  state_ = State::draft;
}

void DraftFile::fail(const char* what, int error) const {
  throw StoreError(target_ + ": " + what + ": " + std::generic_category().message(error) +
                   "; nothing was written. Check the folder, its permissions and the free space");
}

bool name_new_file(const std::string& draft, const std::string& path) {
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

void give_names(std::deque<DraftFile>& drafts, bool replace) {
  try {
    for (DraftFile& draft : drafts) draft.give_name(replace);
  } catch (...) {
    for (DraftFile& draft : drafts) draft.take_back();
    throw;
  }
}

}  // namespace palpate::data
