#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "data/store/store.h"

namespace palpate::data {

/// A participant of a station who has withdrawn at some station.
struct ExcludedParticipant {
  std::string code, path;  ///< of the database that still holds the participant
};

/// A participant whose number is another's as well.
struct RenumberedParticipant {
  std::string code, other, path;  ///< path: of the database that holds `code`
  int from = 0, to = 0;           ///< from: orders the trials, also those to come
};

struct MergeResult {
  StoreCounts counts;  ///< of the new database
  std::vector<ExcludedParticipant> excluded;
  std::vector<RenumberedParticipant> renumbered;
};

/// What becomes of one number for two codes: two stations counted for themselves.
enum class NumberConflict {
  refuse,
  renumber,  ///< who began later gets the next number after all; the store keeps both
};

/// Makes one database of several stations' databases: every protocol, participant, session, run,
/// note, attempt, sample and tombstone once. What the inputs hold in common must be alike to the
/// last bit, so merging a merged database with its parts again changes nothing; the order of the
/// inputs does not matter either. Who has withdrawn at one station is left out from all. Records of
/// exports are not taken over: they belong to the stations' computers.
///
/// The inputs are not written to. `out` is made whole or not at all; what is there already is never
/// replaced. \param progress called after every session with its number and the number of all; may
/// throw to stop.
/// \throws StoreRefused with every conflict: a participant with different content (number, a
/// session of the same number, sessions at the same time), one number for two codes (see
/// NumberConflict), different protocols under one name; an input that Store::open would refuse, or
/// that is open for writing.
MergeResult merge(const std::string& out, const std::vector<std::string>& inputs,
                  const std::function<void(std::int64_t, std::int64_t)>& progress = {},
                  NumberConflict clash = NumberConflict::refuse);

}  // namespace palpate::data
