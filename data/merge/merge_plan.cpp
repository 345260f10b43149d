#include "data/merge/merge_plan.h"

#include <sqlite3.h>

#include <algorithm>
#include <limits>
#include <set>
#include <tuple>

#include "data/merge/session_copy.h"
#include "data/store/protocol_rows.h"
#include "data/store/sqlite_errors.h"
#include "data/store/statement_values.h"

namespace palpate::data {
namespace {

struct FoundParticipant {
  std::int64_t id = 0;
  int number = 0;
  PlannedParticipant person;
};

std::vector<FoundParticipant> participants_of(StationDatabase& station, std::int64_t protocol_id) {
  std::vector<FoundParticipant> all;
  SQLite::Statement find(station.db(),
                         "SELECT id, number, coalesce((SELECT enrolled_number FROM renumberings "
                         "WHERE participant_id = "
                         "id), number), code, simulated, seed FROM participants WHERE protocol_id "
                         "= ? ORDER BY number");
  Binder(find) << protocol_id;
  while (find.executeStep()) {
    FoundParticipant& one = all.emplace_back();
    one.person.station = &station;
    RowReader(find) >> one.id >> one.number >> one.person.enrolled_number >> one.person.code >>
        one.person.simulated >> one.person.seed;
  }
  SQLite::Statement sessions(station.db(),
                             "SELECT number, id FROM sessions WHERE participant_id = ?");
  for (FoundParticipant& one : all) {
    sessions.reset();
    Binder(sessions) << one.id;
    while (sessions.executeStep()) {
      int number = 0;
      std::int64_t id = 0;
      RowReader(sessions) >> number >> id;
      one.person.sessions[number] = {&station, id};
    }
  }
  return all;
}

struct Span {
  double begin = 0, end = 0;  // s since 1970
};

/// From the first start to the last recorded time of a session.
Span span_of(const PlannedSession& session) {
  SQLite::Statement find(
      session.station->db(),
      "SELECT coalesce(min(r.started_utc_ns / 1e9), 0), coalesce(max(r.started_utc_ns / 1e9 + "
      "(max(coalesce(r.ended_ns, r.started_ns), coalesce((SELECT max(max(a.began_ns, "
      "coalesce(a.response_ns, a.began_ns))) FROM attempts a WHERE a.run_id = r.id), "
      "r.started_ns)) - r.started_ns) / 1e9), 0) FROM runs r WHERE r.session_id = ?");
  Binder(find) << session.id;
  find.executeStep();
  Span span;
  RowReader(find) >> span.begin >> span.end;
  return span;
}

class Planner {
 public:
  MergePlan plan(std::deque<StationDatabase>& stations, NumberConflict clash);

 private:
  void add_protocols(StationDatabase& station);
  void add_files(ProtocolInfo& known, StationDatabase& station, std::int64_t protocol_id);
  void add_participant(PlannedProtocol& protocol, FoundParticipant found);
  void assign_numbers(PlannedProtocol& protocol, NumberConflict clash);
  void add_sessions(PlannedParticipant& known, const PlannedParticipant& found);
  void require_same_protocols(const std::deque<StationDatabase>& stations);
  /// \param other_conflicts number of conflicts that are not about participant numbers
  [[noreturn]] void raise(std::size_t other_conflicts) const;

  MergePlan plan_;
  std::map<std::string, PlannedProtocol> protocols_;                       // by checksum
  std::map<std::string, std::map<std::string, FoundParticipant>> people_;  // checksum -> by code
  std::map<std::string, std::map<const StationDatabase*, std::set<std::string>>>
      names_;                              // -> checksums
  std::map<std::string, bool> withdrawn_;  // codes that were looked up
  std::vector<std::string> conflicts_;
};

MergePlan Planner::plan(std::deque<StationDatabase>& stations, NumberConflict clash) {
  for (StationDatabase& station : stations) {
    guarded(station.path(),
            [&] { plan_.tombstones.add(Tombstones::read(station.db(), station.path())); });
  }
  for (StationDatabase& station : stations)
    guarded(station.path(), [&] { add_protocols(station); });
  require_same_protocols(stations);
  const std::size_t other_conflicts = conflicts_.size();
  for (auto& [sha256, protocol] : protocols_) assign_numbers(protocol, clash);
  if (!conflicts_.empty()) raise(other_conflicts);
  for (auto& [sha256, protocol] : protocols_) {
    for (const auto& [number, person] : protocol.participants) {
      plan_.sessions += static_cast<std::int64_t>(person.sessions.size());
    }
    plan_.protocols.push_back(std::move(protocol));
  }
  std::sort(plan_.protocols.begin(), plan_.protocols.end(), [](const auto& a, const auto& b) {
    return std::pair(a.info.name, a.info.sha256) < std::pair(b.info.name, b.info.sha256);
  });
  return std::move(plan_);
}

void Planner::raise(std::size_t other_conflicts) const {
  std::string message = "these databases cannot be merged; nothing was written:";
  for (const std::string& one : conflicts_) message += "\n  " + one;
  if (conflicts_.size() > other_conflicts) {
    message +=
        "\nTwo stations gave the same number: --renumber gives another one to who began later, and "
        "keeps on record whose order of trials was shown. From now on keep the stations' numbers "
        "apart with palpate run --number";
  }
  if (other_conflicts > 0) {
    message +=
        "\nLeave one of the databases out, or remove a participant who is in the wrong place from "
        "a copy of it with palpate forget";
  }
  throw StoreRefused(message);
}

void Planner::add_protocols(StationDatabase& station) {
  SQLite::Statement find(station.db(), "SELECT id, name, sha256, text FROM protocols ORDER BY id");
  while (find.executeStep()) {
    std::int64_t id = 0;
    ProtocolInfo found;
    RowReader(find) >> id >> found.name >> found.sha256 >> found.text;
    names_[found.name][&station].insert(found.sha256);
    PlannedProtocol& protocol = protocols_[found.sha256];
    if (protocol.info.sha256.empty()) protocol.info = found;
    if (protocol.info.text != found.text || protocol.info.name != found.name) {
      conflicts_.push_back(station.path() + ": protocol " + found.name +
                           " has the checksum of another protocol: the file is damaged");
      continue;
    }
    add_files(protocol.info, station, id);
    for (FoundParticipant& one : participants_of(station, id)) {
      const std::string code = one.person.code;
      if (!is_participant_code(code)) {
        throw SQLite::Exception("a participant's code is not 1 to 32 letters and digits",
                                SQLITE_CORRUPT);
      }
      auto [at, unknown] = withdrawn_.try_emplace(code, false);
      if (unknown) at->second = plan_.tombstones.holds(code);
      if (at->second) {
        plan_.excluded.push_back({code, station.path()});
      } else {
        add_participant(protocol, std::move(one));
      }
    }
  }
}

/// Not every station has the files: earlier versions did not store them.
void Planner::add_files(ProtocolInfo& known, StationDatabase& station, std::int64_t protocol_id) {
  for (ProtocolFile& file : protocol_files(station.db(), protocol_id)) {
    const auto at = std::lower_bound(known.files.begin(), known.files.end(), file.name,
                                     [](const auto& a, const auto& name) { return a.name < name; });
    if (at == known.files.end() || at->name != file.name) {
      known.files.insert(at, std::move(file));
    } else if (at->bytes != file.bytes) {
      conflicts_.push_back(station.path() + ": " + file.name + " of protocol " + known.name +
                           " differs from the file of another station");
    }
  }
}

void Planner::add_participant(PlannedProtocol& protocol, FoundParticipant found) {
  const std::string code = found.person.code;
  auto& people = people_[protocol.info.sha256];
  const auto at = people.find(code);
  if (at == people.end()) {
    people.emplace(code, std::move(found));
    return;
  }
  FoundParticipant& known = at->second;
  const std::string where = " (" + known.person.station->path() + ", " +
                            found.person.station->path() + ", protocol " + protocol.info.name + ")";
  const int known_order = known.person.enrolled_number, order = found.person.enrolled_number;
  if (known_order != order) {
    conflicts_.push_back("participant " + code + " has number " + std::to_string(known_order) +
                         " and number " + std::to_string(order) + where);
  } else if (known.person.simulated != found.person.simulated ||
             known.person.seed != found.person.seed) {
    conflicts_.push_back("participant " + code +
                         " is simulated at one station and a person at the other, or simulated "
                         "with another seed" +
                         where);
  } else {
    // One of the two was renumbered by an earlier merge: keeps that number.
    if (known.number == order) {
      known.number = found.number;
    } else if (found.number != order) {
      known.number = std::min(known.number, found.number);
    }
    add_sessions(known.person, found.person);
  }
}

/// Of participants with the same number the one who began first keeps it, but those who were
/// enrolled with it before those who were renumbered to it.
void Planner::assign_numbers(PlannedProtocol& protocol, NumberConflict clash) {
  std::vector<std::pair<std::tuple<int, bool, double, std::string>, FoundParticipant*>> ordered;
  for (auto& [code, one] : people_[protocol.info.sha256]) {
    double began = std::numeric_limits<double>::infinity();
    for (const auto& [number, session] : one.person.sessions)
      began = std::min(began, span_of(session).begin);
    ordered.push_back({{one.number, one.number != one.person.enrolled_number, began, code}, &one});
  }
  std::sort(ordered.begin(), ordered.end(),
            [](const auto& a, const auto& b) { return a.first < b.first; });
  int last = ordered.empty() ? 0 : ordered.back().second->number;
  for (auto& [rank, one] : ordered) {
    const auto holder = protocol.participants.find(one->number);
    int number = one->number;
    if (holder != protocol.participants.end()) {
      const PlannedParticipant& other = holder->second;
      if (clash == NumberConflict::refuse) {
        conflicts_.push_back("number " + std::to_string(number) + " is that of participant " +
                             other.code + " and of participant " + one->person.code + " (" +
                             other.station->path() + ", " + one->person.station->path() +
                             ", protocol " + protocol.info.name + ")");
        continue;
      }
      number = ++last;
      plan_.renumbered.push_back({one->person.code, other.code, one->person.station->path(),
                                  one->person.enrolled_number, number});
    }
    protocol.participants.emplace(number, std::move(one->person));
  }
}

void Planner::add_sessions(PlannedParticipant& known, const PlannedParticipant& found) {
  const auto conflict = [&](const PlannedSession& other, const std::string& what) {
    conflicts_.push_back("participant " + known.code + ": " + what + " (" + other.station->path() +
                         ", " + found.station->path() + ")");
  };
  const auto before = known.sessions;
  for (const auto& [number, session] : found.sessions) {
    const auto same = before.find(number);
    if (same != before.end()) {
      const PlannedSession& other = same->second;
      if (!same_session(other.station->db(), other.id, session.station->db(), session.id)) {
        conflict(other, "session " + std::to_string(number) +
                            " is not the same: two people under one code, or one database is an "
                            "older copy of the other");
      }
      continue;
    }
    const Span now = span_of(session);
    for (const auto& [other_number, other] : before) {
      if (known.simulated || found.sessions.contains(other_number)) continue;
      const Span then = span_of(other);
      if (now.begin > then.end || then.begin > now.end) continue;
      conflict(other, "sessions " + std::to_string(other_number) + " and " +
                          std::to_string(number) + " were at the same time: two people");
    }
    known.sessions[number] = session;
  }
}

/// A station may have several versions (checksums) of a protocol name: it was changed there. Two
/// stations where neither has all versions of the other ran different studies.
void Planner::require_same_protocols(const std::deque<StationDatabase>& stations) {
  for (const auto& [name, by_station] : names_) {
    for (std::size_t i = 0; i < stations.size(); ++i) {
      for (std::size_t k = i + 1; k < stations.size(); ++k) {
        const StationDatabase &a = stations[i], &b = stations[k];
        const auto of_a = by_station.find(&a), of_b = by_station.find(&b);
        if (of_a == by_station.end() || of_b == by_station.end()) continue;
        const auto &one = of_a->second, &other = of_b->second;
        if (std::includes(one.begin(), one.end(), other.begin(), other.end()) ||
            std::includes(other.begin(), other.end(), one.begin(), one.end())) {
          continue;
        }
        conflicts_.push_back("protocol " + name + " is not the same in " + a.path() + " (SHA-256 " +
                             one.begin()->substr(0, 12) + "...) and " + b.path() + " (" +
                             other.begin()->substr(0, 12) + "...)");
      }
    }
  }
}

}  // namespace

MergePlan plan_merge(std::deque<StationDatabase>& stations, NumberConflict clash) {
  return Planner().plan(stations, clash);
}

}  // namespace palpate::data
