#include "runner/design/protocol_file.h"

#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <system_error>

#include "data/base/checksum.h"
#include "data/base/json_text.h"
#include "data/base/text.h"
#include "data/files/atomic_file.h"
#include "data/store/store.h"
#include "protocols/json_document.h"
#include "protocols/object_reader.h"
#include "runner/usage_error.h"

namespace palpate::runner::design {
namespace {

namespace fs = std::filesystem;

/// Why this user may not replace a file; empty: they may.
std::string protection_of(const std::string& path) {
  struct stat found {};
  if (::stat(path.c_str(), &found) != 0) return "";
  // access(2) lets root write everything, also what its owner has protected.
  if ((found.st_mode & 0222) == 0 || ::access(path.c_str(), W_OK) != 0)
    return "The file is write-protected.";
  return found.st_uid == ::geteuid() || ::geteuid() == 0
             ? ""
             : "The file belongs to another user, who would lose it to you.";
}

/// A page gets the text as JSON, which can hold nothing else.
bool is_utf8(const std::string& text) {
  try {
    (void)nlohmann::json(text).dump();
    return true;
  } catch (const nlohmann::json::exception&) {
    return false;
  }
}

/// \throws StoreError
void write_atomically(const std::string& path, const std::string& text, bool replace) {
  data::AtomicFile file(path);
  file.write(text);
  struct stat old {};
  if (replace && ::stat(path.c_str(), &old) == 0) {
    ::fchmod(file.descriptor(), old.st_mode & 0777);
    if (::fchown(file.descriptor(), old.st_uid, old.st_gid) != 0) {
      // Not a member of its group: it is the user's own group's now.
    }
  }
  file.sync();
  file.commit(replace);
}

}  // namespace

ProtocolFile::ProtocolFile(const std::string& path) : path_(path) {
  std::error_code none;
  // Through a link the file is replaced that it points to, not the link.
  if (fs::is_symlink(path, none)) path_ = fs::weakly_canonical(path).string();
  if (path_.size() < 6 || !path_.ends_with(".json"))
    throw UsageError(printable(path) + ": expected a name that ends with .json");
  const fs::path folder = fs::path(path_).parent_path();
  if (!folder.empty() && !fs::is_directory(folder, none))
    throw UsageError(printable(path) + ": there is no folder " + printable(folder.string()));
  const std::optional<FileState> found = read();
  if (!found) return;
  const nlohmann::json json = json_or_discarded(found->text);
  if (json.is_object() && json.contains("objects") && !json.contains("version"))
    throw UsageError(printable(path) + ": is a scene; palpate explore shows it");
  if (json.is_object() && json.contains("version") && json["version"] != 1 && json["version"] != 2)
    throw UsageError(printable(path) + ": /version: expected 1 or 2" +
                     printable(protocols::found_text(json["version"])));
  if (json.is_object() && !json.contains("version") && !json.contains("stimuli") && !json.empty())
    throw UsageError(printable(path) + ": is no protocol: it has neither version nor stimuli");
}

std::string ProtocolFile::name() const { return fs::path(path_).filename().string(); }

std::string ProtocolFile::folder() const {
  const std::string folder = fs::path(path_).parent_path().string();
  return folder.empty() ? "." : folder;
}

std::optional<FileState> ProtocolFile::read() const { return read_state(path_); }

std::string ProtocolFile::save(const std::string& text, const std::string& opened) const {
  return save_state(path_, text, opened);
}

std::string ProtocolFile::save_copy(const std::string& text) const {
  return save_beside(path_, text);
}

std::optional<FileState> read_state(const std::string& path) {
  std::error_code none;
  if (!fs::exists(fs::symlink_status(path, none))) return std::nullopt;
  FileState out;
  out.text = protocols::read_text_file(path);
  if (!is_utf8(out.text))
    throw UsageError(printable(path) + ": is not UTF-8; convert it, for example with iconv");
  out.sha256 = checksum_hex(out.text);
  return out;
}

std::string save_state(const std::string& path, const std::string& text,
                       const std::string& opened) {
  try {
    const std::optional<FileState> found = read_state(path);
    if (found && found->sha256 != opened)
      throw NotSaved(opened.empty() ? "Another program has made this file meanwhile."
                                    : "Another program has changed this file meanwhile.",
                     found);
    if (!found && !opened.empty())
      throw NotSaved("The file was removed or renamed meanwhile.", FileState{});
    if (const std::string why = protection_of(path); !why.empty()) throw NotSaved(why);
    write_atomically(path, text, found.has_value());
  } catch (const data::StoreError& error) {
    throw NotSaved(error.what());
  } catch (const protocols::InputError& error) {
    throw NotSaved(error.what());
  } catch (const UsageError& error) {
    throw NotSaved(error.what());
  }
  return checksum_hex(text);
}

std::string save_beside(const std::string& path, const std::string& bytes) {
  try {
    const std::string chosen = free_name(path);
    write_atomically(chosen, bytes, false);
    return fs::path(chosen).filename().string();
  } catch (const data::StoreError& error) {
    throw NotSaved(error.what());
  }
}

std::string free_name(const std::string& path) {
  const fs::path given(path);
  const std::string stem = (given.parent_path() / given.stem()).string();
  const std::string end = given.extension().string();
  std::string name = path;
  std::error_code none;
  for (int n = 2; fs::exists(fs::symlink_status(name, none)); ++n)
    name = stem + "-" + std::to_string(n) + end;
  return name;
}

}  // namespace palpate::runner::design
