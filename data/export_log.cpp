#include "data/export_log.h"

#include <SQLiteCpp/Transaction.h>
#include <sqlite3.h>

#include <filesystem>

#include "data/schema.h"
#include "data/store_impl.h"

namespace palpate {
namespace {

constexpr int kBusyTimeoutMs = 5000;

}  // namespace

void log_export(const std::string& database, const ExportRecord& made,
                const std::vector<std::int64_t>& participants) {
  const std::string file = std::filesystem::weakly_canonical(database).string();
  guarded(database, [&] {
    std::optional<SQLite::Database> db;
    db.emplace(file, SQLite::OPEN_READWRITE, kBusyTimeoutMs);
    if (checked_version(*db, database) < kSchemaVersion) {
      db.reset();
      Store::open(database, Store::Mode::write_or_create);
      db.emplace(file, SQLite::OPEN_READWRITE, kBusyTimeoutMs);
    }
    db->exec("PRAGMA trusted_schema = OFF; PRAGMA synchronous = FULL; PRAGMA secure_delete = ON");
    SQLite::Transaction transaction(*db, SQLite::TransactionBehavior::IMMEDIATE);
    for (const char* sql :
         {"DELETE FROM export_participants WHERE export_id = (SELECT id FROM exports WHERE path = "
          "?)",
          "DELETE FROM tombstone_exports WHERE export_id = (SELECT id FROM exports WHERE path = ?)",
          "DELETE FROM exports WHERE path = ?"}) {
      SQLite::Statement remove(*db, sql);
      Binder(remove) << made.path;
      remove.exec();
    }
    SQLite::Statement add(*db, "INSERT INTO exports (path, format, made_utc_ns) VALUES (?, ?, ?)");
    Binder(add) << made.path << made.format << made.made_utc_ns;
    add.exec();
    const std::int64_t id = db->getLastInsertRowid();
    SQLite::Statement holds(*db,
                            "INSERT INTO export_participants SELECT ?, id FROM participants WHERE "
                            "id = ?");
    for (const std::int64_t participant : participants) {
      holds.reset();
      Binder(holds) << id << participant;
      if (holds.exec() != 1) {
        throw StoreRefused(database +
                           ": a participant was withdrawn while the export was made; nothing was "
                           "exported, start it again");
      }
    }
    transaction.commit();
  });
}

}  // namespace palpate
