// Who takes part and which process runs which session.

#include <sqlite3.h>

#include <array>

#include "data/store/checks.h"
#include "data/store/protocol_rows.h"
#include "data/store/store_impl.h"
#include "data/store/tombstones.h"

namespace palpate::data {
namespace {

constexpr std::array<const char*, 6> kRunEnds = {"running", "done",      "paused",
                                                 "aborted", "withdrawn", "interrupted"};

}  // namespace

const char* to_string(RunEnd end) { return kRunEnds.at(static_cast<std::size_t>(end)); }

RunEnd run_end_of(const std::string& text) {
  for (std::size_t i = 0; i < kRunEnds.size(); ++i) {
    if (text == kRunEnds[i]) return static_cast<RunEnd>(i);
  }
  throw SQLite::Exception("a run ends with '" + text + "'", SQLITE_CORRUPT);
}

void cut_off_open_attempt(SQLite::Database& db, SealWriter& seals, const Run& run,
                          const std::string& reason) {
  SQLite::Statement find(db, "SELECT id FROM attempts WHERE run_id = ? AND state = 'running'");
  Binder(find) << run.id;
  if (!find.executeStep()) return;
  const std::int64_t id = find.getColumn(0).getInt64();
  find.reset();
  SQLite::Statement update(
      db, "UPDATE attempts SET state = 'cut_off', cut_off_reason = ? WHERE id = ?");
  Binder(update) << reason << id;
  update.exec();
  seals.attempt(id);
}

namespace {

/// A database that is open, and what it is called in messages.
struct Place {
  SQLite::Database& db;
  const std::string& path;
  [[noreturn]] void refuse(const std::string& why) const { throw StoreRefused(path + ": " + why); }
};

void require_enrollable(const std::string& path, const ProtocolInfo& protocol,
                        const std::string& code, std::optional<int> wanted_number, bool simulated,
                        std::optional<std::uint64_t> seed) {
  Checks checks;
  checks.expect(
      is_participant_code(code),
      "the participant's code must be 1 to 32 letters (A-Z, a-z) and digits, a pseudonym");
  if (wanted_number) checks.positive("the participant's number", *wanted_number);
  checks.expect(simulated || !seed, "only a simulated participant has a seed");
  check(checks, protocol);
  checks.raise(path + ": participant");
}

/// Who is in the protocol under this code. \throws StoreRefused: as somebody else.
std::optional<Participant> enrolled(const Place& in, std::int64_t protocol,
                                    const Participant& wanted, std::optional<int> number) {
  SQLite::Statement find(
      in.db,
      "SELECT id, number, coalesce((SELECT enrolled_number FROM renumberings WHERE "
      "participant_id = id), number), simulated, seed FROM participants WHERE protocol_id = ? "
      "AND code = ?");
  Binder(find) << protocol << wanted.code;
  if (!find.executeStep()) return std::nullopt;
  Participant person = wanted;
  bool was_simulated = false;
  std::optional<std::string> was_seed;
  Row(find) >> person.id >> person.number >> person.enrolled_number >> was_simulated >> was_seed;
  if (number && *number != person.number && *number != person.enrolled_number) {
    in.refuse("participant " + person.code + " has number " + std::to_string(person.number) +
              ", not " + std::to_string(*number) + "; leave the number out to go on");
  }
  if (was_simulated != person.simulated) {
    in.refuse("participant " + person.code + " is " + (was_simulated ? "simulated" : "real") +
              " in this database; use another code or another database");
  }
  const auto text = person.seed ? std::optional(std::to_string(*person.seed)) : std::nullopt;
  if (was_seed != text) {
    in.refuse("participant " + person.code + " was simulated with seed " +
              was_seed.value_or("(none)") + ", not " + text.value_or("(none)") +
              "; use that seed or another database");
  }
  return person;
}

/// The wanted number, or the smallest unused: the counterbalancing has no gaps.
int free_number(const Place& in, std::optional<std::int64_t> protocol, std::optional<int> wanted) {
  SQLite::Statement numbers(
      in.db, "SELECT number, code FROM participants WHERE protocol_id = ? ORDER BY number");
  Binder(numbers) << protocol;
  int next = 1;
  while (numbers.executeStep()) {
    const int number = numbers.getColumn(0).getInt();
    if (wanted == number) {
      in.refuse("number " + std::to_string(number) + " is taken by participant " +
                numbers.getColumn(1).getString() +
                "; leave the number out for the next unused one");
    }
    if (number == next) ++next;
  }
  return wanted.value_or(next);
}

}  // namespace

Participant Store::look_up(const ProtocolInfo& protocol, const std::string& code,
                           std::optional<int> wanted_number, bool simulated,
                           std::optional<std::uint64_t> seed) {
  require_enrollable(impl_->path, protocol, code, wanted_number, simulated, seed);
  return guarded(impl_->path, [&] {
    const Place in{*impl_->db, impl_->path};
    Participant person{.code = code, .simulated = simulated, .seed = seed};
    const auto protocol_id = find_protocol(in.db, in.path, protocol);
    if (protocol_id) {
      if (const auto known = enrolled(in, *protocol_id, person, wanted_number)) return *known;
    }
    if (Tombstones::read(in.db, in.path).holds(code)) {
      in.refuse("the participant with code " + code +
                " has withdrawn; the code is not given again, choose another");
    }
    person.number = person.enrolled_number = free_number(in, protocol_id, wanted_number);
    return person;
  });
}

Participant Store::enrol(const ProtocolInfo& protocol, const std::string& code,
                         std::optional<int> wanted_number, bool simulated,
                         std::optional<std::uint64_t> seed) {
  return impl_->commit([&] {
    SQLite::Database& db = *impl_->db;
    Participant person = look_up(protocol, code, wanted_number, simulated, seed);
    const std::int64_t protocol_id = keep_protocol(db, impl_->path, protocol);
    if (person.id != 0) return person;
    SQLite::Statement add(db,
                          "INSERT INTO participants (protocol_id, code, number, simulated, seed) "
                          "VALUES (?, ?, ?, ?, ?)");
    Binder(add) << protocol_id << code << person.number << simulated
                << (seed ? std::optional(std::to_string(*seed)) : std::nullopt);
    add.exec();
    person.id = db.getLastInsertRowid();
    return person;
  });
}

std::vector<std::string> Store::codes() {
  return guarded(impl_->path, [&] {
    std::vector<std::string> all;
    SQLite::Statement find(*impl_->db,
                           "SELECT code FROM participants GROUP BY code ORDER BY min(id)");
    while (find.executeStep()) all.push_back(find.getColumn(0).getString());
    return all;
  });
}

void Store::require_sound(const Participant& participant, const RunInfo& info) const {
  Checks checks;
  check(checks, info, participant.simulated);
  checks.raise(impl_->path + ": session of participant " + participant.code);
}

Run Store::begin_run(const Participant& participant, const RunInfo& info,
                     const ProtocolInfo* shown_with) {
  require_sound(participant, info);
  if (shown_with != nullptr) {
    Checks checks;
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
      Row(find) >> run.session_id >> observer;
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
      const std::int64_t shown = keep_protocol(db, impl_->path, *shown_with);
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
  Checks checks;
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
