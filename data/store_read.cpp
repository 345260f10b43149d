// Reading: what a session holds, and everything for exports and analysis.

#include <sqlite3.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "data/checks.h"
#include "data/samples_codec.h"
#include "data/store_impl.h"
#include "data/utc.h"

namespace palpate {
namespace {

// The columns that the readers below take in this order.
constexpr const char* kPerson = "pa.id, pa.code, pa.number, pa.simulated, pa.seed";
constexpr const char* kRun =
    "s.number, r.started_utc_ns, r.started_ns, r.program_version, r.build, r.device, "
    "r.device_calibration, r.response_device, r.response_latency, s.observer_sha256, "
    "r.consent_version, r.consent_utc_ns, r.hand";
constexpr const char* kPlan =
    "a.id, s.number, a.block, a.trial, a.attempt, a.renderer, a.shape, a.practice, "
    "a.orientation_w, "
    "a.orientation_x, a.orientation_y, a.orientation_z, a.began_ns";
constexpr const char* kOutcome =
    "a.response, a.correct, a.timed_out, a.response_time, a.first_contact_time, a.onset_ns, "
    "a.response_ns, a.start_tip_x, a.start_tip_y, a.start_tip_z, a.start_tail_x, a.start_tail_y, "
    "a.start_tail_z, a.ticks, a.missed_ticks, a.longest_period_ns, a.faults, a.started_inside, "
    "a.max_force";
// CROSS JOIN keeps SQLite to this nesting; with the indexes each level comes in order, so nothing
// is sorted in memory or in a temporary file, however many trials there are.
constexpr const char* kFromProtocolDown =
    " FROM protocols pr CROSS JOIN participants pa ON pa.protocol_id = pr.id CROSS JOIN sessions s "
    "ON "
    "s.participant_id = pa.id ";

Row& operator>>(Row& row, Participant& person) {
  std::optional<std::string> seed;
  row >> person.id >> person.code >> person.number >> person.simulated >> seed;
  person.seed.reset();
  if (!seed) return row;
  const char* const end = seed->data() + seed->size();
  const auto [at, error] = std::from_chars(seed->data(), end, person.seed.emplace());
  if (error != std::errc{} || at != end) {
    throw SQLite::Exception("the seed of participant " + person.code + " is no number",
                            SQLITE_CORRUPT);
  }
  return row;
}

Row& operator>>(Row& row, RunInfo& info) {
  return row >> info.session >> info.clock.utc_ns >> info.clock.monotonic_ns >>
         info.program_version >> info.build >> info.device >> info.device_calibration >>
         info.response_device >> info.response_latency >> info.observer_sha256 >>
         info.consent_version >> info.consent_utc_ns >> info.hand;
}

/// kPlan; the onset is when the attempt was begun, until read_outcome knows better.
std::int64_t read_plan(Row& row, TrialRecord& record) {
  std::int64_t id = 0;
  row >> id >> record.session >> record.block >> record.trial >> record.attempt >>
      record.renderer >> record.shape >> record.practice;
  for (double& q : record.orientation_wxyz) row >> q;
  row >> record.onset_ns;
  return id;
}

void read_outcome(Row& row, TrialRecord& record) {
  row >> record.response >> record.correct >> record.timed_out >> record.response_time >>
      record.first_contact_time >> record.onset_ns >> record.response_ns;
  for (double& x : record.start_tip) row >> x;
  for (double& x : record.start_tail) row >> x;
  row >> record.ticks >> record.missed_ticks >> record.longest_period_ns >> record.faults >>
      record.started_inside >> record.max_force;
}

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

std::string Row::column_name() const {
  return columns_ != nullptr ? (*columns_)[static_cast<std::size_t>(index_)].getName()
                             : statement_->getColumnName(index_);
}

void Row::missing() const {
  throw SQLite::Exception(column_name() + " is missing", SQLITE_CORRUPT);
}

void Row::out_of_range(std::int64_t stored) const {
  throw SQLite::Exception(column_name() + " is out of its range: " + std::to_string(stored),
                          SQLITE_CORRUPT);
}

std::vector<SQLite::Column> columns_of(SQLite::Statement& statement) {
  std::vector<SQLite::Column> columns;
  columns.reserve(static_cast<std::size_t>(statement.getColumnCount()));
  for (int i = 0; i < statement.getColumnCount(); ++i) columns.push_back(statement.getColumn(i));
  return columns;
}

SessionProgress Store::progress(const Participant& participant, int session) {
  return guarded(impl_->path, [&] {
    SQLite::Database& db = *impl_->db;
    SessionProgress progress;
    SQLite::Statement runs(
        db,
        "SELECT r.end_reason, r.started_utc_ns, r.started_ns FROM sessions s JOIN "
        "runs r ON r.session_id = s.id WHERE s.participant_id = ? AND s.number = ? "
        "ORDER BY r.id");
    Binder(runs) << participant.id << session;
    while (runs.executeStep()) {
      ClockStamp clock;
      std::string end;
      Row(runs) >> end >> clock.utc_ns >> clock.monotonic_ns;
      if (!progress.last_end) progress.clock = clock;
      progress.last_end = run_end_of(end);
    }
    SQLite::Statement trials(
        db, std::string("SELECT a.state, r.started_utc_ns, r.started_ns, ") + kPlan + ", " +
                kOutcome +
                " FROM sessions s JOIN attempts a ON a.session_id = s.id JOIN runs r ON r.id = "
                "a.run_id "
                "WHERE s.participant_id = ? AND s.number = ? ORDER BY a.trial, a.attempt");
    Binder(trials) << participant.id << session;
    while (trials.executeStep()) {
      Row row(trials);
      std::string state;
      ClockStamp clock;
      row >> state >> clock.utc_ns >> clock.monotonic_ns;
      if (state == "cut_off") ++progress.cut_off;
      if (state != "completed") continue;
      TrialRecord& record = progress.completed.emplace_back();
      read_plan(row, record);
      read_outcome(row, record);
      record.onset_utc = format_utc(to_unix_ns(clock, record.onset_ns));
      progress.latest_ns = std::max(progress.latest_ns, record.response_ns);
    }
    return progress;
  });
}

std::vector<ProtocolInfo> Store::protocols() {
  return guarded(impl_->path, [&] {
    std::vector<ProtocolInfo> all;
    SQLite::Statement find(*impl_->db, "SELECT name, text, sha256 FROM protocols ORDER BY id");
    while (find.executeStep()) {
      ProtocolInfo& protocol = all.emplace_back();
      Row(find) >> protocol.name >> protocol.text >> protocol.sha256;
    }
    return all;
  });
}

std::vector<Participant> Store::participants(const std::string& protocol_sha256) {
  return guarded(impl_->path, [&] {
    std::vector<Participant> all;
    SQLite::Statement find(*impl_->db, std::string("SELECT ") + kPerson +
                                           " FROM participants pa JOIN protocols pr ON pr.id = "
                                           "pa.protocol_id WHERE pr.sha256 = ? ORDER BY pa.number");
    Binder(find) << protocol_sha256;
    while (find.executeStep()) {
      Row row(find);
      row >> all.emplace_back();
    }
    return all;
  });
}

std::vector<StoredRun> Store::runs() {
  return guarded(impl_->path, [&] {
    std::vector<StoredRun> all;
    SQLite::Statement find(*impl_->db, std::string("SELECT pr.sha256, r.end_reason, ") + kPerson +
                                           ", " + kRun + kFromProtocolDown +
                                           "JOIN runs r ON r.session_id = s.id ORDER BY pr.id, "
                                           "pa.number, s.number, r.id");
    while (find.executeStep()) {
      StoredRun& run = all.emplace_back();
      std::string end;
      Row row(find);
      row >> run.protocol_sha256 >> end >> run.participant >> run.info;
      run.end = run_end_of(end);
    }
    return all;
  });
}

std::vector<StoredNote> Store::notes() {
  return guarded(impl_->path, [&] {
    std::vector<StoredNote> all;
    SQLite::Statement find(*impl_->db,
                           std::string("SELECT ") + kPerson +
                               ", s.number, n.text, n.at_ns, r.started_utc_ns, r.started_ns" +
                               kFromProtocolDown +
                               "JOIN runs r ON r.session_id = s.id JOIN notes n ON n.run_id = "
                               "r.id ORDER BY pr.id, pa.number, s.number, r.id, n.id");
    while (find.executeStep()) {
      StoredNote& note = all.emplace_back();
      std::int64_t at_ns = 0;
      ClockStamp clock;
      Row row(find);
      row >> note.participant >> note.session >> note.text >> at_ns >> clock.utc_ns >>
          clock.monotonic_ns;
      note.utc = format_utc(to_unix_ns(clock, at_ns));
      note.run_clock = clock;
    }
    return all;
  });
}

StoreCounts Store::counts() {
  return guarded(impl_->path, [&] {
    SQLite::Statement count(
        *impl_->db,
        // Indexes answer; the table would have to be read for those that were cut off.
        "WITH a(completed, running) AS (SELECT (SELECT count(*) FROM attempts WHERE state = "
        "'completed'), (SELECT count(*) FROM attempts WHERE state = 'running')) "
        "SELECT (SELECT count(*) FROM protocols), (SELECT count(*) FROM participants), (SELECT "
        "count(*) FROM sessions), (SELECT count(*) FROM runs), completed, (SELECT count(*) FROM "
        "attempts) - completed - running, (SELECT count(*) FROM runs WHERE end_reason = "
        "'interrupted'), (SELECT count(*) FROM samples) FROM a");
    count.executeStep();
    StoreCounts counts;
    Row(count) >> counts.protocols >> counts.participants >> counts.sessions >> counts.runs >>
        counts.completed >> counts.cut_off >> counts.interrupted_runs >> counts.sampled;
    return counts;
  });
}

bool Store::has_samples(const Participant& participant, int session) {
  return guarded(impl_->path, [&] {
    SQLite::Statement any(*impl_->db, "SELECT 1 FROM samples LIMIT 1");
    if (!any.executeStep()) return false;
    SQLite::Statement find(
        *impl_->db,
        "SELECT 1 FROM sessions s JOIN attempts a ON a.session_id = s.id JOIN samples x ON "
        "x.attempt_id = a.id WHERE s.participant_id = ? AND s.number = ? LIMIT 1");
    Binder(find) << participant.id << session;
    return find.executeStep();
  });
}

void Store::Impl::for_each_attempt(const char* state, bool with_samples,
                                   const std::function<void(const StoredTrial&)>& visit,
                                   const TrialName* only) {
  guarded(path, [&] {
    const bool completed = std::string_view(state) == "completed";
    SQLite::Statement find(
        *db, std::string("SELECT ") + kPlan + ", a.run_id, a.cut_off_reason, " + kOutcome +
                 kFromProtocolDown +
                 "CROSS JOIN attempts a ON a.session_id = s.id WHERE a.state = ?" +
                 (only ? " AND pa.code = ? AND s.number = ? AND a.trial = ?" : "") +
                 " ORDER BY pr.id, pa.number, s.number, a.trial, a.attempt");
    SQLite::Statement find_run(*db, std::string("SELECT pr.name, pr.sha256, ") + kPerson + ", " +
                                        kRun +
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
