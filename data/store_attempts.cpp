// Reading attempts one at a time: what is on record of each, its samples, and whether it is sound.

#include <sqlite3.h>

#include <cmath>
#include <cstddef>
#include <string_view>

#include "data/checks.h"
#include "data/samples_codec.h"
#include "data/store_impl.h"
#include "data/store_rows.h"
#include "data/utc.h"

namespace palpate {
namespace {

std::vector<SampleRecord> read_samples(SQLite::Statement& find, std::int64_t attempt,
                                       const std::string& path) {
  find.reset();
  find.bind(1, attempt);
  if (!find.executeStep()) return {};
  const int packing = find.getColumn(0).getInt();
  if (packing < 1 || packing > kSamplesPacking) {
    throw StoreRefused(
        path + ": holds samples in a packing that this palpate does not know; use a newer one");
  }
  const SQLite::Column data = find.getColumn(2);
  try {
    return unpack_samples(data.getBlob(), static_cast<std::size_t>(data.getBytes()),
                          find.getColumn(1).getInt64(), packing);
  } catch (const StoreError& error) {
    throw SQLite::Exception(error.what(), SQLITE_CORRUPT);
  }
}

/// What no trial of ours holds, and no export could hold. Thrown as damage. With Row, which takes
/// neither a missing value nor a truth value beyond 0 and 1, this is all that the table's CHECKs
/// ask of an attempt: SQLite takes twice as long for them, and leaves them out where the disk is
/// read-only.
class Sound {
 public:
  explicit Sound(const StoredTrial& trial) : trial_(trial) {}
  void text(const char* field, const std::string& value) const {
    if (!is_clean_utf8(value)) fail(field, "is not UTF-8 text");
  }
  void count(const char* field, int value) const {
    if (value < 1) fail(field, "is not 1 or more");
  }
  void number(const char* field, double value) const {
    if (!std::isfinite(value)) fail(field, "is not a finite number");
  }
  void run() const {
    if (!is_participant_code(trial_.participant.code)) {
      throw SQLite::Exception("a participant's code is not 1 to 32 letters and digits",
                              SQLITE_CORRUPT);
    }
    count("participant number", trial_.participant.number);
    count("session", trial_.run.session);
    text("device", trial_.run.device);
    text("program version", trial_.run.program_version);
    text("observer's checksum", trial_.run.observer_sha256);
  }
  void record() const {
    const TrialRecord& record = trial_.record;
    count("block", record.block);
    count("trial", record.trial);
    count("attempt", record.attempt);
    if (record.timed_out && (record.correct || !record.response.empty())) {
      fail("time-out", "has a response or is correct");
    }
    text("renderer", record.renderer);
    text("shape", record.shape);
    text("response", record.response);
    text("reason", trial_.cut_off_reason);
    for (const double q : record.orientation_wxyz) number("orientation", q);
    number("response_time", record.response_time);
    number("first_contact_time", record.first_contact_time.value_or(0));
    number("max_force", record.max_force);
  }

 private:
  [[noreturn]] void fail(const char* field, const char* what) const {
    const TrialRecord& record = trial_.record;
    throw SQLite::Exception("participant " + trial_.participant.code + ", session " +
                                std::to_string(record.session) + ", trial " +
                                std::to_string(record.trial) + ": " + field + " " + what,
                            SQLITE_CORRUPT);
  }
  const StoredTrial& trial_;
};

/// A damaged index hides rows: they are counted without it.
void require_all_seen(SQLite::Database& db, const char* state, std::int64_t seen) {
  SQLite::Statement count(db, "SELECT count(*) FROM attempts NOT INDEXED WHERE state = ?");
  count.bind(1, state);
  count.executeStep();
  const std::int64_t stored = count.getColumn(0).getInt64();
  if (stored == seen) return;
  throw SQLite::Exception("of " + std::to_string(stored) + " attempts " + std::to_string(seen) +
                              " are to be found: an index is damaged",
                          SQLITE_CORRUPT);
}

}  // namespace

void Store::Impl::for_each_attempt(const char* state, bool with_samples,
                                   const std::function<void(const StoredTrial&)>& visit,
                                   const TrialName* only) {
  guarded(path, [&] {
    const bool completed = std::string_view(state) == "completed";
    SQLite::Statement find(
        *db, std::string("SELECT ") + kPlanColumns + ", a.run_id, a.cut_off_reason, " +
                 kOutcomeColumns + kFromProtocolDown +
                 "CROSS JOIN attempts a ON a.session_id = s.id WHERE a.state = ?" +
                 (only ? " AND pa.code = ? AND s.number = ? AND a.trial = ?" : "") +
                 " ORDER BY pr.id, pa.number, s.number, a.trial, a.attempt");
    SQLite::Statement find_run(*db, std::string("SELECT pr.name, pr.sha256, ") +
                                        person_columns(version) + ", " + run_columns(version) +
                                        " FROM runs r JOIN sessions s ON s.id = r.session_id JOIN "
                                        "participants pa ON pa.id = s.participant_id JOIN "
                                        "protocols pr ON pr.id = pa.protocol_id WHERE r.id = ?");
    SQLite::Statement samples(*db, "SELECT packing, count, data FROM samples WHERE attempt_id = ?");
    Binder which(find);
    which << state;
    if (only) which << only->code << only->session << only->trial;
    StoredTrial trial;
    std::int64_t id = 0, known_run = 0, seen = 0;
    std::vector<SQLite::Column> columns;
    const Sound sound(trial);
    const auto read = [&] {
      TrialRecord& record = trial.record;
      record = {};
      std::int64_t run = 0;
      std::optional<std::string> reason;
      Row row(columns);
      id = read_plan(row, record);
      row >> run >> reason;
      if (completed) read_outcome(row, record);
      if (reason.has_value() == completed) {
        throw SQLite::Exception(
            "a reason to cut it off stands at a completed attempt, or none at "
            "one that was cut off",
            SQLITE_CORRUPT);
      }
      trial.cut_off_reason = std::move(reason).value_or("");
      if (run != known_run) {
        find_run.reset();
        find_run.bind(1, run);
        if (!find_run.executeStep())
          throw SQLite::Exception("an attempt without a run", SQLITE_CORRUPT);
        Row details(find_run);
        details >> trial.protocol_name >> trial.protocol_sha256 >> trial.participant >> trial.run;
        sound.run();
        known_run = run;
      }
      record.onset_utc = format_utc(to_unix_ns(trial.run.clock, record.onset_ns));
      sound.record();
    };
    while (find.executeStep()) {
      if (++seen == 1) columns = columns_of(find);
      try {
        read();
      } catch (const SQLite::Exception& error) {
        throw SQLite::Exception(
            "row " + std::to_string(columns[0].getInt64()) + " of attempts: " + error.what(),
            error.getErrorCode());
      }
      if (with_samples) trial.record.samples = read_samples(samples, id, path);
      visit(trial);
    }
    if (!only) require_all_seen(*db, state, seen);
  });
}

void Store::for_each_trial(const std::function<void(const StoredTrial&)>& visit,
                           bool with_samples) {
  impl_->for_each_attempt("completed", with_samples, visit);
}

void Store::for_each_cut_off(const std::function<void(const StoredTrial&)>& visit) {
  impl_->for_each_attempt("cut_off", false, visit);
}

std::vector<StoredTrial> Store::attempts(const TrialName& name) {
  std::vector<StoredTrial> all;
  const auto keep = [&all](const StoredTrial& trial) { all.push_back(trial); };
  impl_->for_each_attempt("cut_off", false, keep, &name);
  impl_->for_each_attempt("completed", true, keep, &name);
  return all;
}

}  // namespace palpate
