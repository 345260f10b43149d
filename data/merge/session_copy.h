#pragma once
// Internal to data/merge: compares and copies sessions between databases. Row ids differ between
// databases: rows are compared and copied without keys, in an order of their own.

#include <SQLiteCpp/Database.h>

#include <array>
#include <cstdint>
#include <string>

namespace palpate::data {

/// The rows of one table that belong to the session with id ?1.
struct SessionRows {
  const char* table;
  std::string columns;  ///< all but keys, comma-separated
  /// SELECT of kParentColumns values that identify the parent row, then `columns`.
  std::string select;
};

/// Runs: position in the session (1, 2, ...), checksum of a protocol of its own or NULL. Notes,
/// attempts and answers to pages: position of their run, 0. Samples: trial and number of their
/// attempt.
inline constexpr int kParentColumns = 2;

/// runs, notes, attempts, samples, page_answers: in the order of insertion that foreign keys need.
std::array<SessionRows, 5> session_rows(SQLite::Database& db);

/// Whether two sessions are identical to the bit.
bool same_session(SQLite::Database& db_a, std::int64_t id_a, SQLite::Database& db_b,
                  std::int64_t id_b);

/// Inserts a copy of a session. \param participant its participant's id in `to`.
/// \throws SQLite::Exception: rows of the session refer to another session.
void copy_session(SQLite::Database& from, std::int64_t id, SQLite::Database& to,
                  std::int64_t participant);

}  // namespace palpate::data
