#pragma once
// Internal to data/store: seals rows (seals.h) in the transaction that writes them.

#include <SQLiteCpp/Database.h>
#include <SQLiteCpp/Statement.h>

#include <cstdint>
#include <map>
#include <optional>

#include "data/store/seals.h"

namespace palpate::data {

/// Each call reads back the row as it was stored and seals it as the next of its session. Caches
/// the last link of every session: call reset_chains() after a rollback and after deleting
/// sessions.
class SealWriter {
 public:
  explicit SealWriter(SQLite::Database& db) : db_(db) {}

  void run(std::int64_t id);  ///< when it begins
  void note(std::int64_t id);
  void attempt(std::int64_t id);  ///< when it has ended
  void end(std::int64_t run_id);  ///< of a run
  void page_answer(std::int64_t id);
  void reset_chains() { last_.clear(); }

  /// Seals all rows of a database that an earlier schema version wrote without seals.
  void seal_existing_rows();

 private:
  const Link& last_of(std::int64_t session);
  void seal(const char* update, std::int64_t session, std::int64_t id);
  SQLite::Database& db_;
  std::optional<SQLite::Statement> find_attempt_, seal_attempt_;
  SealedValues values_;
  std::map<std::int64_t, Link> last_;  // by session
};

}  // namespace palpate::data
