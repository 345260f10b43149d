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

#include "data/base/json_text.h"
#include "data/errors.h"
#include "data/files/atomic_file.h"
#include "data/files/file_permissions.h"
#include "data/files/output_check.h"

namespace palpate::data {
namespace {

namespace fs = std::filesystem;

/// "/a/b/" and "b" -> an absolute path that ends in a name.
fs::path without_trailing_slash(const std::string& target) {
  fs::path path = fs::absolute(target).lexically_normal();
  if (!path.has_filename()) path = path.parent_path();
  return path;
}

bool made_by_palpate(const fs::path& description) {
  std::ifstream in(description);
  const std::string text(std::istreambuf_iterator<char>(in), {});
  const nlohmann::json json = json_or_discarded(text);
  if (!json.is_object()) return false;
  for (const auto& program : json.value("GeneratedBy", nlohmann::json::array())) {
    if (program.is_object() && program.value("Name", nlohmann::json()) == "palpate") return true;
  }
  const auto technique = json.value("measurementTechnique", nlohmann::json());
  return technique.is_string() && technique.get<std::string>().starts_with("palpate ");
}

}  // namespace

AtomicFolder::AtomicFolder(const std::string& target)
    : target_(without_trailing_slash(target).string()) {
  require_name(target);
  const std::string fault = resolve_trusted_links(fs::path(target_).parent_path().string()).fault;
  if (!fault.empty()) throw StoreRefused(target_ + ": " + fault);
  remove_stale_temporaries(target_);
  temporary_ = temporary_prefix(target_) + "XXXXXX";
  if (::mkdtemp(temporary_.data()) == nullptr) {
    const int error = errno;
    temporary_.clear();
    fail("cannot be created", error);
  }
  descriptor_ = ::open(temporary_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor_ < 0 || ::flock(descriptor_, LOCK_EX | LOCK_NB) != 0) {
    const int error = errno;
    fs::remove_all(temporary_);
    if (descriptor_ >= 0) ::close(descriptor_);
    fail("cannot be created", error);
  }
}

AtomicFolder::~AtomicFolder() {
  std::error_code error;
  if (!temporary_.empty()) fs::remove_all(temporary_, error);
  ::close(descriptor_);
}

std::string AtomicFolder::prepare(const std::string& name) const {
  const fs::path path = fs::path(temporary_) / name;
  std::error_code error;
  fs::create_directories(path.parent_path(), error);
  if (error) fail("cannot be created", error.value());
  return path.string();
}

void AtomicFolder::commit(bool replace) {
  if (::syncfs(descriptor_) != 0) fail("cannot be written", errno);
  const bool swap = replace && fs::exists(target_) && !fs::is_empty(target_);
  if (!swap) {
    if (::rename(temporary_.c_str(), target_.c_str()) != 0)
      fail("cannot be renamed to its final name", errno);
    temporary_.clear();
    return;
  }
  if (::renameat2(AT_FDCWD, temporary_.c_str(), AT_FDCWD, target_.c_str(), RENAME_EXCHANGE) != 0) {
    if (errno != EINVAL && errno != ENOSYS) fail("cannot be renamed to its final name", errno);
    // A file system without RENAME_EXCHANGE: two renames.
    const std::string aside = temporary_ + "-old";
    if (::rename(target_.c_str(), aside.c_str()) != 0) fail("cannot be replaced", errno);
    if (::rename(temporary_.c_str(), target_.c_str()) != 0) {
      const int error = errno;
      ::rename(aside.c_str(), target_.c_str());
      fail("cannot be renamed to its final name", error);
    }
    temporary_ = aside;
  }
  std::error_code error;  // the export is in place: failing to remove the previous one is no error
  fs::remove_all(std::exchange(temporary_, ""), error);
}

void AtomicFolder::fail(const char* what, int error) const {
  throw StoreError(target_ + ": " + what + ": " + write_fault(error) +
                   "; nothing was written. Check the folder, its permissions and the free space");
}

void require_replaceable(const std::string& target, bool force,
                         const std::function<bool(const std::string&)>& ours) {
  if (target.empty()) throw StoreRefused("'' names no folder to write to");
  require_name(target);
  const fs::path folder = without_trailing_slash(target);
  const fs::file_status status = fs::symlink_status(folder);
  if (!fs::exists(status)) return;
  if (!fs::is_directory(status)) {
    throw StoreRefused(target + ": exists and is not a folder; name a folder to be created");
  }
  if (fs::is_empty(folder)) return;
  if (!force) {
    throw StoreRefused(target + ": exists already; give --force to replace it, or another name");
  }
  if (!made_by_palpate(folder / "dataset_description.json")) {
    throw StoreRefused(target +
                       ": is not an export of palpate (by its dataset_description.json) and is not "
                       "replaced; name another folder");
  }
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (fs::is_directory(entry.symlink_status())) continue;
    const std::string name = entry.path().lexically_relative(folder).string();
    if (!fs::is_regular_file(entry.symlink_status()) || !ours(name)) {
      throw StoreRefused(
          target + ": contains " + name +
          ", which is not part of such an export and would be lost; move it away, or "
          "name another folder");
    }
  }
}

}  // namespace palpate::data
