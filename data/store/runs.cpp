// Sessions and runs: a session belongs to a participant; a run is the part of it shown by one
// process, so an interrupted session has several.

#include <set>

#include "data/base/text.h"
#include "data/store/attempts.h"
#include "data/store/connection.h"
#include "data/store/protocol_rows.h"
#include "data/store/record_columns.h"
#include "data/store/statement.h"
#include "data/store/unmaskings.h"
#include "data/stored_protocol.h"

namespace palpate::data {
namespace {

std::string session_name(const Participant& participant, const RunInfo& info) {
  return "session " + std::to_string(info.session) + " of participant " + participant.code;
}

struct SessionRow {
  std::int64_t id = 0;
  std::string observer_sha256;
};

std::optional<SessionRow> find_session(SQLite::Database& db, std::int64_t participant, int number) {
  SQLite::Statement find(
      db, "SELECT id, observer_sha256 FROM sessions WHERE participant_id = ? AND number = ?");
  Binder(find) << participant << number;
  if (!find.executeStep()) return std::nullopt;
  SessionRow session;
  RowReader(find) >> session.id >> session.observer_sha256;
  return session;
}

std::int64_t insert_session(SQLite::Database& db, std::int64_t participant, const RunInfo& info) {
  SQLite::Statement add(
      db, "INSERT INTO sessions (participant_id, number, observer_sha256) VALUES (?, ?, ?)");
  Binder(add) << participant << info.session << info.observer_sha256;
  add.exec();
  return db.getLastInsertRowid();
}

/// The end of a session's latest run; `paused` if there is none.
RunEnd latest_run_end(SQLite::Database& db, std::int64_t session) {
  SQLite::Statement last(
      db, "SELECT end_reason FROM runs WHERE session_id = ? ORDER BY id DESC LIMIT 1");
  Binder(last) << session;
  return last.executeStep() ? run_end_of(last.getColumn(0).getString()) : RunEnd::paused;
}

std::int64_t protocol_of(SQLite::Database& db, std::int64_t participant) {
  SQLite::Statement find(db, "SELECT protocol_id FROM participants WHERE id = ?");
  Binder(find) << participant;
  find.executeStep();
  return find.getColumn(0).getInt64();
}

std::int64_t insert_run(SQLite::Database& db, std::int64_t session, const RunInfo& info,
                        std::optional<std::int64_t> other_protocol,
                        const std::string& files_sha256) {
  SQLite::Statement add(
      db,
      "INSERT INTO runs (session_id, started_utc_ns, started_ns, program_version, build, device, "
      "device_calibration, response_device, response_latency, consent_version, consent_utc_ns, "
      "hand, protocol_id, files_sha256, end_reason) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, "
      "?, ?, 'running')");
  Binder(add) << session << info.clock.utc_ns << info.clock.monotonic_ns << info.program_version
              << info.build << info.device << info.device_calibration << info.response_device
              << info.response_latency << info.consent_version << info.consent_utc_ns << info.hand
              << other_protocol << files_sha256;
  add.exec();
  return db.getLastInsertRowid();
}

}  // namespace

void Store::validate_run(const Participant& participant, const RunInfo& info) const {
  Validator validator;
  validate(validator, info, participant.simulated);
  validator.throw_if_invalid(impl_->path + ": session of participant " + participant.code);
}

std::int64_t Store::Impl::resume_or_create_session(const Participant& participant,
                                                   const RunInfo& info) {
  const auto known = find_session(*db, participant.id, info.session);
  if (!known) return insert_session(*db, participant.id, info);
  const std::string name = session_name(participant, info);
  if (known->observer_sha256 != info.observer_sha256) {
    refuse(name +
           " was begun with other settings of the simulated participant; use those or another "
           "database");
  }
  const RunEnd end = latest_run_end(*db, known->id);
  const bool withdrawn = end == RunEnd::withdrawn && !info.after_withdrawal;
  if (end == RunEnd::done || withdrawn || end == RunEnd::running) {
    refuse(name + " is " + to_string(end) + " and cannot be begun again");
  }
  return known->id;
}

std::optional<std::int64_t> Store::Impl::other_protocol(const Participant& participant,
                                                        std::int64_t own,
                                                        const ProtocolInfo* shown_with) {
  if (shown_with == nullptr) return std::nullopt;
  const std::int64_t shown = insert_protocol_if_absent(*db, path, *shown_with);
  const std::string files = files_checksum(*db, own);
  if (!files.empty() && files_checksum(*db, shown) != files) {
    refuse("the files that the protocol names differ from those with which participant " +
           participant.code + " began; restore them");
  }
  return shown != own ? std::optional(shown) : std::nullopt;
}

Run Store::begin_run(const Participant& participant, const RunInfo& info,
                     const ProtocolInfo* shown_with) {
  validate_run(participant, info);
  if (shown_with != nullptr) {
    Validator validator;
    validate(validator, *shown_with);
    validator.throw_if_invalid(impl_->path + ": protocol");
  }
  return impl_->commit([&] {
    SQLite::Database& db = *impl_->db;
    Run run{.session = info.session};
    run.session_id = impl_->resume_or_create_session(participant, info);
    const std::int64_t own = protocol_of(db, participant.id);
    const auto other = impl_->other_protocol(participant, own, shown_with);
    run.id = insert_run(db, run.session_id, info, other, files_checksum(db, other.value_or(own)));
    impl_->seals->run(run.id);
    return run;
  });
}

void Store::validate_note(const std::string& note) const {
  Validator validator;
  validator.present("note", note);
  validator.throw_if_invalid(impl_->path + ": note");
}

void Store::add_note(const Run& run, std::int64_t at_ns, const std::string& text) {
  validate_note(text);
  impl_->commit([&] {
    SQLite::Statement add(*impl_->db, "INSERT INTO notes (run_id, at_ns, text) VALUES (?, ?, ?)");
    Binder(add) << run.id << at_ns << text;
    add.exec();
    impl_->seals->note(impl_->db->getLastInsertRowid());
    return true;
  });
}

void Store::unmask(const std::string& person, const std::string& program_version,
                   std::int64_t utc_ns) {
  constexpr std::size_t kLongest = 200;  // bytes
  if (person.empty() || person.size() > kLongest || !is_plain_utf8(person))
    impl_->refuse("expected the name of who unmasks the groups: 1 to " + std::to_string(kLongest) +
                  " bytes of UTF-8 without control characters");
  impl_->commit([&] {
    std::set<std::string> codes;
    for (const ProtocolInfo& protocol : protocols()) {
      if (!read_stored_protocol(protocol.text).groups.masked()) continue;
      SQLite::Statement find(*impl_->db,
                             "SELECT DISTINCT pa.code FROM participants pa JOIN protocols pr ON "
                             "pr.id = pa.protocol_id JOIN sessions s ON s.participant_id = pa.id "
                             "JOIN attempts a ON a.session_id = s.id WHERE pr.sha256 = ? AND "
                             "a.state = 'completed'");
      Binder(find) << protocol.sha256;
      while (find.executeStep()) codes.insert(find.getColumn(0).getString());
    }
    write_unmasking(*impl_->db, impl_->path,
                    {utc_ns, person, program_version, static_cast<int>(codes.size())});
    return true;
  });
}

void Store::end_run(const Run& run, RunEnd reason, std::int64_t ended_ns) {
  if (reason == RunEnd::running || reason == RunEnd::interrupted) {
    impl_->refuse(std::string("a run cannot end as ") + to_string(reason));
  }
  impl_->commit([&] {
    impl_->require_running(run);
    cut_off_open_attempt(*impl_->db, *impl_->seals, run,
                         std::string("the session was ended: ") + to_string(reason));
    SQLite::Statement update(*impl_->db,
                             "UPDATE runs SET end_reason = ?, ended_ns = ? WHERE id = ?");
    Binder(update) << to_string(reason) << ended_ns << run.id;
    update.exec();
    impl_->seals->end(run.id);
    return true;
  });
}

}  // namespace palpate::data
