#include "data/store/record_columns.h"

#include <SQLiteCpp/Exception.h>
#include <SQLiteCpp/Statement.h>
#include <sqlite3.h>

#include <charconv>
#include <optional>
#include <stdexcept>
#include <string>

#include "data/store/task_text.h"

namespace palpate::data {

RunEnd run_end_of(const std::string& text) {
  if (const auto end = parse_run_end(text)) return *end;
  throw SQLite::Exception("a run ends with '" + text + "'", SQLITE_CORRUPT);
}

std::string person_columns(int version) {
  return std::string("pa.id, pa.code, pa.number, ") +
         (version < 3 ? "pa.number"
                      : "coalesce((SELECT enrolled_number FROM renumberings WHERE participant_id = "
                        "pa.id), pa.number)") +
         ", pa.simulated, pa.seed";
}

std::string run_columns(int version) {
  return std::string(
             "s.number, r.started_utc_ns, r.started_ns, r.program_version, r.build, r.device, "
             "r.device_calibration, r.response_device, r.response_latency, s.observer_sha256, "
             "r.consent_version, r.consent_utc_ns, r.hand, ") +
         (version < 3 ? "'', ''"
                      : "coalesce((SELECT sha256 FROM protocols WHERE id = r.protocol_id), ''), "
                        "r.files_sha256");
}

RowReader& operator>>(RowReader& row, Participant& person) {
  std::optional<std::string> seed;
  row >> person.id >> person.code >> person.number >> person.enrolled_number >> person.simulated >>
      seed;
  person.seed.reset();
  if (!seed) return row;
  const char* const end = seed->data() + seed->size();
  const auto [at, error] = std::from_chars(seed->data(), end, person.seed.emplace());
  if (error != std::errc{} || at != end) {
    throw SQLite::Exception("the seed of participant " + person.code + " is not a number",
                            SQLITE_CORRUPT);
  }
  return row;
}

RowReader& operator>>(RowReader& row, RunInfo& info) {
  return row >> info.session >> info.clock.utc_ns >> info.clock.monotonic_ns >>
         info.program_version >> info.build >> info.device >> info.device_calibration >>
         info.response_device >> info.response_latency >> info.observer_sha256 >>
         info.consent_version >> info.consent_utc_ns >> info.hand >> info.protocol_sha256 >>
         info.files_sha256;
}

SessionHead read_session_head(SQLite::Database& db, std::int64_t id, int version) {
  SQLite::Statement find(db, "SELECT s.id, pr.id, pr.name, pr.sha256, " + person_columns(version) +
                                 ", s.number, s.observer_sha256" + kFromProtocolDown +
                                 "WHERE s.id = ?");
  Binder(find) << id;
  if (!find.executeStep())
    throw SQLite::Exception("a session without a participant", SQLITE_CORRUPT);
  SessionHead head;
  RowReader row(find);
  row >> head.id >> head.protocol_id >> head.protocol_name >> head.protocol_sha256;
  row >> head.participant;
  row >> head.number >> head.observer_sha256;
  return head;
}

std::int64_t read_plan(RowReader& row, TrialRecord& record) {
  std::int64_t id = 0;
  row >> id >> record.block >> record.trial >> record.attempt >> record.renderer >> record.shape >>
      record.practice;
  for (double& q : record.orientation_wxyz) row >> q;
  row >> record.onset_ns;
  return id;
}

const char* task_column(int version) { return version < 5 ? "NULL, " : "a.task, "; }

void read_task(RowReader& row, TrialRecord& record) {
  std::optional<std::string> text;
  row >> text;
  record.task.reset();
  if (!text) return;
  try {
    record.task = parse_task_text(*text);
  } catch (const std::invalid_argument& error) {
    throw SQLite::Exception(error.what(), SQLITE_CORRUPT);
  }
}

std::string outcome_columns(int version) {
  return std::string(
             "a.response, a.correct, a.timed_out, a.response_time, a.first_contact_time, "
             "a.onset_ns, a.response_ns, a.start_tip_x, a.start_tip_y, a.start_tip_z, "
             "a.start_tail_x, a.start_tail_y, a.start_tail_z, a.ticks, a.missed_ticks, "
             "a.longest_period_ns, a.faults, a.started_inside, a.max_force, ") +
         (version < 4 ? "NULL, NULL" : "a.contact_share, a.edge_dwell");
}

RowReader& operator>>(RowReader& row, PageAnswer& answer) {
  return row >> answer.page >> answer.item >> answer.version >> answer.text_sha256 >>
         answer.answer >> answer.at_ns;
}

void read_outcome(RowReader& row, TrialRecord& record) {
  row >> record.response >> record.correct >> record.timed_out >> record.response_time >>
      record.first_contact_time >> record.onset_ns >> record.response_ns;
  for (double& x : record.start_tip) row >> x;
  for (double& x : record.start_tail) row >> x;
  row >> record.ticks >> record.missed_ticks >> record.longest_period_ns >> record.faults >>
      record.started_inside >> record.max_force >> record.contact_share >> record.edge_dwell;
}

}  // namespace palpate::data
