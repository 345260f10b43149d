#include "data/store/open.h"

#include <SQLiteCpp/Statement.h>
#include <SQLiteCpp/Transaction.h>
#include <sqlite3.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <utility>

#include "data/errors.h"
#include "data/files/file_permissions.h"
#include "data/files/output_check.h"
#include "data/store/attempts.h"
#include "data/store/connection.h"
#include "data/store/protocol_rows.h"
#include "data/store/schema.h"
#include "data/store/statement.h"
#include "data/store/store_error.h"
#include "data/store/writer_lock.h"

namespace palpate::data {

void quick_check(SQLite::Database& db, const std::string& path, bool attempts_later) {
  for (const char* table :
       {"protocols", "participants", "sessions", "runs", "notes", "attempts", "exports",
        "export_participants", "tombstones", "tombstone_exports", "files", "protocol_files",
        "renumberings", "tombstone_secrets", "page_answers"}) {
    if (!db.tableExists(table)) continue;  // of a later schema version
    const bool skip_constraints = attempts_later && std::string_view(table) == "attempts";
    db.exec(skip_constraints ? "PRAGMA ignore_check_constraints = ON"
                             : "PRAGMA ignore_check_constraints = OFF");
    SQLite::Statement check(db, std::string("PRAGMA quick_check(") + table + ")");
    if (!check.executeStep()) continue;
    const std::string found = check.getColumn(0).getString();
    if (found != "ok") throw SQLite::Exception(table + (": " + found), SQLITE_CORRUPT);
  }
  db.exec("PRAGMA ignore_check_constraints = OFF");
  if (SQLite::Statement(db, "PRAGMA foreign_key_check").executeStep()) {
    throw StoreRefused(path +
                       ": is damaged: rows refer to rows that are missing; restore a backup");
  }
  if (!db.tableExists("attempts") || !db.tableExists("runs")) return;
  SQLite::Statement strays(db,
                           "SELECT r.session_id <> a.session_id FROM attempts a JOIN runs r ON "
                           "r.id = a.run_id WHERE r.session_id <> a.session_id OR a.state NOT IN "
                           "('running', 'completed', 'cut_off') LIMIT 1");
  if (strays.executeStep()) {
    throw StoreRefused(path + ": is damaged: an attempt is " +
                       (strays.getColumn(0).getInt() != 0
                            ? "of a run of another session"
                            : "neither running nor completed nor cut off") +
                       "; restore a backup");
  }
}

std::string immutable_uri(const std::string& file) {
  std::string uri = "file:";
  for (const char c : file) {
    if (c == '?' || c == '#' || c == '%') {
      constexpr const char* kDigits = "0123456789ABCDEF";
      uri += {'%', kDigits[c >> 4], kDigits[c & 15]};
    } else {
      uri += c;
    }
  }
  return uri + "?immutable=1";
}

void require_palpate_database(const std::string& file, const std::string& path) {
  SQLite::Database probe(immutable_uri(file), SQLITE_OPEN_READONLY | SQLITE_OPEN_URI);
  try {
    require_application_id(probe, path);
  } catch (const SQLite::Exception& error) {
    // Beside a writer, the size in the header may exceed the file; the checks after opening decide.
    if (error.getErrorCode() != SQLITE_CORRUPT) throw;
  }
}

void require_complete_pages(const std::string& file) {
  std::error_code error;
  const auto log = std::filesystem::file_size(file + "-wal", error);
  if (!error && log > 0) return;
  const auto size = std::filesystem::file_size(file, error);
  if (!error && size % kPageSize != 0) {
    throw SQLite::Exception(
        "it has " + std::to_string(size) + " bytes, which is not a whole number of pages",
        SQLITE_CORRUPT);
  }
}

// Store::open: checks the path, takes the writer's lock, creates or migrates the file, verifies its
// integrity, and marks the runs that a crashed process left open.
//
// SQLite settings of a writer: WAL journal mode, synchronous=FULL (a commit is synced to disk
// before it returns), foreign keys on. https://www.sqlite.org/wal.html,
// https://www.sqlite.org/pragma.html

namespace {

constexpr const char* kInterrupted = "interrupted: the program or the machine stopped";

constexpr int kBusyTimeoutMs = 5000;

/// This process is the only writer (WriterLock), so a run in state `running` belongs to a dead
/// process.
void mark_interrupted_runs(SQLite::Database& db, SealWriter& seals) {
  SQLite::Statement find(db, "SELECT 1 FROM runs WHERE end_reason = 'running' LIMIT 1");
  if (!find.executeStep()) return;
  find.reset();
  SQLite::Transaction transaction(db, SQLite::TransactionBehavior::IMMEDIATE);
  std::vector<std::int64_t> interrupted;
  SQLite::Statement all(db, "SELECT id FROM runs WHERE end_reason = 'running' ORDER BY id");
  while (all.executeStep()) interrupted.push_back(all.getColumn(0).getInt64());
  for (const std::int64_t id : interrupted) {
    cut_off_open_attempt(db, seals, {.id = id}, kInterrupted);
    SQLite::Statement end(db, "UPDATE runs SET end_reason = 'interrupted' WHERE id = ?");
    Binder(end) << id;
    end.exec();
    seals.end(id);
  }
  transaction.commit();
}

bool may_write(const std::string& file) {
  return ::access(file.c_str(), W_OK) == 0 &&
         ::access(std::filesystem::path(file).parent_path().c_str(), W_OK) == 0;
}

/// With write permission, a reader opens read-write and sets query_only: the last connection to
/// close a WAL database removes its -wal and -shm, which a read-only connection cannot. On a
/// read-only disk a file without a -wal is opened as immutable.
void open_for_reading(std::optional<SQLite::Database>& db, const std::string& file,
                      bool for_export) {
  if (may_write(file)) {
    const bool has_log = std::filesystem::exists(file + "-wal");
    db.emplace(file, kOpenWrite, kBusyTimeoutMs);
    // Under another name of the file there may be another log: leave both as they are. A log that
    // this opening creates is empty, and closing removes it.
    const bool one_name = names_of_file(file) <= 1;
    if (!one_name && has_log)
      sqlite3_db_config(db->getHandle(), SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
    if (for_export && one_name) db->tryExec("PRAGMA journal_mode = WAL");
    db->exec("PRAGMA query_only = ON");
  } else if (std::filesystem::exists(file + "-wal")) {
    db.emplace(file, kOpenRead, kBusyTimeoutMs);
  } else {
    db.emplace(immutable_uri(file), kOpenRead | SQLITE_OPEN_URI, kBusyTimeoutMs);
  }
}

}  // namespace

Store::Store(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}
Store::Store(Store&&) noexcept = default;
Store& Store::operator=(Store&&) noexcept = default;
Store::~Store() = default;

const std::string& Store::path() const { return impl_->path; }

void Store::Impl::require_usable_path() {
  namespace fs = std::filesystem;
  std::error_code error;
  file = fs::weakly_canonical(fs::absolute(path, error), error).string();
  if (path.empty() || error) throw StoreRefused("'" + path + "' is not a path of a database");
  // Reading follows links of other users; writing does not, because they could redirect it.
  if (writes()) {
    require_name(path);
    const ResolvedPath resolved = resolve_trusted_links(path);
    if (!resolved.fault.empty()) refuse(resolved.fault);
    file = resolved.path;
  }
  const fs::file_status status = fs::status(file, error);
  if (fs::exists(status) && !fs::is_regular_file(status)) refuse("is not a file; name a file");
  if (!writes() && !fs::exists(status)) {
    refuse("there is no such file (or its folder may not be read)");
  }
}

void Store::Impl::create_if_absent() {
  namespace fs = std::filesystem;
  if (fs::exists(file)) return;
  if (belongs_to_database(file)) {
    refuse("is the name of a file that belongs to another database; name another file");
  }
  // SQLite would roll the old -wal or -journal into the new file.
  for (const char* suffix : {"-wal", "-journal"}) {
    if (!fs::exists(file + suffix)) continue;
    refuse("is missing, but its log " + file + suffix +
           " exists and may hold trials; put the database back beside it, or move the log away to "
           "create a new one");
  }
  create_database(file);
}

void Store::Impl::connect() {
  require_palpate_database(file, path);
  require_complete_pages(file);
  if (writes()) {
    db.emplace(file, kOpenWrite, kBusyTimeoutMs);
  } else {
    open_for_reading(db, file, mode == Mode::read_for_export);
  }
  db->exec("PRAGMA trusted_schema = OFF; PRAGMA cell_size_check = ON");
  if (!writes()) db->exec("BEGIN");  // one snapshot for as long as the store is open
  version = checked_version(*db, path);
  verify_schema(*db, path, version);
}

void Store::Impl::prepare_for_writing() {
  if (sqlite3_db_readonly(db->getHandle(), "main") == 1) {
    throw StoreError(path + ": cannot be written; check its permissions");
  }
  if (version < kSchemaVersion) {
    migrate(*db, file, version, kSchemaVersion, migrations());
    version = kSchemaVersion;
  }
  if (db->execAndGet("PRAGMA journal_mode = WAL").getString() != "wal") {
    throw StoreError(path +
                     ": this disk does not support a write-ahead log; keep the database on "
                     "a local disk");
  }
  db->exec("PRAGMA synchronous = FULL; PRAGMA foreign_keys = ON");
}

Store Store::open(const std::string& path, Mode mode) {
  auto impl = std::make_unique<Impl>();
  impl->path = path;
  impl->mode = mode;
  impl->require_usable_path();
  const std::string& file = impl->file;
  const bool writes = impl->writes();
  if (writes) {
    impl->lock.emplace(file);
    impl->create_if_absent();
    impl->lock->lock_database();  // of a new file
    require_one_name(file, path);
  }
  if (mode == Mode::read_for_export) require_no_writer_by_another_name(file, path);
  std::error_code error;
  if (std::filesystem::file_size(file, error) == 0 && !error) {
    impl->refuse(
        "is empty; a palpate database is never empty. Restore a backup, or remove the file to "
        "create a "
        "new one");
  }
  require_private_sqlite_files(file);
  guarded(path, [&] {
    impl->connect();
    if (writes) impl->prepare_for_writing();
    quick_check(*impl->db, path, !writes);
    verify_protocol_checksums(*impl->db, path, impl->version);
    require_private_sqlite_files(file);  // again: by now SQLite has created or opened them
    if (writes) mark_interrupted_runs(*impl->db, impl->seals.emplace(*impl->db));
  });
  impl->identity = identity_of(file);
  impl->repair_wal_index();
  return Store(std::move(impl));
}

}  // namespace palpate::data
