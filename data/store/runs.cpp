// Who takes part and which process runs which session.

#include "data/store/attempts.h"
#include "data/store/connection.h"
#include "data/store/protocol_rows.h"
#include "data/store/record_columns.h"
#include "data/store/statement_values.h"
#include "data/store/validation.h"

namespace palpate::data {
void Store::require_sound(const Participant& participant, const RunInfo& info) const {
  Validator checks;
  check(checks, info, participant.simulated);
  checks.raise(impl_->path + ": session of participant " + participant.code);
}

Run Store::begin_run(const Participant& participant, const RunInfo& info,
                     const ProtocolInfo* shown_with) {
  require_sound(participant, info);
  if (shown_with != nullptr) {
    Validator checks;
    check(checks, *shown_with);
    checks.raise(impl_->path + ": protocol");
  }
  return impl_->commit([&] {
    SQLite::Database& db = *impl_->db;
    const std::string name =
        "session " + std::to_string(info.session) + " of participant " + participant.code;
    Run run{.session = info.session};
    SQLite::Statement find(
        db, "SELECT id, observer_sha256 FROM sessions WHERE participant_id = ? AND number = ?");
    Binder(find) << participant.id << info.session;
    if (find.executeStep()) {
      std::string observer;
      RowReader(find) >> run.session_id >> observer;
      if (observer != info.observer_sha256) {
        impl_->refuse(name +
                      " was begun with other settings of the simulated participant; use those or "
                      "another database");
      }
      SQLite::Statement last(
          db, "SELECT end_reason FROM runs WHERE session_id = ? ORDER BY id DESC LIMIT 1");
      Binder(last) << run.session_id;
      const RunEnd end =
          last.executeStep() ? run_end_of(last.getColumn(0).getString()) : RunEnd::paused;
      const bool left = end == RunEnd::withdrawn && !info.after_withdrawal;
      if (end == RunEnd::done || left || end == RunEnd::running) {
        impl_->refuse(name + " is " + to_string(end) + " and cannot be begun again");
      }
    } else {
      SQLite::Statement add(
          db, "INSERT INTO sessions (participant_id, number, observer_sha256) VALUES (?, ?, ?)");
      Binder(add) << participant.id << info.session << info.observer_sha256;
      add.exec();
      run.session_id = db.getLastInsertRowid();
    }
    SQLite::Statement own(db, "SELECT protocol_id FROM participants WHERE id = ?");
    Binder(own) << participant.id;
    own.executeStep();
    const std::int64_t own_protocol = own.getColumn(0).getInt64();
    std::optional<std::int64_t> other_protocol;
    if (shown_with != nullptr) {
      const std::int64_t shown = insert_protocol_if_absent(db, impl_->path, *shown_with);
      if (shown != own_protocol) other_protocol = shown;
      const std::string files = files_checksum(db, own_protocol);
      if (!files.empty() && files_checksum(db, shown) != files) {
        impl_->refuse("the files that the protocol names now are not those that participant " +
                      participant.code + " began with; put them back as they were");
      }
    }
    SQLite::Statement add(
        db,
        "INSERT INTO runs (session_id, started_utc_ns, started_ns, program_version, build, device, "
        "device_calibration, response_device, response_latency, consent_version, consent_utc_ns, "
        "hand, protocol_id, files_sha256, end_reason) VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?, "
        "?, ?, 'running')");
    Binder(add) << run.session_id << info.clock.utc_ns << info.clock.monotonic_ns
                << info.program_version << info.build << info.device << info.device_calibration
                << info.response_device << info.response_latency << info.consent_version
                << info.consent_utc_ns << info.hand << other_protocol
                << files_checksum(db, other_protocol.value_or(own_protocol));
    add.exec();
    run.id = db.getLastInsertRowid();
    impl_->seals->run(run.id);
    return run;
  });
}

void Store::require_sound(const std::string& note) const {
  Validator checks;
  checks.present("note", note);
  checks.raise(impl_->path + ": note");
}

void Store::add_note(const Run& run, std::int64_t at_ns, const std::string& text) {
  require_sound(text);
  impl_->commit([&] {
    SQLite::Statement add(*impl_->db, "INSERT INTO notes (run_id, at_ns, text) VALUES (?, ?, ?)");
    Binder(add) << run.id << at_ns << text;
    add.exec();
    impl_->seals->note(impl_->db->getLastInsertRowid());
    return true;
  });
}

void Store::end_run(const Run& run, RunEnd reason, std::int64_t ended_ns) {
  if (reason == RunEnd::running || reason == RunEnd::interrupted) {
    impl_->refuse(std::string("a run is not ended as ") + to_string(reason));
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
