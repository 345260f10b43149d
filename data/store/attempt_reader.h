#pragma once
// Internal to data/: attempts one at a time, in order, and whether they and their sessions are what
// was recorded.

#include <SQLiteCpp/Database.h>

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>

#include "data/store/store.h"

namespace palpate::data {

enum class AttemptState { running, completed, cut_off };

enum class SampleReading { no, verify, unpacked };

/// Which attempts are visited. The sessions that they are in are checked as a whole.
struct AttemptFilter {
  std::optional<AttemptState> state = {};                    ///< none: both that are over
  const TrialName* trial = nullptr;                          ///< this one, in whatever protocols
  std::optional<std::pair<std::int64_t, int>> session = {};  ///< participant's id, number
  SampleReading samples = SampleReading::no;
  bool seals_verified = false;  ///< the seals, in the same state of the database
};

/// By protocol, participant number, session, trial and attempt. Every session in question is held
/// against its seals, also the rows that are not visited, and every value against what palpate
/// writes. \param version of the schema: there are seals since 3. \throws SQLite::Exception
/// (damage), StoreRefused.
void read_attempts(SQLite::Database& db, const std::string& path, int version,
                   const AttemptFilter& filter,
                   const std::function<void(const StoredTrial&)>& visit);

}  // namespace palpate::data
