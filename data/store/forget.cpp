#include "data/store/forget.h"

#include <SQLiteCpp/Database.h>
#include <SQLiteCpp/Statement.h>
#include <crypt.h>
#include <nettle/hmac.h>
#include <sqlite3.h>
#include <sys/random.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include "data/base/checksum.h"
#include "data/errors.h"
#include "data/files/atomic_file.h"
#include "data/files/file_permissions.h"
#include "data/store/connection.h"
#include "data/store/frames.h"
#include "data/store/open.h"
#include "data/store/record_columns.h"
#include "data/store/statement.h"
#include "data/store/store_error.h"

namespace palpate::data {
namespace {

// yescrypt with this cost takes some 5 ms. A hash with another cost is refused: a forged one could
// take days to compute.
constexpr const char* kPrefix = "$y$";
constexpr unsigned long kCost = 3;

std::string new_salt() {
  std::array<char, CRYPT_GENSALT_OUTPUT_SIZE> text{};
  if (::crypt_gensalt_rn(kPrefix, kCost, nullptr, 0, text.data(), text.size()) == nullptr) {
    throw StoreError("cannot make a salt: the system provides no random numbers");
  }
  return text.data();
}

/// "$y$COST$SALT" of a salt or of a whole hash.
std::string salt_of(const std::string& hash) {
  std::size_t end = 0;
  for (int dollars = 0; end < hash.size() && dollars < 4; ++end) dollars += hash[end] == '$';
  return hash.substr(0, end < hash.size() ? end - 1 : hash.size());
}

std::string cost_of(const std::string& salt) { return salt.substr(0, salt.rfind('$')); }

std::string hash_with(const std::string& code, const std::string& salt) {
  const auto work = std::make_unique<crypt_data>();
  const char* hash = ::crypt_r(code.c_str(), salt.c_str(), work.get());
  if (hash == nullptr || hash[0] == '*') throw StoreError("cannot hash a participant code");
  return hash;
}

std::string new_secret() {
  std::string secret(32, '\0');
  if (::getrandom(secret.data(), secret.size(), 0) != static_cast<ssize_t>(secret.size())) {
    throw StoreError("cannot make a secret: the system provides no random numbers");
  }
  return secret;
}

/// The input of crypt(): HMAC-SHA256 as 64 digits.
std::string keyed(const std::string& code, const std::string& secret) {
  if (secret.empty()) return code;
  hmac_sha256_ctx context;
  hmac_sha256_set_key(&context, secret.size(),
                      reinterpret_cast<const unsigned char*>(secret.data()));
  hmac_sha256_update(&context, code.size(), reinterpret_cast<const unsigned char*>(code.data()));
  Checksum sum;
  hmac_sha256_digest(&context, sum.size(), sum.data());
  return to_hex(sum);
}

namespace fs = std::filesystem;

constexpr std::uintmax_t kLargestText = std::uintmax_t{1} << 28U;  // bytes
constexpr std::uintmax_t kMostBytes = std::uintmax_t{8} << 30U;    // of all texts
constexpr int kMostEntries = 100'000;

enum class Holds { no, yes, unknown };

std::string contents_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// Whether the tables of a palpate database hold the code.
Holds table_holds(const std::string& file, const std::string& code) {
  try {
    SQLite::Database db(immutable_uri(file), SQLite::OPEN_READONLY | SQLite::OPEN_URI);
    SQLite::Statement find(db, "SELECT 1 FROM participants WHERE code = ?");
    find.bind(1, code);
    return find.executeStep() ? Holds::yes : Holds::no;
  } catch (const SQLite::Exception&) {
    return Holds::unknown;  // another program's, or damaged
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
  /// \param database  its file name, which the names of copies contain
  Search(std::string code, const fs::path& database, std::set<fs::path> leave_out)
      : code_(std::move(code)), stem_(database.stem().string()), leave_out_(std::move(leave_out)) {}

  void beside(const fs::path& folder) {
    std::error_code error;
    for (fs::directory_iterator at(folder, error), end; !error && at != end && may_continue();
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
  bool may_continue() { return left_ > 0 && left_-- > 0 && bytes_ < kMostBytes; }

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
    for (fs::recursive_directory_iterator at(folder, error), end;
         !error && at != end && may_continue(); at.increment(error)) {
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
    // In a damaged database and in a log, values follow each other without a gap.
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

constexpr const char* kParticipantIds = "(SELECT id FROM participants WHERE code = ?)";

std::int64_t count_rows(SQLite::Database& db, const std::string& sql, const std::string& code) {
  SQLite::Statement find(db, "SELECT count(*) FROM " + sql);
  Binder(find) << code;
  find.executeStep();
  return find.getColumn(0).getInt64();
}

std::string attempt_ids() {
  return std::string(
             "(SELECT a.id FROM attempts a JOIN sessions s ON s.id = a.session_id WHERE "
             "s.participant_id IN ") +
         kParticipantIds + ")";
}

std::string session_ids() {
  return std::string("(SELECT id FROM sessions WHERE participant_id IN ") + kParticipantIds + ")";
}

void delete_rows(SQLite::Database& db, const std::string& code) {
  const std::string sessions = session_ids();
  if (has_frames(db, db.getFilename())) {
    SQLite::Statement remove(db, "DELETE FROM frames WHERE attempt_id IN " + attempt_ids());
    Binder(remove) << code;
    remove.exec();
  }
  for (const std::string& what :
       {"samples WHERE attempt_id IN " + attempt_ids(), "attempts WHERE session_id IN " + sessions,
        "notes WHERE run_id IN (SELECT id FROM runs WHERE session_id IN " + sessions + ")",
        "page_answers WHERE run_id IN (SELECT id FROM runs WHERE session_id IN " + sessions + ")",
        "runs WHERE session_id IN " + sessions,
        std::string("sessions WHERE participant_id IN ") + kParticipantIds,
        std::string("export_participants WHERE participant_id IN ") + kParticipantIds,
        std::string("renumberings WHERE participant_id IN ") + kParticipantIds,
        std::string("participants WHERE code = ?")}) {
    SQLite::Statement remove(db, "DELETE FROM " + what);
    Binder(remove) << code;
    remove.exec();
  }
}

/// Replaces the code in paths of exports by "...", unless it is short and part of another word ("1"
/// occurs in many paths).
void redact_export_paths(SQLite::Database& db, const std::string& code) {
  constexpr std::size_t kUnmistakable = 6;  // characters
  SQLite::Statement find(db, "SELECT id, path FROM exports WHERE instr(path, ?)");
  Binder(find) << code;
  std::vector<std::pair<std::int64_t, std::string>> redacted;
  while (find.executeStep()) {
    std::string path = find.getColumn(1).getString();
    if (code.size() < kUnmistakable && !mentions(path, code)) continue;
    for (std::size_t at = 0; (at = path.find(code)) != std::string::npos;) {
      path.replace(at, code.size(), "...");
    }
    redacted.emplace_back(find.getColumn(0).getInt64(), path);
  }
  SQLite::Statement rename(db, "UPDATE exports SET path = ? WHERE id = ?");
  for (const auto& [id, path] : redacted) {
    rename.reset();
    Binder(rename) << path + " (export " + std::to_string(id) + ")" << id;
    rename.exec();
  }
}

std::vector<ExportRecord> read_exports(SQLite::Statement& find) {
  std::vector<ExportRecord> all;
  while (find.executeStep()) {
    ExportRecord& one = all.emplace_back();
    RowReader(find) >> one.path >> one.format >> one.made_utc_ns;
  }
  return all;
}

/// Backups of migrations: FILE.v<N>[-<I>].backup.
std::vector<std::string> backups_of(const std::string& file) {
  const fs::path path(file);
  const std::string begin = path.filename().string() + ".v", end = ".backup";
  std::vector<std::string> all;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(path.parent_path(), error)) {
    const std::string name = entry.path().filename().string();
    if (name.starts_with(begin) && name.ends_with(end)) all.push_back(entry.path().string());
  }
  std::sort(all.begin(), all.end());
  return all;
}

enum class BackupContent { other_participants, participant, unreadable };

BackupContent inspect_backup(const std::string& backup, const std::string& code) {
  try {
    require_private_sqlite_files(backup);
    SQLite::Database db(backup, SQLite::OPEN_READONLY);
    return count_rows(db, "participants WHERE code = ?", code) > 0
               ? BackupContent::participant
               : BackupContent::other_participants;
  } catch (const SQLite::Exception&) {
    return BackupContent::unreadable;
  } catch (const StoreRefused&) {
    return BackupContent::unreadable;
  }
}

/// Deletes the backups that hold the participant.
Withdrawal remove_backups(const std::string& file, const std::string& code) {
  Withdrawal done;
  for (const std::string& backup : backups_of(file)) {
    const BackupContent content = inspect_backup(backup, code);
    if (content == BackupContent::other_participants) continue;
    if (content == BackupContent::participant) {
      for (const char* suffix : {"", "-journal", "-wal", "-shm"}) {
        ::unlink((backup + suffix).c_str());
      }
    }
    const bool removed = content == BackupContent::participant && !fs::exists(backup);
    (removed ? done.backups_removed : done.backups_left).push_back(backup);
  }
  return done;
}

/// Exports that hold the code, also those made before a withdrawal. \param hash of its tombstone,
/// or ""
std::vector<ExportRecord> exports_of(SQLite::Database& db, const std::string& code,
                                     const std::string& hash) {
  SQLite::Statement exports(
      db,
      "SELECT path, format, made_utc_ns FROM exports WHERE id IN (SELECT export_id FROM "
      "export_participants e JOIN participants p ON p.id = e.participant_id WHERE p.code = ? "
      "UNION "
      "SELECT export_id FROM tombstone_exports e JOIN tombstones t ON t.id = e.tombstone_id "
      "WHERE t.code_hash = ?) ORDER BY made_utc_ns, path");
  Binder(exports) << code << hash;
  return read_exports(exports);
}

/// The number of notes on other participants that mention the code.
std::int64_t notes_that_mention(SQLite::Database& db, const std::string& code) {
  SQLite::Statement notes(
      db,
      "SELECT n.text FROM notes n JOIN runs r ON r.id = n.run_id JOIN sessions s ON s.id = "
      "r.session_id JOIN participants p ON p.id = s.participant_id WHERE p.code <> ?1 AND "
      "instr(n.text, ?1)");
  Binder(notes) << code;
  std::int64_t found = 0;
  while (notes.executeStep()) found += mentions(notes.getColumn(0).getString(), code) ? 1 : 0;
  return found;
}

/// Files that hold or may hold `code`, beside the database, beside its exports and in folders
/// there:
///
/// * other palpate databases, whatever their names, with their logs;
/// * texts (tables, reports, figures) with the code in their name or content;
/// * files named after the database that cannot be searched (compressed, not readable, above
///   256 MiB).
///
/// A folder with the code in the name of a file in it, as in a dataset, is named as a whole. Leaves
/// out the database and its -wal, -shm, -journal, and `known`. Follows no links. Stops after
/// 100,000 entries or 8 GiB and names the folder that it had reached.
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

}  // namespace

Tombstones Tombstones::read(SQLite::Database& db, const std::string& path) {
  Tombstones all;
  const std::string cost = cost_of(new_salt());
  SQLite::Statement find(db,
                         "SELECT t.code_hash, s.secret FROM tombstones t LEFT JOIN "
                         "tombstone_secrets s ON s.id = t.secret_id");
  while (find.executeStep()) {
    std::string hash;
    std::optional<std::string> secret;
    RowReader(find) >> hash >> secret;
    const std::string salt = salt_of(hash);
    const bool clean = std::all_of(hash.begin(), hash.end(), [](char c) {
      return (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') ||
             c == '$' || c == '.' || c == '/';
    });
    if (!clean || cost_of(salt) != cost || salt.size() == hash.size() || hash.size() > 200) {
      throw StoreRefused(path + ": holds a tombstone that palpate did not make; restore a backup");
    }
    all.by_key_[{secret.value_or(""), salt}].push_back(hash);
  }
  return all;
}

Tombstones::Tombstone Tombstones::find(const std::string& code) const {
  for (const auto& [key, hashes] : by_key_) {
    std::string hash = hash_with(keyed(code, key.secret), key.salt);
    if (std::find(hashes.begin(), hashes.end(), hash) != hashes.end()) return {hash, key.secret};
  }
  return {};
}

Tombstones::Tombstone Tombstones::made_for(const std::string& code) const {
  const auto known = std::find_if(by_key_.begin(), by_key_.end(),
                                  [](const auto& one) { return !one.first.secret.empty(); });
  const Key key = known != by_key_.end() ? known->first : Key{new_secret(), new_salt()};
  return {hash_with(keyed(code, key.secret), key.salt), key.secret};
}

void Tombstones::put(SQLite::Database& db, const Tombstone& tombstone, bool cleared) {
  std::optional<std::int64_t> secret;
  if (!tombstone.secret.empty()) {
    const auto bind = [&](SQLite::Statement& statement) {
      statement.bind(1, static_cast<const void*>(tombstone.secret.data()),
                     static_cast<int>(tombstone.secret.size()));
    };
    SQLite::Statement keep(
        db, "INSERT INTO tombstone_secrets (secret) VALUES (?) ON CONFLICT DO NOTHING");
    bind(keep);
    keep.exec();
    SQLite::Statement find(db, "SELECT id FROM tombstone_secrets WHERE secret = ?");
    bind(find);
    find.executeStep();
    secret = find.getColumn(0).getInt64();
  }
  SQLite::Statement add(db,
                        "INSERT INTO tombstones (code_hash, secret_id, cleared) VALUES (?, ?, ?) "
                        "ON CONFLICT (code_hash) DO UPDATE SET cleared = excluded.cleared, "
                        "secret_id = excluded.secret_id");
  Binder(add) << tombstone.hash << secret << cleared;
  add.exec();
}

void Tombstones::add(const Tombstones& others) {
  for (const auto& [key, hashes] : others.by_key_) {
    auto& mine = by_key_[key];
    for (const auto& hash : hashes) {
      if (std::find(mine.begin(), mine.end(), hash) == mine.end()) mine.push_back(hash);
    }
  }
}

std::vector<Tombstones::Tombstone> Tombstones::all() const {
  std::vector<Tombstone> all;
  for (const auto& [key, hashes] : by_key_) {
    for (const auto& hash : hashes) all.push_back({hash, key.secret});
  }
  std::sort(all.begin(), all.end(), [](const auto& a, const auto& b) { return a.hash < b.hash; });
  return all;
}

bool mentions(const std::string& text, const std::string& code) {
  for (std::size_t at = text.find(code); at != std::string::npos; at = text.find(code, at + 1)) {
    const bool begins = at == 0 || !is_participant_code(text.substr(at - 1, 1));
    const std::size_t end = at + code.size();
    if (begins && (end == text.size() || !is_participant_code(text.substr(end, 1)))) return true;
  }
  return false;
}

// Withdrawal: removes every byte of a participant from the database, its -wal and its backups, and
// leaves a tombstone (forget.h). Order: one transaction deletes the rows (PRAGMA secure_delete
// overwrites them with zeros) and inserts the tombstone; then a checkpoint truncates the -wal, and
// VACUUM rebuilds the file; then backups are deleted; last, the tombstone is marked `cleared`.
// After a crash at any point the same call finishes the rest.

ParticipantSummary Store::participant_summary(const std::string& code) {
  return guarded(impl_->path, [&] {
    SQLite::Database& db = *impl_->db;
    ParticipantSummary found;
    const std::string hash = Tombstones::read(db, impl_->path).find(code).hash;
    found.withdrawn_before = !hash.empty();
    found.protocols = count_rows(db, "participants WHERE code = ?", code);
    found.sessions =
        count_rows(db, std::string("sessions WHERE participant_id IN ") + kParticipantIds, code);
    found.trials = count_rows(
        db, "attempts WHERE state = 'completed' AND session_id IN " + session_ids(), code);
    found.cut_off = count_rows(
        db, "attempts WHERE state <> 'completed' AND session_id IN " + session_ids(), code);
    found.exports = exports_of(db, code, hash);
    found.mentions = notes_that_mention(db, code);
    std::vector<std::string> known = backups_of(impl_->file);
    for (const ExportRecord& one : found.exports) {
      const std::string location = export_location(impl_->file, one.path);
      if (!location.empty()) known.push_back(location);
    }
    found.remaining_copies = find_remaining_copies(impl_->file, code, known);
    return found;
  });
}

void Store::Impl::replace_by_tombstone(const std::string& code,
                                       const Tombstones::Tombstone& tombstone,
                                       const std::string& earlier_hash) {
  if (!earlier_hash.empty() && earlier_hash != tombstone.hash) {
    SQLite::Statement rehash(*db, "UPDATE tombstones SET code_hash = ? WHERE code_hash = ?");
    Binder(rehash) << tombstone.hash << earlier_hash;
    rehash.exec();
  }
  Tombstones::put(*db, tombstone, false);
  SQLite::Statement exports(
      *db,
      "INSERT OR IGNORE INTO tombstone_exports SELECT t.id, e.export_id FROM tombstones t, "
      "export_participants e JOIN participants p ON p.id = e.participant_id WHERE t.code_hash = "
      "? AND p.code = ?");
  Binder(exports) << tombstone.hash << code;
  exports.exec();
  delete_rows(*db, code);
  seals->reset_chains();
  redact_export_paths(*db, code);
}

Withdrawal Store::forget(const std::string& code) {
  if (!is_participant_code(code)) impl_->refuse("'" + code + "' is not a participant code");
  impl_->require_writer();
  SQLite::Database& db = *impl_->db;
  const Tombstones tombstones = guarded(impl_->path, [&] {
    db.exec("PRAGMA secure_delete = ON");
    return Tombstones::read(db, impl_->path);
  });
  Tombstones::Tombstone tombstone = tombstones.find(code);
  const std::string earlier_hash = tombstone.hash;
  if (earlier_hash.empty() && participant_summary(code).protocols == 0) {
    impl_->refuse("there is no participant " + code);
  }
  // Remake a tombstone of schema version 2, which has no secret, now that the code is known.
  if (tombstone.secret.empty()) tombstone = tombstones.made_for(code);
  impl_->commit([&] {
    impl_->replace_by_tombstone(code, tombstone, earlier_hash);
    return true;
  });
  impl_->purge_deleted_rows();
  Withdrawal done = remove_backups(impl_->file, code);
  // Temporary files of exports that were killed may hold the participant.
  remove_stale_temporaries_in(fs::path(impl_->file).parent_path());
  if (done.backups_left.empty()) {
    impl_->commit([&] {
      SQLite::Statement cleared(db, "UPDATE tombstones SET cleared = 1 WHERE code_hash = ?");
      Binder(cleared) << tombstone.hash;
      cleared.exec();
      return true;
    });
  }
  return done;
}

void Store::Impl::purge_deleted_rows() {
  const auto truncate_wal = [&] {
    SQLite::Statement checkpoint(*db, "PRAGMA wal_checkpoint(TRUNCATE)");
    checkpoint.executeStep();
    if (checkpoint.getColumn(0).getInt() != 0) {
      throw StoreError(path +
                       ": the rows are removed, but the log still holds them while another program "
                       "reads the database; close it, then give the same command again");
    }
  };
  guarded(path, [&] {
    truncate_wal();
    // VACUUM writes a copy: beside the database, not into the system's temporary folder.
    const std::string folder = fs::path(file).parent_path().string();
    SQLite::Statement set_folder(*db, "SELECT 'PRAGMA temp_store_directory = ' || quote(?)");
    Binder(set_folder) << folder;
    set_folder.executeStep();
    db->exec(set_folder.getColumn(0).getString());
    set_folder.reset();
    db->exec("VACUUM");
    db->exec("PRAGMA temp_store_directory = ''");
    truncate_wal();
  });
}

}  // namespace palpate::data
