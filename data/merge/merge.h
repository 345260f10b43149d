#pragma once
// palpate merge: joins the databases of several stations (computers that run parts of a study).

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "data/store/forget.h"
#include "data/store/station_database.h"
#include "data/store/store.h"
#include "data/store/sweep_file.h"

namespace palpate::data {

struct SweepMergeResult {
  SweepPlan plan;
  std::int64_t points = 0;  ///< on record in the new file; the plan may have more
  std::int64_t failed = 0;  ///< of them
};

/// Joins the files of shards of a sweep: creates the union of the points of several files of one
/// plan. A point that several hold must be the same in all. The new file has the bytes that one
/// process would have written for the same points, whatever the order of the inputs. Files are
/// opened one after the other and copied row by row: memory does not grow with their number or
/// size. The inputs are not written to; `out` appears complete or not at all, and never replaces a
/// file.
/// \param progress called after each file with its number; may throw to stop
/// \throws StoreRefused: another plan than the first file's, with everything that differs; a point
/// with other results; a file that SweepFile::open would refuse or that is open for writing
SweepMergeResult merge_sweeps(const std::string& out, const std::vector<std::string>& inputs,
                              const std::function<void(std::int64_t)>& progress = {});

/// A participant who withdrew at one station and is still in the database of another.
struct ExcludedParticipant {
  std::string code, path;  ///< path: of the database that still holds the participant
};

/// A participant with a new number, because another one has the same.
struct RenumberedParticipant {
  std::string code, other, path;  ///< path: of the database that holds `code`
  int from = 0, to = 0;           ///< from: still selects the order of trials
};

struct MergeResult {
  StoreCounts counts;  ///< of the new database
  std::vector<ExcludedParticipant> excluded;
  std::vector<RenumberedParticipant> renumbered;
};

/// Two codes with one number in a protocol: two stations numbered independently.
enum class NumberConflict {
  refuse,
  renumber,  ///< the participant who began later gets the next free number; the store keeps both
             ///< numbers
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

struct PlannedSession {
  StationDatabase* station = nullptr;  ///< source of the copy
  std::int64_t id = 0;                 ///< row id at the station
};

struct PlannedParticipant {
  StationDatabase* station = nullptr;  ///< first station that has it
  std::string code;
  int enrolled_number = 0;  ///< as of Participant
  bool simulated = false;
  std::optional<std::string> seed;
  std::map<int, PlannedSession> sessions;  ///< by number
};

struct PlannedProtocol {
  ProtocolInfo info;                               ///< includes its files, by name
  std::map<int, PlannedParticipant> participants;  ///< by number
};

struct MergePlan {
  std::vector<PlannedProtocol> protocols;  ///< by name, then checksum
  Tombstones tombstones;
  std::vector<Unmasking> unmaskings;  ///< of all inputs, by time
  std::vector<ExcludedParticipant> excluded;
  std::vector<RenumberedParticipant> renumbered;
  std::int64_t sessions = 0;
};

}  // namespace palpate::data
