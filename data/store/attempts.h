#pragma once
// Internal to data/: reads and verifies attempts one at a time, and ends an attempt that a run left
// open.

#include <SQLiteCpp/Database.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "data/store/seals.h"
#include "data/store/store.h"

namespace palpate::data {

// Reads attempts in order and verifies them: every session visited against its hash chain
// (seals.h), every value against the range that palpate writes. Store, and StationDatabase for
// merge, read trials through this only.

enum class AttemptState { running, completed, cut_off };

enum class SampleReading {
  skip,
  verify,  ///< against their checksum
  unpack,  ///< verify, then decode into TrialRecord::samples
};

/// Which attempts are visited. Their sessions are verified as a whole.
struct AttemptFilter {
  std::optional<AttemptState> state = {};                    ///< none: completed and cut off
  const TrialName* trial = nullptr;                          ///< this one, in every protocol
  std::optional<std::pair<std::int64_t, int>> session = {};  ///< participant's id, number
  SampleReading samples = SampleReading::skip;
  /// Selects the completed trials whose samples are read, called in order; none: all.
  const std::function<bool(const StoredTrial&)>* samples_wanted = nullptr;
  bool seals_verified = false;  ///< they are verified already, in the same snapshot of the database
};

/// Visits attempts by protocol, participant number, session, trial and attempt. Also verifies the
/// rows of a session that are not visited. \param version of the schema; seals exist since 3.
/// \throws SQLite::Exception (damage), StoreRefused (a row does not match its seal).
void read_attempts(SQLite::Database& db, const std::string& path, int version,
                   const AttemptFilter& filter,
                   const std::function<void(const StoredTrial&)>& visit);

/// Runs within a transaction of the caller; no effect if no attempt is open.
void cut_off_open_attempt(SQLite::Database& db, SealWriter& seals, const Run& run,
                          const std::string& reason);

}  // namespace palpate::data
