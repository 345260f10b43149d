#pragma once
// Internal to data/: attempts, read one at a time and verified, and ended where a run left one
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

// Internal to data/: reads attempts one at a time, in order, and verifies them: every session that
// is touched is checked against its hash chain (seals.h), every value against the range that
// palpate writes. Store, and StationDatabase for merge, read trials through this only.

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
  /// Of which completed trials samples are read, asked in order; none: of all.
  const std::function<bool(const StoredTrial&)>* samples_wanted = nullptr;
  bool seals_verified = false;  ///< already, in the same snapshot of the database
};

/// Visits attempts by protocol, participant number, session, trial and attempt. Rows of a session
/// that are not visited are verified, too. \param version of the schema; seals exist since 3.
/// \throws SQLite::Exception (damage), StoreRefused (a row does not match its seal).
void read_attempts(SQLite::Database& db, const std::string& path, int version,
                   const AttemptFilter& filter,
                   const std::function<void(const StoredTrial&)>& visit);

/// Within a transaction of the caller; no effect where no attempt is open.
void cut_off_open_attempt(SQLite::Database& db, SealWriter& seals, const Run& run,
                          const std::string& reason);

}  // namespace palpate::data
