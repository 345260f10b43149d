#pragma once
// Internal to data/: everything that belongs to a session, without keys and in an order of its own.
// What is compared is what is copied.

#include <SQLiteCpp/Database.h>

#include <array>
#include <cstdint>
#include <string>

namespace palpate::data {

/// The rows of one table that belong to the session with id ?1.
struct SessionRows {
  const char* table;
  std::string columns;  ///< all but keys, comma-separated
  /// SELECT kPlaces values that say what a row belongs to, then `columns`.
  std::string select;
};

/// Runs: which of the session (1, 2, ...), then the checksum of a protocol of its own, if any.
/// Notes and attempts: which run, then 0. Samples: the attempt's trial and number.
inline constexpr int kPlaces = 2;

/// runs, notes, attempts, samples: in this order they can be inserted.
std::array<SessionRows, 4> session_rows(SQLite::Database& db);

/// Whether two sessions hold the same, to the last bit.
bool same_session(SQLite::Database& db_a, std::int64_t id_a, SQLite::Database& db_b,
                  std::int64_t id_b);

/// Inserts a copy of a session. \param participant its participant's id in `to`.
/// \throws SQLite::Exception: rows of the session refer to what is not of the session.
void copy_session(SQLite::Database& from, std::int64_t id, SQLite::Database& to,
                  std::int64_t participant);

}  // namespace palpate::data
