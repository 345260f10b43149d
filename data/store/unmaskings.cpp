#include "data/store/unmaskings.h"

#include "data/store/late_table.h"
#include "data/store/statement.h"

namespace palpate::data {
namespace {

constexpr LateTable kUnmaskings{
    "unmaskings",
    "CREATE TABLE unmaskings (utc_ns INTEGER NOT NULL, person TEXT NOT NULL, program_version TEXT "
    "NOT NULL, participants INTEGER NOT NULL CHECK (participants >= 0), PRIMARY KEY (utc_ns, "
    "person)) STRICT, WITHOUT ROWID"};

}  // namespace

std::vector<Unmasking> read_unmaskings(SQLite::Database& db, const std::string& path) {
  std::vector<Unmasking> out;
  if (!kUnmaskings.is_in(db, path)) return out;
  SQLite::Statement find(db,
                         "SELECT utc_ns, person, program_version, participants FROM unmaskings "
                         "ORDER BY utc_ns, person");
  while (find.executeStep()) {
    Unmasking& one = out.emplace_back();
    RowReader(find) >> one.utc_ns >> one.person >> one.program_version >> one.participants;
  }
  return out;
}

void write_unmasking(SQLite::Database& db, const std::string& path, const Unmasking& one) {
  if (!kUnmaskings.is_in(db, path)) db.exec(kUnmaskings.sql);
  SQLite::Statement add(db, "INSERT OR IGNORE INTO unmaskings VALUES (?, ?, ?, ?)");
  Binder(add) << one.utc_ns << one.person << one.program_version << one.participants;
  add.exec();
}

}  // namespace palpate::data
