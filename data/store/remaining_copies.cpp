#include "data/store/remaining_copies.h"

#include <SQLiteCpp/Database.h>
#include <SQLiteCpp/Statement.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>

#include "data/store/integrity_checks.h"
#include "data/store/validation.h"

namespace palpate::data {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kLargestText = std::uintmax_t{1} << 28U;  // bytes
constexpr int kMostEntries = 100'000;                              // of a folder

bool database_holds(const std::string& file, const std::string& code) {
  try {
    SQLite::Database db(immutable_uri(file), SQLite::OPEN_READONLY | SQLite::OPEN_URI);
    SQLite::Statement find(db, "SELECT 1 FROM participants WHERE code = ?");
    find.bind(1, code);
    return find.executeStep();
  } catch (const SQLite::Exception&) {
    return false;  // of another program, or damaged: its content is unknown
  }
}

bool file_mentions(const fs::path& file, const std::string& code) {
  std::error_code error;
  const std::uintmax_t size = fs::file_size(file, error);
  if (error) return false;
  std::ifstream in(file, std::ios::binary);
  std::string begin(15, '\0');
  in.read(begin.data(), static_cast<std::streamsize>(begin.size()));
  if (begin == "SQLite format 3") return database_holds(file.string(), code);
  if (size > kLargestText) return false;
  in.clear();
  in.seekg(0);
  return mentions({std::istreambuf_iterator<char>(in), {}}, code);
}

/// Searches the names of files in it only: file names of datasets contain codes.
bool folder_mentions(const fs::path& folder, const std::string& code) {
  std::error_code error;
  int left = kMostEntries;
  for (fs::recursive_directory_iterator at(folder, error), end; at != end && left-- > 0;
       at.increment(error)) {
    if (error) return false;
    if (mentions(at->path().filename().string(), code)) return true;
  }
  return false;
}

}  // namespace

bool mentions(const std::string& text, const std::string& code) {
  for (std::size_t at = text.find(code); at != std::string::npos; at = text.find(code, at + 1)) {
    const bool begins = at == 0 || !is_participant_code(text.substr(at - 1, 1));
    const std::size_t end = at + code.size();
    if (begins && (end == text.size() || !is_participant_code(text.substr(end, 1)))) return true;
  }
  return false;
}

std::vector<std::string> find_remaining_copies(const std::string& database, const std::string& code,
                                               const std::vector<std::string>& known) {
  std::set<fs::path> folders{fs::path(database).parent_path()};
  std::set<fs::path> leave_out(known.begin(), known.end());
  for (const char* end : {"", "-wal", "-shm", "-journal", ".palpate-lock"}) {
    leave_out.insert(database + end);
  }
  for (const std::string& path : known) folders.insert(fs::path(path).parent_path());
  std::vector<std::string> found;
  for (const fs::path& folder : folders) {
    std::error_code error;
    int left = kMostEntries;
    for (fs::directory_iterator at(folder, error), end; !error && at != end && left-- > 0;
         at.increment(error)) {
      const fs::path& path = at->path();
      if (leave_out.contains(path)) continue;
      const fs::file_status status = at->symlink_status(error);
      const bool holds = fs::is_regular_file(status) ? file_mentions(path, code)
                         : fs::is_directory(status)  ? folder_mentions(path, code)
                                                     : false;
      if (holds || mentions(path.filename().string(), code)) found.push_back(path.string());
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace palpate::data
