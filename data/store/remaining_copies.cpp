#include "data/store/remaining_copies.h"

#include <SQLiteCpp/Database.h>
#include <SQLiteCpp/Statement.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <string_view>
#include <utility>

#include "data/store/integrity_checks.h"
#include "data/store/validation.h"

namespace palpate::data {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kLargestText = std::uintmax_t{1} << 28U;  // bytes
constexpr std::uintmax_t kMostBytes = std::uintmax_t{8} << 30U;    // of all texts
constexpr int kMostEntries = 100'000;

enum class Holds { no, yes, unknown };

std::string contents_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// What the tables of a palpate database say.
Holds table_holds(const std::string& file, const std::string& code) {
  try {
    SQLite::Database db(immutable_uri(file), SQLite::OPEN_READONLY | SQLite::OPEN_URI);
    SQLite::Statement find(db, "SELECT 1 FROM participants WHERE code = ?");
    find.bind(1, code);
    return find.executeStep() ? Holds::yes : Holds::no;
  } catch (const SQLite::Exception&) {
    return Holds::unknown;  // of another program, or damaged
  }
}

bool is_compressed(std::string_view begin) {
  using namespace std::string_view_literals;
  for (const std::string_view magic : {"\x1f\x8b"sv, "PK\x03\x04"sv,
                                       "\xfd"
                                       "7zXZ"sv,
                                       "\x28\xb5\x2f\xfd"sv, "BZh"sv, "7z\xbc\xaf"sv}) {
    if (begin.starts_with(magic)) return true;
  }
  return false;
}

/// Looks beside the database and into folders, for one code.
class Search {
 public:
  /// \param database  its file name, after which copies are named
  Search(std::string code, const fs::path& database, std::set<fs::path> leave_out)
      : code_(std::move(code)), stem_(database.stem().string()), leave_out_(std::move(leave_out)) {}

  void beside(const fs::path& folder) {
    std::error_code error;
    for (fs::directory_iterator at(folder, error), end; !error && at != end && goes_on();
         at.increment(error)) {
      const fs::path& path = at->path();
      if (leave_out_.contains(path)) continue;
      const fs::file_status status = at->symlink_status(error);
      if (mentions(path.filename().string(), code_)) {
        found_.insert(path.string());
      } else if (fs::is_directory(status)) {
        within(path);
      } else if (fs::is_regular_file(status)) {
        look_into(path);
      }
    }
    if (left_ == 0 || bytes_ >= kMostBytes) found_.insert(folder.string());
  }

  std::vector<std::string> found() const { return {found_.begin(), found_.end()}; }

 private:
  bool goes_on() { return left_ > 0 && left_-- > 0 && bytes_ < kMostBytes; }

  /// A folder with the code in a name: datasets name files and folders after participants.
  bool names_in(const fs::path& folder) {
    std::error_code error;
    int left = kMostEntries;
    for (fs::recursive_directory_iterator at(folder, error), end; !error && at != end && left-- > 0;
         at.increment(error)) {
      if (mentions(at->path().filename().string(), code_)) return true;
    }
    return false;
  }

  void within(const fs::path& folder) {
    if (names_in(folder)) {
      found_.insert(folder.string());
      return;
    }
    std::error_code error;
    for (fs::recursive_directory_iterator at(folder, error), end; !error && at != end && goes_on();
         at.increment(error)) {
      if (leave_out_.contains(at->path())) {
        at.disable_recursion_pending();
      } else if (fs::is_regular_file(at->symlink_status(error))) {
        look_into(at->path());
      }
    }
  }

  void look_into(const fs::path& file) {
    const Holds holds = held_by(file);
    const bool of_the_study = file.filename().string().find(stem_) != std::string::npos;
    if (holds == Holds::yes || (holds == Holds::unknown && of_the_study))
      found_.insert(file.string());
  }

  Holds held_by(const fs::path& file) {
    std::error_code error;
    const std::uintmax_t size = fs::file_size(file, error);
    std::ifstream in(file, std::ios::binary);
    if (error || !in) return Holds::unknown;
    std::string begin(15, '\0');
    in.read(begin.data(), static_cast<std::streamsize>(begin.size()));
    begin.resize(static_cast<std::size_t>(in.gcount()));
    if (is_compressed(begin)) return Holds::unknown;
    const bool database = begin == "SQLite format 3";
    if (database) {
      const Holds holds = table_holds(file.string(), code_);
      if (holds != Holds::unknown) return holds;
    }
    if (size > kLargestText) return Holds::unknown;
    bytes_ += size;
    const std::string text = contents_of(file);
    // In a damaged database and in a log, a value stands beside others without a gap.
    const bool log = begin.starts_with("\x37\x7f\x06") || begin.starts_with("\xd9\xd5\x05\xf9");
    const bool holds =
        database || log ? text.find(code_) != std::string::npos : mentions(text, code_);
    return holds ? Holds::yes : Holds::no;
  }

  std::string code_, stem_;
  std::set<fs::path> leave_out_;
  std::set<std::string> found_;
  int left_ = kMostEntries;
  std::uintmax_t bytes_ = 0;
};

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
  Search search(code, database, std::move(leave_out));
  for (const fs::path& folder : folders) search.beside(folder);
  return search.found();
}

}  // namespace palpate::data
