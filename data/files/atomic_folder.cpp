#include "data/files/atomic_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>

#include "data/errors.h"
#include "data/files/temporary_names.h"
#include "data/files/trusted_links.h"

namespace palpate::data {
namespace {

namespace fs = std::filesystem;

/// "/a/b/" and "b" -> an absolute path that ends in a name.
fs::path named(const std::string& target) {
  fs::path path = fs::absolute(target).lexically_normal();
  if (!path.has_filename()) path = path.parent_path();
  return path;
}

bool made_by_palpate(const fs::path& description) {
  std::ifstream in(description);
  const auto json = nlohmann::json::parse(in, nullptr, false);
  if (!json.is_object()) return false;
  for (const auto& program : json.value("GeneratedBy", nlohmann::json::array())) {
    if (program.is_object() && program.value("Name", nlohmann::json()) == "palpate") return true;
  }
  const auto technique = json.value("measurementTechnique", nlohmann::json());
  return technique.is_string() && technique.get<std::string>().starts_with("palpate ");
}

}  // namespace

AtomicFolder::AtomicFolder(const std::string& target) : target_(named(target).string()) {
  const std::string fault = resolve_trusted_links(fs::path(target_).parent_path().string()).fault;
  if (!fault.empty()) throw StoreRefused(target_ + ": " + fault);
  remove_stale_temporaries(target_);
  draft_ = temporary_prefix(target_) + "XXXXXX";
  if (::mkdtemp(draft_.data()) == nullptr) {
    const int error = errno;
    draft_.clear();
    fail("cannot be created", error);
  }
  descriptor_ = ::open(draft_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor_ < 0 || ::flock(descriptor_, LOCK_EX | LOCK_NB) != 0) {
    const int error = errno;
    fs::remove_all(draft_);
    if (descriptor_ >= 0) ::close(descriptor_);
    fail("cannot be created", error);
  }
}

AtomicFolder::~AtomicFolder() {
  std::error_code error;
  if (!draft_.empty()) fs::remove_all(draft_, error);
  ::close(descriptor_);
}

std::string AtomicFolder::place(const std::string& name) const {
  const fs::path path = fs::path(draft_) / name;
  std::error_code error;
  fs::create_directories(path.parent_path(), error);
  if (error) fail("cannot be created", error.value());
  return path.string();
}

void AtomicFolder::commit(bool replace) {
  if (::syncfs(descriptor_) != 0) fail("cannot be written", errno);
  const bool swap = replace && fs::exists(target_) && !fs::is_empty(target_);
  if (!swap) {
    if (::rename(draft_.c_str(), target_.c_str()) != 0) fail("cannot be given its name", errno);
    draft_.clear();
    return;
  }
  if (::renameat2(AT_FDCWD, draft_.c_str(), AT_FDCWD, target_.c_str(), RENAME_EXCHANGE) != 0) {
    if (errno != EINVAL && errno != ENOSYS) fail("cannot be given its name", errno);
    // A file system that cannot exchange: the old one steps aside.
    const std::string aside = draft_ + "-old";
    if (::rename(target_.c_str(), aside.c_str()) != 0) fail("cannot be replaced", errno);
    if (::rename(draft_.c_str(), target_.c_str()) != 0) {
      const int error = errno;
      ::rename(aside.c_str(), target_.c_str());
      fail("cannot be given its name", error);
    }
    draft_ = aside;
  }
  std::error_code error;  // the new one is in place; of the old one, all that can be removed is
  fs::remove_all(std::exchange(draft_, ""), error);
}

void AtomicFolder::fail(const char* what, int error) const {
  throw StoreError(target_ + ": " + what + ": " + std::generic_category().message(error) +
                   "; nothing was written. Check the folder, its permissions and the free space");
}

void require_replaceable(const std::string& target, bool force,
                         const std::function<bool(const std::string&)>& ours) {
  if (target.empty()) throw StoreRefused("'' names no folder to write to");
  const fs::path folder = named(target);
  const fs::file_status status = fs::symlink_status(folder);
  if (!fs::exists(status)) return;
  if (!fs::is_directory(status)) {
    throw StoreRefused(target + ": is there and is not a folder; name a folder to be made");
  }
  if (fs::is_empty(folder)) return;
  if (!force) {
    throw StoreRefused(target + ": is there already; give --force to replace it, or another name");
  }
  if (!made_by_palpate(folder / "dataset_description.json")) {
    throw StoreRefused(target +
                       ": is not an export of palpate (its dataset_description.json does not say "
                       "so) and is not replaced; name another folder");
  }
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (fs::is_directory(entry.symlink_status())) continue;
    const std::string name = entry.path().lexically_relative(folder).string();
    if (!fs::is_regular_file(entry.symlink_status()) || !ours(name)) {
      throw StoreRefused(target + ": holds " + name +
                         ", which such an export does not make and which would be lost; move it "
                         "away, or name another folder");
    }
  }
}

}  // namespace palpate::data
