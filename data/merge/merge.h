#pragma once
// palpate merge: the databases of several stations (computers that run parts of a study) into one.

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "data/store/store.h"

namespace palpate::data {

/// A participant who has withdrawn at one station and is still in the database of another.
struct ExcludedParticipant {
  std::string code, path;  ///< path: of the database that still holds the participant
};

/// A participant who got a new number, because another one has the same.
struct RenumberedParticipant {
  std::string code, other, path;  ///< path: of the database that holds `code`
  int from = 0, to = 0;           ///< from: keeps selecting the order of trials
};

struct MergeResult {
  StoreCounts counts;  ///< of the new database
  std::vector<ExcludedParticipant> excluded;
  std::vector<RenumberedParticipant> renumbered;
};

/// Two codes with one number in a protocol: two stations numbered independently.
enum class NumberConflict {
  refuse,
  renumber,  ///< the one who began later gets the next free number; the store keeps both
};

/// Creates the union of several databases: every protocol, participant, session, run, note,
/// attempt, sample and tombstone once. Rows that several inputs hold must be identical to the bit;
/// so merging is idempotent (a merged database with its parts again gives the same bytes) and
/// commutative. Participants who have withdrawn at one station are excluded. Records of exports are
/// not copied: they refer to files on the stations' computers.
///
/// The inputs are not written to. `out` appears complete or not at all, and never replaces a file.
/// \param progress called after every session with its number and the total; may throw to stop.
/// \throws StoreRefused with every conflict: a participant with different content (number, a
/// session of the same number, sessions at the same time), one number for two codes (see
/// NumberConflict), different protocols under one name; an input that Store::open would refuse, or
/// that is open for writing.
MergeResult merge(const std::string& out, const std::vector<std::string>& inputs,
                  const std::function<void(std::int64_t, std::int64_t)>& progress = {},
                  NumberConflict clash = NumberConflict::refuse);

}  // namespace palpate::data
