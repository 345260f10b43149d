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
  if (out.empty()) throw StoreRefused("'' is no path of a database");
  for (const char* end : {"", "-wal", "-shm", "-journal"}) {
    if (!fs::exists(fs::symlink_status(out + end, error))) continue;
    throw StoreRefused(out + end +
                       ": is there already; a merge makes a new database and replaces none, give "
                       "another name or move it away");
  }
  if (belongs_to_database(out)) {
    throw StoreRefused(out + ": is a name of what lies beside a database; give another name");
  }
}

/// Opens every file once, however often and under whatever name it was given.
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

/// A value that the tables refuse is damage of the file that it came from.
template <class Work>
void take_from(const StationDatabase& station, Work&& work) {
  guarded(station.path(), [&] {
    try {
      work();
    } catch (const SQLite::Exception& error) {
      if (error.getErrorCode() != SQLITE_CONSTRAINT) throw;
      throw SQLite::Exception(error.what(), SQLITE_CORRUPT);
    }
  });
}

/// Fills a new database in the order of the plan, so that it does not depend on that of the inputs.
void fill(SQLite::Database& db, const std::string& out, const MergePlan& plan,
          const std::function<void(std::int64_t, std::int64_t)>& progress) {
  std::int64_t sessions = 0;
  for (const PlannedProtocol& protocol : plan.protocols)
    insert_protocol_if_absent(db, out, protocol.info);
  for (const PlannedProtocol& protocol : plan.protocols) {
    const std::int64_t protocol_id = insert_protocol_if_absent(db, out, protocol.info);
    for (const auto& [number, person] : protocol.participants) {
      SQLite::Statement enrol(db,
                              "INSERT INTO participants (protocol_id, code, number, simulated, "
                              "seed) VALUES (?, ?, ?, ?, ?)");
      Binder(enrol) << protocol_id << person.code << number << person.simulated << person.seed;
      take_from(*person.station, [&] { enrol.exec(); });
      const std::int64_t participant = db.getLastInsertRowid();
      if (person.enrolled_number != number) {
        SQLite::Statement renumber(
            db, "INSERT INTO renumberings (participant_id, enrolled_number) VALUES (?, ?)");
        Binder(renumber) << participant << person.enrolled_number;
        renumber.exec();
      }
      for (const auto& [session_number, session] : person.sessions) {
        take_from(*session.station, [&, &theirs = session] {
          copy_session(theirs.station->db(), theirs.id, db, participant);
        });
        if (progress) progress(++sessions, plan.sessions);
      }
    }
  }
  // Nothing of theirs was ever in this file: there is nothing to clear.
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
  const std::string draft = folder / "merged.db";
  create_database(draft);
  guarded(out, [&] {
    SQLite::Database db(draft, SQLite::OPEN_READWRITE);
    // It is thrown away if anything fails: no journal is needed.
    db.exec("PRAGMA journal_mode = OFF; PRAGMA synchronous = OFF; PRAGMA foreign_keys = ON");
    SQLite::Transaction transaction(db);
    fill(db, out, plan, progress);
    transaction.commit();
    db.exec("PRAGMA journal_mode = WAL");
  });
  for (const StationDatabase& station : stations) station.require_unchanged();
  MergeResult done{Store::open(draft, Store::Mode::read_only).counts(), plan.excluded,
                   plan.renumbered};
  sync_file(draft);
  if (!rename_if_absent(draft, out)) {
    throw StoreRefused(out + ": has come there meanwhile; nothing was written, give another name");
  }
  return done;
}

}  // namespace palpate::data
