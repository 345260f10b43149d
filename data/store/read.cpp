// The reading calls of Store. Trials are read and verified by attempts.h.

#include <algorithm>

#include "data/files/utc.h"
#include "data/store/attempts.h"
#include "data/store/connection.h"
#include "data/store/protocol_rows.h"
#include "data/store/record_columns.h"
#include "data/store/statement.h"
#include "data/store/store_error.h"
#include "data/store/unmaskings.h"

namespace palpate::data {
namespace {

constexpr int kTombstonesSince = 2;  // version of the schema

}  // namespace

SessionProgress Store::progress(const Participant& participant, int session) {
  return guarded(impl_->path, [&] {
    SQLite::Database& db = *impl_->db;
    SessionProgress progress;
    SQLite::Statement runs(
        db,
        "SELECT r.end_reason, r.started_utc_ns, r.started_ns, s.observer_sha256 FROM sessions s "
        "JOIN "
        "runs r ON r.session_id = s.id WHERE s.participant_id = ? AND s.number = ? "
        "ORDER BY r.id");
    Binder(runs) << participant.id << session;
    while (runs.executeStep()) {
      ClockStamp clock;
      std::string end;
      RowReader(runs) >> end >> clock.utc_ns >> clock.monotonic_ns >> progress.observer_sha256;
      if (!progress.last_end) progress.clock = clock;
      progress.last_end = run_end_of(end);
    }
    const AttemptFilter theirs{.session = std::pair(participant.id, session)};
    read_attempts(db, impl_->path, impl_->version, theirs, [&](const StoredTrial& trial) {
      if (!trial.cut_off_reason.empty()) {
        ++progress.cut_off;
      } else {
        progress.completed.push_back(trial.record);
        progress.latest_ns = std::max(progress.latest_ns, trial.record.response_ns);
      }
    });
    return progress;
  });
}

std::vector<ProtocolInfo> Store::protocols() {
  return guarded(impl_->path, [&] {
    std::vector<ProtocolInfo> all;
    SQLite::Statement find(*impl_->db, "SELECT name, text, sha256 FROM protocols ORDER BY id");
    while (find.executeStep()) {
      ProtocolInfo& protocol = all.emplace_back();
      RowReader(find) >> protocol.name >> protocol.text >> protocol.sha256;
    }
    return all;
  });
}

std::vector<ProtocolFile> Store::files(const std::string& protocol_sha256) {
  if (impl_->version < 3) return {};
  return guarded(impl_->path, [&] {
    SQLite::Statement find(*impl_->db, "SELECT id FROM protocols WHERE sha256 = ?");
    Binder(find) << protocol_sha256;
    if (!find.executeStep()) return std::vector<ProtocolFile>();
    return protocol_files(*impl_->db, find.getColumn(0).getInt64());
  });
}

std::vector<Participant> Store::participants(const std::string& protocol_sha256) {
  return guarded(impl_->path, [&] {
    std::vector<Participant> all;
    SQLite::Statement find(*impl_->db, std::string("SELECT ") + person_columns(impl_->version) +
                                           " FROM participants pa JOIN protocols pr ON pr.id = "
                                           "pa.protocol_id WHERE pr.sha256 = ? ORDER BY pa.number");
    Binder(find) << protocol_sha256;
    while (find.executeStep()) {
      RowReader row(find);
      row >> all.emplace_back();
    }
    return all;
  });
}

std::vector<StoredRun> Store::runs() {
  return guarded(impl_->path, [&] {
    std::vector<StoredRun> all;
    SQLite::Statement find(*impl_->db, std::string("SELECT pr.sha256, r.end_reason, ") +
                                           person_columns(impl_->version) + ", " +
                                           run_columns(impl_->version) + kFromProtocolDown +
                                           "JOIN runs r ON r.session_id = s.id ORDER BY pr.id, "
                                           "pa.number, s.number, r.id");
    while (find.executeStep()) {
      StoredRun& run = all.emplace_back();
      std::string end;
      RowReader row(find);
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
                           std::string("SELECT ") + person_columns(impl_->version) +
                               ", s.number, n.text, n.at_ns, r.started_utc_ns, r.started_ns" +
                               kFromProtocolDown +
                               "JOIN runs r ON r.session_id = s.id JOIN notes n ON n.run_id = "
                               "r.id ORDER BY pr.id, pa.number, s.number, r.id, n.id");
    while (find.executeStep()) {
      StoredNote& note = all.emplace_back();
      std::int64_t at_ns = 0;
      ClockStamp clock;
      RowReader row(find);
      row >> note.participant >> note.session >> note.text >> at_ns >> clock.utc_ns >>
          clock.monotonic_ns;
      note.utc = format_utc(to_unix_ns(clock, at_ns));
      note.run_clock = clock;
    }
    return all;
  });
}

std::optional<std::int64_t> Store::latest_recorded_time() {
  return guarded(impl_->path, [&]() -> std::optional<std::int64_t> {
    SQLite::Statement find(
        *impl_->db,
        "SELECT r.started_utc_ns, r.started_ns, max(r.started_ns, coalesce(r.ended_ns, "
        "r.started_ns), "
        "coalesce((SELECT max(max(a.began_ns, coalesce(a.response_ns, a.began_ns))) FROM attempts "
        "a "
        "WHERE a.run_id = r.id), r.started_ns)) FROM runs r JOIN sessions s ON s.id = r.session_id "
        "JOIN participants pa ON pa.id = s.participant_id WHERE pa.seed IS NULL");
    std::optional<std::int64_t> newest;
    while (find.executeStep()) {
      ClockStamp clock;
      std::int64_t last_ns = 0;
      RowReader(find) >> clock.utc_ns >> clock.monotonic_ns >> last_ns;
      const std::int64_t at = to_unix_ns(clock, last_ns);
      newest = std::max(newest.value_or(at), at);
    }
    return newest;
  });
}

std::vector<Unmasking> Store::unmaskings() {
  return guarded(impl_->path, [&] { return read_unmaskings(*impl_->db, impl_->path); });
}

StoreCounts Store::counts() {
  return guarded(impl_->path, [&] {
    SQLite::Statement count(
        *impl_->db,
        // Counted from indexes; counting state = 'cut_off' would scan the table.
        "WITH a(completed, running) AS (SELECT (SELECT count(*) FROM attempts WHERE state = "
        "'completed'), (SELECT count(*) FROM attempts WHERE state = 'running')) "
        "SELECT (SELECT count(*) FROM protocols), (SELECT count(*) FROM participants), (SELECT "
        "count(*) FROM sessions), (SELECT count(*) FROM runs), completed, (SELECT count(*) FROM "
        "attempts) - completed - running, (SELECT count(*) FROM runs WHERE end_reason = "
        "'interrupted'), (SELECT count(*) FROM samples) FROM a");
    count.executeStep();
    StoreCounts counts;
    RowReader(count) >> counts.protocols >> counts.participants >> counts.sessions >> counts.runs >>
        counts.completed >> counts.cut_off >> counts.interrupted_runs >> counts.sampled;
    if (impl_->version >= kTombstonesSince) {
      SQLite::Statement tombstones(*impl_->db, "SELECT count(*) FROM tombstones");
      tombstones.executeStep();
      RowReader(tombstones) >> counts.withdrawn;
    }
    return counts;
  });
}

void Store::for_each_trial(const std::function<void(const StoredTrial&)>& visit,
                           bool with_samples) {
  guarded(impl_->path, [&] {
    AttemptFilter filter{.state = AttemptState::completed};
    if (with_samples) filter.samples = SampleReading::unpack;
    read_attempts(*impl_->db, impl_->path, impl_->version, filter, visit);
  });
  impl_->seals_verified = !impl_->writes();  // a reader's snapshot does not change
}

void Store::for_each_trial(const std::function<void(const StoredTrial&)>& visit,
                           const std::function<bool(const StoredTrial&)>& samples_wanted) {
  guarded(impl_->path, [&] {
    const AttemptFilter filter{.state = AttemptState::completed,
                               .samples = SampleReading::unpack,
                               .samples_wanted = &samples_wanted};
    read_attempts(*impl_->db, impl_->path, impl_->version, filter, visit);
  });
  impl_->seals_verified = !impl_->writes();
}

void Store::for_each_cut_off(const std::function<void(const StoredTrial&)>& visit) {
  guarded(impl_->path, [&] {
    const AttemptFilter filter{.state = AttemptState::cut_off,
                               .seals_verified = impl_->seals_verified};
    read_attempts(*impl_->db, impl_->path, impl_->version, filter, visit);
  });
}

std::vector<StoredTrial> Store::attempts(const TrialName& name) {
  return guarded(impl_->path, [&] {
    std::vector<StoredTrial> all;
    AttemptFilter filter{.trial = &name, .samples = SampleReading::unpack};
    read_attempts(*impl_->db, impl_->path, impl_->version, filter,
                  [&all](const StoredTrial& trial) { all.push_back(trial); });
    std::stable_partition(all.begin(), all.end(),
                          [](const auto& one) { return !one.cut_off_reason.empty(); });
    return all;
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

std::map<std::string, std::int64_t, std::less<>> Store::first_onsets() {
  return guarded(impl_->path, [&] {
    std::map<std::string, std::int64_t, std::less<>> firsts;
    for (const char* kind : {"onset_ns) AS first FROM attempts WHERE state = 'completed'",
                             "began_ns) AS first FROM attempts WHERE state = 'cut_off'"}) {
      std::map<std::string, std::int64_t, std::less<>> found;
      SQLite::Statement find(*impl_->db,
                             std::string("SELECT pa.code, r.started_utc_ns, r.started_ns, x.first "
                                         "FROM (SELECT run_id, min(") +
                                 kind +
                                 " GROUP BY run_id) x JOIN runs r ON r.id = "
                                 "x.run_id JOIN sessions s ON s.id = r.session_id JOIN "
                                 "participants pa ON pa.id = s.participant_id");
      while (find.executeStep()) {
        std::string code;
        ClockStamp clock;
        std::int64_t first_ns = 0;
        RowReader(find) >> code >> clock.utc_ns >> clock.monotonic_ns >> first_ns;
        const std::int64_t unix_ns = to_unix_ns(clock, first_ns);
        const auto [at, added] = found.emplace(code, unix_ns);
        if (!added) at->second = std::min(at->second, unix_ns);
      }
      firsts.merge(found);  // keeps the codes of the first pass
    }
    return firsts;
  });
}

}  // namespace palpate::data
