// Opening a store: which files are taken, by whom, and what a dead process left behind.

#include <SQLiteCpp/Transaction.h>
#include <sqlite3.h>
#include <sys/stat.h>
#include <unistd.h>

#include <filesystem>
#include <utility>

#include "data/files/file_identity.h"
#include "data/files/file_permissions.h"
#include "data/files/output_check.h"
#include "data/files/trusted_links.h"
#include "data/store/attempts.h"
#include "data/store/connection.h"
#include "data/store/integrity_checks.h"
#include "data/store/protocol_rows.h"
#include "data/store/schema.h"
#include "data/store/sqlite_errors.h"
#include "data/store/statement_values.h"

namespace palpate::data {
namespace {

constexpr const char* kInterrupted = "interrupted: the program or the machine stopped";

constexpr int kBusyTimeoutMs = 5000;
// A store belongs to one thread at a time: SQLite need not lock every look at a column.
constexpr int kOpenRead = SQLITE_OPEN_READONLY | SQLITE_OPEN_NOMUTEX;
constexpr int kOpenWrite = SQLITE_OPEN_READWRITE | SQLITE_OPEN_NOMUTEX;

/// The one writer is us: whatever else is still running in the file is dead.
void mark_interrupted_runs(SQLite::Database& db, SealWriter& seals) {
  SQLite::Statement find(db, "SELECT 1 FROM runs WHERE end_reason = 'running' LIMIT 1");
  if (!find.executeStep()) return;
  find.reset();
  SQLite::Transaction transaction(db, SQLite::TransactionBehavior::IMMEDIATE);
  std::vector<std::int64_t> dead;
  SQLite::Statement all(db, "SELECT id FROM runs WHERE end_reason = 'running' ORDER BY id");
  while (all.executeStep()) dead.push_back(all.getColumn(0).getInt64());
  for (const std::int64_t id : dead) {
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

/// A reader that may write opens the file so as to leave nothing behind: the last one to close a
/// write-ahead log removes it. On a read-only disk a file without a log is taken as it is.
void open_for_reading(std::optional<SQLite::Database>& db, const std::string& file) {
  if (may_write(file)) {
    db.emplace(file, kOpenWrite, kBusyTimeoutMs);
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

Store Store::open(const std::string& path, Mode mode) {
  namespace fs = std::filesystem;
  auto impl = std::make_unique<Impl>();
  impl->path = path;
  impl->mode = mode;
  std::error_code error;
  impl->file = fs::weakly_canonical(fs::absolute(path, error), error).string();
  if (path.empty() || error) throw StoreRefused("'" + path + "' is no path of a database");
  const bool writes = mode == Mode::write_or_create;
  // A colleague's links may be read through; what is written goes nowhere that others choose.
  const std::string fault = writes ? resolve_trusted_links(path).fault : "";
  if (!fault.empty()) impl->refuse(fault);
  const fs::file_status status = fs::status(impl->file, error);
  if (fs::exists(status) && !fs::is_regular_file(status)) {
    impl->refuse("is not a file; name a file");
  }
  if (!writes && !fs::exists(status)) {
    impl->refuse("there is no such file (or its folder may not be read)");
  }
  if (writes) {
    impl->lock.emplace(impl->file);
    if (!fs::exists(impl->file)) {
      if (belongs_to_database(impl->file)) {
        impl->refuse("is a name of what lies beside a database; name another file");
      }
      // SQLite would play the left-over log into the new file.
      for (const char* end : {"-wal", "-journal"}) {
        if (!fs::exists(impl->file + end)) continue;
        impl->refuse("is gone but its log " + impl->file + end +
                     " is there and may hold trials; put the database back beside it, or move "
                     "the log away to begin a new one");
      }
      create_database(impl->file);
    }
  }
  if (fs::file_size(impl->file, error) == 0 && !error) {
    impl->refuse(
        "is empty, which a palpate database never is; restore a backup, or remove it to begin a "
        "new one");
  }
  require_private_sqlite_files(impl->file);
  guarded(path, [&] {
    require_palpate_database(impl->file, path);
    require_complete_pages(impl->file);
    if (writes) {
      impl->db.emplace(impl->file, kOpenWrite, kBusyTimeoutMs);
    } else {
      open_for_reading(impl->db, impl->file);
    }
    SQLite::Database& db = *impl->db;
    db.exec("PRAGMA trusted_schema = OFF; PRAGMA cell_size_check = ON");
    if (!writes) db.exec("BEGIN");
    impl->version = checked_version(db, path);
    verify_schema(db, path, impl->version);
    if (writes) {
      if (sqlite3_db_readonly(db.getHandle(), "main") == 1) {
        throw StoreError(path + ": may not be written; check its permissions");
      }
      if (impl->version < kSchemaVersion) {
        migrate(db, impl->file, impl->version, kSchemaVersion, migrations());
        impl->version = kSchemaVersion;
      }
      if (db.execAndGet("PRAGMA journal_mode = WAL").getString() != "wal") {
        throw StoreError(
            path +
            ": this disk does not allow a write-ahead log; keep the database on a local disk");
      }
      db.exec("PRAGMA synchronous = FULL; PRAGMA foreign_keys = ON");
    }
    quick_check(db, path, !writes);
    verify_protocol_checksums(db, path, impl->version);
    require_private_sqlite_files(impl->file);  // SQLite has made them, or found others' by now
    if (writes) mark_interrupted_runs(db, impl->seals.emplace(db));
  });
  impl->identity = identity_of(impl->file);
  impl->repair_wal_index();
  return Store(std::move(impl));
}

}  // namespace palpate::data
