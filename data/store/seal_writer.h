#pragma once
// Internal to data/: seals rows as they are written.

#include <SQLiteCpp/Database.h>
#include <SQLiteCpp/Statement.h>

#include <cstdint>
#include <map>
#include <optional>

#include "data/store/seals.h"

namespace palpate::data {

/// Each call reads a row back as it is stored, and seals it as the next of its session. To be
/// called within the transaction that wrote the row; when that fails, or sessions are removed, call
/// reset_chains: what it knows of the sessions may be wrong.
class SealWriter {
 public:
  explicit SealWriter(SQLite::Database& db) : db_(db) {}

  void run(std::int64_t id);  ///< that begins
  void note(std::int64_t id);
  void attempt(std::int64_t id);  ///< that is over
  void end(std::int64_t run_id);  ///< of a run
  void reset_chains() { last_.clear(); }

  /// What a palpate without seals has recorded, as it is found.
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
