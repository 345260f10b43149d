#include "data/files/file_permissions.h"

#include <grp.h>
#include <pwd.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <system_error>

#include "data/errors.h"
#include "data/files/output_check.h"

namespace palpate::data {
namespace {

namespace fs = std::filesystem;

bool is_trusted_owner(uid_t owner) { return owner == ::geteuid() || owner == 0; }

std::string octal(mode_t mode) {
  std::array<char, 8> text{};
  std::snprintf(text.data(), text.size(), "%04o", static_cast<unsigned>(mode & 07777));
  return text.data();
}

/// A user private group, as Debian creates for every user: it has no other members.
bool is_private_group(uid_t user, gid_t group) {
  const passwd* const person = ::getpwuid(user);
  if (person == nullptr || person->pw_gid != group) return false;
  const std::string name = person->pw_name;
  const ::group* const members = ::getgrgid(group);
  return members != nullptr && name == members->gr_name && members->gr_mem[0] == nullptr;
}

bool others_may_write(const struct stat& found) {
  if ((found.st_mode & S_IWOTH) != 0) return true;
  return (found.st_mode & S_IWGRP) != 0 && !is_private_group(found.st_uid, found.st_gid);
}

bool is_foreign(uid_t owner) { return owner != ::geteuid() && owner != 0; }

}  // namespace

FileIdentity identity_of(const std::string& path) {
  struct stat found {};
  if (::stat(path.c_str(), &found) != 0) return {};
  return {found.st_dev, found.st_ino};
}

std::uint64_t names_of_file(const std::string& path) {
  struct stat found {};
  return ::stat(path.c_str(), &found) == 0 ? found.st_nlink : 0;
}

ResolvedPath resolve_trusted_links(const std::string& path) {
  constexpr int kMostLinks = 40;
  std::error_code error;
  fs::path rest = fs::absolute(path, error), done = "/";
  if (path.empty() || error) return {"", "is not a path of a file"};
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
    if (!is_trusted_owner(found.st_uid)) {
      return {"", "leads through " + here.string() +
                      ", a link of another user, which is not followed; name the file itself, in a "
                      "folder of your own"};
    }
    const fs::path to = fs::read_symlink(here, error);
    if (error || ++links > kMostLinks) return {"", "is a link that leads nowhere"};
    rest = to / rest;
    if (to.is_absolute()) done = "/";
  }
}

void require_private_sqlite_files(const std::string& file) {
  struct stat database {};
  const bool there = ::stat(file.c_str(), &database) == 0;
  const mode_t permissions = there ? database.st_mode & 0777 : 0600;
  for (const std::string& end : sqlite_file_suffixes()) {
    const std::string beside = file + end;
    struct stat found {};
    if (::lstat(beside.c_str(), &found) != 0) continue;
    const auto refuse = [&](const std::string& why) {
      throw StoreRefused(file + ": the file " + beside + " beside it " + why +
                         "; nothing was read or written. Move it away if it is not yours, and keep "
                         "the database in a folder that only you can write to");
    };
    if (!S_ISREG(found.st_mode)) refuse("is not a regular file");
    if (is_foreign(found.st_uid) && !(there && found.st_uid == database.st_uid)) {
      refuse("belongs to another user (number " + std::to_string(found.st_uid) + ")");
    }
    if (found.st_nlink > 1) refuse("has another name (a hard link)");
    if ((found.st_mode & 077 & ~permissions) != 0) {
      refuse("has wider permissions (mode " + octal(found.st_mode) + ") than the database (" +
             octal(permissions) + "); if it is yours: chmod 600");
    }
  }
}

std::string ownership_fault(const std::string& path) {
  namespace fs = std::filesystem;
  struct stat found {};
  if (::lstat(path.c_str(), &found) != 0) return "is not there";
  if (!S_ISREG(found.st_mode) && !S_ISDIR(found.st_mode)) return "is a link or no regular file";
  const std::string owner = " belongs to another user (number ";
  if (found.st_uid != ::geteuid()) return owner.substr(1) + std::to_string(found.st_uid) + ")";
  if (S_ISREG(found.st_mode) && found.st_nlink > 1) return "has another name (a hard link)";
  if (others_may_write(found))
    return "can be written by others (mode " + octal(found.st_mode) + ")";
  std::error_code error;
  fs::path above = fs::canonical(path, error).parent_path();
  if (error) return "cannot be followed: " + error.message();
  for (;; above = above.parent_path()) {
    const std::string folder = "is in " + above.string() + ", which";
    if (::stat(above.c_str(), &found) != 0) return folder + " cannot be read";
    if (is_foreign(found.st_uid)) return folder + owner + std::to_string(found.st_uid) + ")";
    // In a sticky folder nobody else can replace this user's files.
    if (others_may_write(found) && (found.st_mode & S_ISVTX) == 0)
      return folder + " others can write to (mode " + octal(found.st_mode) + ")";
    if (above == above.parent_path()) return "";
  }
}

std::string access_warning(const std::string& database) {
  std::error_code error;
  const std::filesystem::path file =
      std::filesystem::weakly_canonical(std::filesystem::absolute(database, error), error);
  const std::string folder = file.parent_path().string();
  const char* const advice = "keep studies in a folder that only you can write to";
  struct stat found {};
  if (::stat(folder.c_str(), &found) == 0) {
    if (is_foreign(found.st_uid)) {
      return "the folder " + folder + " belongs to another user (number " +
             std::to_string(found.st_uid) + "), who can replace the database; " + advice;
    }
    if (others_may_write(found)) {
      return "others can write to the folder " + folder + " (mode " + octal(found.st_mode) +
             ") and put files beside the database; " + advice + " (chmod go-w)";
    }
  }
  if (::stat(file.c_str(), &found) != 0) return "";
  if (is_foreign(found.st_uid)) {
    return "the database " + database + " belongs to another user (number " +
           std::to_string(found.st_uid) + "), who can read and change it";
  }
  if (others_may_write(found)) {
    return "others can write to the database " + database + " (mode " + octal(found.st_mode) +
           "); chmod 600 keeps it private";
  }
  return "";
}

}  // namespace palpate::data
