#include "data/merge/merge.h"

#include <SQLiteCpp/Transaction.h>
#include <fcntl.h>
#include <sqlite3.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <deque>
#include <filesystem>
#include <system_error>

#include "data/files/atomic_file.h"
#include "data/files/atomic_folder.h"
#include "data/files/file_identity.h"
#include "data/files/output_check.h"
#include "data/merge/merge_plan.h"
#include "data/merge/session_copy.h"
#include "data/store/protocol_rows.h"
#include "data/store/schema.h"
#include "data/store/sqlite_errors.h"
#include "data/store/statement_values.h"

namespace palpate::data {
namespace {

namespace fs = std::filesystem;

void require_free(const std::string& out) {
  std::error_code error;
  if (out.empty()) throw StoreRefused("'' is not a path of a database");
  for (const char* end : {"", "-wal", "-shm", "-journal"}) {
    if (!fs::exists(fs::symlink_status(out + end, error))) continue;
    throw StoreRefused(out + end +
                       ": exists already; a merge creates a new database and replaces none, give "
                       "another name or move it away");
  }
  if (belongs_to_database(out)) {
    throw StoreRefused(
        out + ": is the name of a file that belongs to another database; give another name");
  }
}

/// Opens every file once, even if it is given several times or by several names.
std::deque<StationDatabase> open_stations(const std::vector<std::string>& inputs,
                                          const AtomicFolder& scratch) {
  std::deque<StationDatabase> stations;
  std::vector<FileIdentity> seen;
  for (const std::string& input : inputs) {
    const FileIdentity identity = identity_of(input);
    if (std::find(seen.begin(), seen.end(), identity) != seen.end()) continue;
    if (identity != FileIdentity{}) seen.push_back(identity);
    stations.emplace_back(input, scratch / ("station-" + std::to_string(stations.size()) + ".db"));
  }
  return stations;
}

/// Copies rows; one that violates a constraint of the new database means that its source is
/// damaged.
template <class Work>
void copy_from(const StationDatabase& station, Work&& work) {
  guarded(station.path(), [&] {
    try {
      work();
    } catch (const SQLite::Exception& error) {
      if (error.getErrorCode() != SQLITE_CONSTRAINT) throw;
      throw SQLite::Exception(error.what(), SQLITE_CORRUPT);
    }
  });
}

/// \return row id
std::int64_t insert_participant(SQLite::Database& db, std::int64_t protocol_id, int number,
                                const PlannedParticipant& person) {
  SQLite::Statement enrol(db,
                          "INSERT INTO participants (protocol_id, code, number, simulated, seed) "
                          "VALUES (?, ?, ?, ?, ?)");
  Binder(enrol) << protocol_id << person.code << number << person.simulated << person.seed;
  copy_from(*person.station, [&] { enrol.exec(); });
  const std::int64_t participant = db.getLastInsertRowid();
  if (person.enrolled_number == number) return participant;
  SQLite::Statement renumber(
      db, "INSERT INTO renumberings (participant_id, enrolled_number) VALUES (?, ?)");
  Binder(renumber) << participant << person.enrolled_number;
  renumber.exec();
  return participant;
}

/// Inserts in the order of the plan, so that the bytes do not depend on the order of the inputs.
void fill(SQLite::Database& db, const std::string& out, const MergePlan& plan,
          const std::function<void(std::int64_t, std::int64_t)>& progress) {
  std::int64_t sessions = 0;
  for (const PlannedProtocol& protocol : plan.protocols)
    insert_protocol_if_absent(db, out, protocol.info);
  for (const PlannedProtocol& protocol : plan.protocols) {
    const std::int64_t protocol_id = insert_protocol_if_absent(db, out, protocol.info);
    for (const auto& [number, person] : protocol.participants) {
      const std::int64_t participant = insert_participant(db, protocol_id, number, person);
      for (const auto& [session_number, session] : person.sessions) {
        copy_from(*session.station, [&, &source = session] {
          copy_session(source.station->db(), source.id, db, participant);
        });
        if (progress) progress(++sessions, plan.sessions);
      }
    }
  }
  // `cleared`: no row of the withdrawn participants was ever in this file.
  for (const auto& tombstone : plan.tombstones.all()) Tombstones::put(db, tombstone, true);
}

void sync_file(const std::string& file) {
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  const bool done = descriptor >= 0 && ::fsync(descriptor) == 0;
  const int error = errno;
  if (descriptor >= 0) ::close(descriptor);
  if (!done)
    throw StoreError(file + ": cannot be written: " + std::generic_category().message(error));
}

}  // namespace

MergeResult merge(const std::string& out, const std::vector<std::string>& inputs,
                  const std::function<void(std::int64_t, std::int64_t)>& progress,
                  NumberConflict clash) {
  require_free(out);
  const AtomicFolder folder(out);
  std::deque<StationDatabase> stations = open_stations(inputs, folder);
  const MergePlan plan = plan_merge(stations, clash);
  const std::string temporary = folder / "merged.db";
  create_database(temporary);
  guarded(out, [&] {
    SQLite::Database db(temporary, SQLite::OPEN_READWRITE);
    // A temporary file, deleted if anything fails: needs no journal.
    db.exec("PRAGMA journal_mode = OFF; PRAGMA synchronous = OFF; PRAGMA foreign_keys = ON");
    SQLite::Transaction transaction(db);
    fill(db, out, plan, progress);
    transaction.commit();
    db.exec("PRAGMA journal_mode = WAL");
  });
  for (const StationDatabase& station : stations) station.require_unchanged();
  MergeResult done{Store::open(temporary, Store::Mode::read_only).counts(), plan.excluded,
                   plan.renumbered};
  sync_file(temporary);
  if (!rename_if_absent(temporary, out)) {
    throw StoreRefused(
        out + ": another program has created it meanwhile; nothing was written, give another name");
  }
  return done;
}

}  // namespace palpate::data
