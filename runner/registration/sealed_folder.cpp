#include "runner/registration/sealed_folder.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <filesystem>
#include <map>
#include <sstream>
#include <string_view>
#include <system_error>

#include "data/base/checksum.h"
#include "data/base/text.h"
#include "data/files/text_sink.h"
#include "runner/usage_error.h"

namespace palpate::runner::registration {
namespace {

namespace fs = std::filesystem;

/// A regular file as memory.
class MappedFile {
 public:
  MappedFile(const std::string& folder, const std::string& name) {
    const std::string path = (fs::path(folder) / name).string();
    const int file = ::open(path.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC);
    struct stat found {};
    if (file < 0 || ::fstat(file, &found) != 0 || !S_ISREG(found.st_mode)) {
      const int error = errno;
      if (file >= 0) ::close(file);
      throw UsageError(
          printable(path) + ": expected a file that can be read: " +
          (file < 0 ? std::generic_category().message(error) : "it is not a regular file"));
    }
    size_ = static_cast<std::size_t>(found.st_size);
    if (size_ > 0) data_ = ::mmap(nullptr, size_, PROT_READ, MAP_PRIVATE, file, 0);
    ::close(file);
    if (data_ == MAP_FAILED) throw std::runtime_error(path + ": cannot be read");
  }
  ~MappedFile() {
    if (size_ > 0) ::munmap(data_, size_);
  }
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;
  std::string_view text() const { return {static_cast<const char*>(data_), size_}; }

 private:
  void* data_ = nullptr;
  std::size_t size_ = 0;
};

bool contains(const std::vector<std::string>& names, const std::string& name) {
  return std::ranges::find(names, name) != names.end();
}

bool is_listable(const std::string& name) {
  return is_plain_utf8(name) && name.find('\\') == std::string::npos;
}

std::map<std::string, std::string> listed_checksums(const std::string& folder) {
  std::map<std::string, std::string> out;
  std::istringstream lines(read_member(folder, kChecksums));
  std::string line;
  while (std::getline(lines, line)) {
    const std::string_view hex =
        std::string_view(line).substr(0, std::min<std::size_t>(64, line.size()));
    const bool good = line.size() > 66 && is_checksum(hex) && line.compare(64, 2, "  ") == 0;
    if (!good)
      throw UsageError(printable((fs::path(folder) / kChecksums).string()) +
                       ": expected lines of sha256sum, found '" + printable(line, 80) + "'");
    out[line.substr(66)] = std::string(hex);
  }
  return out;
}

}  // namespace

std::vector<std::string> files_below(const std::string& folder) {
  std::error_code error;
  if (!fs::is_directory(folder, error)) throw UsageError(printable(folder) + ": expected a folder");
  std::vector<std::string> names;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const fs::file_status status = entry.symlink_status();
    if (fs::is_directory(status)) continue;
    const std::string name = entry.path().lexically_relative(folder).generic_string();
    if (!fs::is_regular_file(status) || !is_listable(name))
      throw UsageError(printable((fs::path(folder) / name).string()) +
                       ": expected files with plain names and folders only; this is a link or "
                       "another thing");
    names.push_back(name);
  }
  std::ranges::sort(names);
  return names;
}

std::string read_member(const std::string& folder, const std::string& name) {
  return std::string(MappedFile(folder, name).text());
}

std::string checksum_of_member(const std::string& folder, const std::string& name) {
  return checksum_hex(MappedFile(folder, name).text());
}

std::uint64_t size_of_member(const std::string& folder, const std::string& name) {
  return MappedFile(folder, name).text().size();
}

void write_member(const data::AtomicFolder& draft, const std::string& name,
                  const std::string& text) {
  data::FileSink file(draft.prepare(name));
  file.write(text);
  file.close(false);
}

std::string checksum_lines(const std::string& folder, const std::vector<std::string>& open) {
  std::string lines;
  for (const std::string& name : files_below(folder)) {
    if (name != kChecksums && !contains(open, name))
      lines += checksum_of_member(folder, name) + "  " + name + "\n";
  }
  return lines;
}

void write_checksums(const data::AtomicFolder& draft, const std::vector<std::string>& open) {
  write_member(draft, kChecksums, checksum_lines(draft / "", open));
}

std::vector<std::string> checksum_faults(const std::string& folder,
                                         const std::vector<std::string>& open) {
  const std::map<std::string, std::string> listed = listed_checksums(folder);
  std::vector<std::string> faults;
  const std::vector<std::string> there = files_below(folder);
  for (const std::string& name : there) {
    if (name == kChecksums || contains(open, name)) continue;
    const auto found = listed.find(name);
    if (found == listed.end()) {
      faults.push_back(name + " is not listed in " + kChecksums);
    } else if (checksum_of_member(folder, name) != found->second) {
      faults.push_back(name + " has changed: SHA-256 " +
                       checksum_of_member(folder, name).substr(0, 12) + "..., listed " +
                       found->second.substr(0, 12) + "...");
    }
  }
  for (const auto& [name, checksum] : listed) {
    if (!std::ranges::binary_search(there, name)) faults.push_back(name + " is missing");
  }
  return faults;
}

void require_replaceable_folder(const std::string& folder, bool force, const std::string& mark,
                                const std::vector<std::string>& open) {
  if (folder.empty()) throw UsageError("--out: expected a new folder");
  const fs::file_status status = fs::symlink_status(fs::path(folder));
  if (!fs::exists(status)) return;
  if (!fs::is_directory(status))
    throw UsageError(printable(folder) + ": exists and is not a folder; name a new folder");
  if (fs::is_empty(folder)) return;
  if (!force) throw UsageError(printable(folder) + ": exists already; --force replaces it");
  const std::vector<std::string> there = files_below(folder);
  if (!std::ranges::binary_search(there, mark) || !std::ranges::binary_search(there, kChecksums))
    throw UsageError(printable(folder) +
                     ": was not made by this command and is not replaced; name another folder");
  const std::map<std::string, std::string> listed = listed_checksums(folder);
  for (const std::string& name : there) {
    if (name != kChecksums && !contains(open, name) && !listed.contains(name))
      throw UsageError(printable(folder) + ": contains " + printable(name) +
                       "; this command did not write it, and it would be lost; move it away, "
                       "or name another folder");
  }
}

}  // namespace palpate::runner::registration
