#pragma once
// Internal to data/merge: what is copied from which station, and the conflicts that prevent a
// merge.

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "data/merge/merge.h"
#include "data/store/station_database.h"
#include "data/store/tombstones.h"

namespace palpate::data {

struct PlannedSession {
  StationDatabase* station = nullptr;  ///< to copy it from
  std::int64_t id = 0;                 ///< there
};

struct PlannedParticipant {
  StationDatabase* station = nullptr;  ///< where it was found first
  std::string code;
  int enrolled_number = 0;  ///< as of Participant
  bool simulated = false;
  std::optional<std::string> seed;
  std::map<int, PlannedSession> sessions;  ///< by number
};

struct PlannedProtocol {
  ProtocolInfo info;                               ///< with its files, by name
  std::map<int, PlannedParticipant> participants;  ///< by number
};

struct MergePlan {
  std::vector<PlannedProtocol> protocols;  ///< by name, then checksum
  Tombstones tombstones;
  std::vector<ExcludedParticipant> excluded;
  std::vector<RenumberedParticipant> renumbered;
  std::int64_t sessions = 0;
};

/// \throws StoreRefused with every conflict, a line each.
MergePlan plan_merge(std::deque<StationDatabase>& stations, NumberConflict clash);

}  // namespace palpate::data
