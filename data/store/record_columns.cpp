#include "data/store/record_columns.h"

#include <SQLiteCpp/Exception.h>
#include <SQLiteCpp/Statement.h>
#include <sqlite3.h>

#include <charconv>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <limits>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>

#include "data/base/checksum.h"
#include "data/base/utf8.h"
#include "data/errors.h"
#include "data/store/task_text.h"
#include "data/trial_columns.h"

namespace palpate::data {
namespace {

[[noreturn]] void throw_damaged(const StoredTrial& trial, const char* field, const char* what) {
  throw SQLite::Exception("participant " + trial.participant.code + ", session " +
                              std::to_string(trial.record.session) + ", trial " +
                              std::to_string(trial.record.trial) + ": " + field + " " + what,
                          SQLITE_CORRUPT);
}

void require_text(const StoredTrial& trial, const char* field, const std::string& value) {
  if (!is_clean_utf8(value)) throw_damaged(trial, field, "is not UTF-8 text");
}

void require_count(const StoredTrial& trial, const char* field, int value) {
  if (value < 1) throw_damaged(trial, field, "is not 1 or more");
}

void require_finite(const StoredTrial& trial, const char* field, double value) {
  if (!std::isfinite(value)) throw_damaged(trial, field, "is not a finite number");
}

void require_amount(const StoredTrial& trial, const char* field, double value) {
  require_finite(trial, field, value);
  if (value < 0) throw_damaged(trial, field, "is below zero");
}

/// The value, if it is a real number and present.
std::optional<double> amount_of(const std::optional<double>& value) { return value; }
std::optional<double> amount_of(double value) { return value; }
template <std::integral Whole>
std::optional<double> amount_of(Whole) {
  return std::nullopt;
}

void validate_task(Validator& validator, const TaskRecord& task) {
  validator.present("task", task.task);
  validator.text("block_name", task.block_name);
  validator.expect(is_storable(task), "a task of no block must be identification");
  validator.positive("track", task.track);
  for (const auto& value : {task.level, task.standard_level, task.number, task.confidence}) {
    if (value) validator.finite("a number of the task", *value);
  }
  for (const auto& [name, value] : task.dimensions) {
    validator.present("name of a dimension", name);
    validator.finite("a level", value);
  }
  if (task.reach) {
    const ReachRecord& reach = *task.reach;
    validator.present("kind of a reach", reach.kind);
    for (const auto& value :
         {reach.duration, reach.peak_speed, reach.deviation, reach.largest_deviation,
          reach.path_ratio, reach.endpoint_error, reach.side_force, reach.adaptation}) {
      if (value) validator.finite("a measure of the reach", *value);
    }
  }
  if (task.seen) {
    validator.positive("frames", task.seen->frames);
    for (const double value : {task.seen->lag, task.seen->lag_p99})
      validator.finite("a lag of what was seen", value);
  }
  if (task.heard) {
    validator.positive("knocks", task.heard->knocks);
    validator.finite("a lag of what was heard", task.heard->lag);
  }
  for (const IntervalRecord& interval : task.intervals) {
    validator.text("stimulus", interval.stimulus);
    if (interval.level) validator.finite("level", *interval.level);
  }
}

}  // namespace

void require_valid_run(const StoredTrial& trial) {
  if (!is_participant_code(trial.participant.code)) {
    throw SQLite::Exception("a participant's code is not 1 to 32 letters and digits",
                            SQLITE_CORRUPT);
  }
  require_count(trial, "participant number", trial.participant.number);
  require_count(trial, "session", trial.run.session);
  require_text(trial, "device", trial.run.device);
  require_text(trial, "program version", trial.run.program_version);
  require_text(trial, "observer's checksum", trial.run.observer_sha256);
}

void require_valid_record(const StoredTrial& trial) {
  const TrialRecord& record = trial.record;
  require_count(trial, "block", record.block);
  require_count(trial, "trial", record.trial);
  require_count(trial, "attempt", record.attempt);
  if (record.timed_out && (record.correct || !record.response.empty())) {
    throw_damaged(trial, "time-out", "has a response or is correct");
  }
  require_text(trial, "renderer", record.renderer);
  require_text(trial, "shape", record.shape);
  require_text(trial, "response", record.response);
  require_text(trial, "reason", trial.cut_off_reason);
  for (const double q : record.orientation_wxyz) require_finite(trial, "orientation", q);
  require_amount(trial, "response_time", record.response_time);
  require_amount(trial, "first_contact_time", record.first_contact_time.value_or(0));
  for_each_measured(record, [&](const MeasuredColumn& column, const auto& value) {
    const auto amount = amount_of(value);
    if (!amount) return;
    require_amount(trial, column.name, *amount);
    if (*amount > column.most) throw_damaged(trial, column.name, "is above the possible maximum");
  });
}

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
  try {
    record.task = parse_task_text(text);
  } catch (const std::invalid_argument& error) {
    throw SQLite::Exception(error.what(), SQLITE_CORRUPT);
  }
}

std::string outcome_columns(int version) {
  std::string columns =
      "a.response, a.correct, a.timed_out, a.response_time, a.first_contact_time, "
      "a.onset_ns, a.response_ns, a.start_tip_x, a.start_tip_y, a.start_tip_z, "
      "a.start_tail_x, a.start_tail_y, a.start_tail_z";
  for (const MeasuredColumn& column : kMeasured) {
    columns += column.since > version ? ", NULL" : std::string(", a.") + column.name;
  }
  return columns;
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
  for_each_measured(record, [&](const MeasuredColumn&, auto& value) { row >> value; });
  if (record.task.task == TaskRecord().task) record.task.success = record.correct;
}

bool is_clean_utf8(std::string_view text) {
  while (!text.empty()) {
    const Character c = first_character(text);
    if (!c.well_formed || c.code == 0) return false;
    text.remove_prefix(c.size);
  }
  return true;
}

void Validator::expect(bool holds, const std::string& expectation) {
  if (!holds) faults_.push_back(expectation);
}

void Validator::text(const char* field, std::string_view value) {
  expect(is_clean_utf8(value), std::string(field) + " must be UTF-8 text without NUL");
}

void Validator::present(const char* field, std::string_view value) {
  text(field, value);
  expect(!value.empty(), std::string(field) + " must not be empty");
}

void Validator::amount(const char* field, double value) {
  finite(field, value);
  expect(!(value < 0), std::string(field) + " must not be below zero");
}

void Validator::finite(const char* field, double value) {
  expect(std::isfinite(value), std::string(field) + " must be a finite number");
}

void Validator::positive(const char* field, int value) {
  expect(value >= 1, std::string(field) + " must be 1 or more, not " + std::to_string(value));
}

void Validator::throw_if_invalid(const std::string& what) const {
  if (faults_.empty()) return;
  std::string message = what + ": not stored:";
  for (std::size_t i = 0; i < faults_.size(); ++i) message += (i > 0 ? "; " : " ") + faults_[i];
  throw StoreRefused(message);
}

void validate(Validator& validator, const ProtocolInfo& protocol) {
  validator.present("protocol's name", protocol.name);
  validator.present("protocol's text", protocol.text);
  validator.expect(protocol.sha256 == checksum_hex(protocol.text),
                   "protocol's SHA-256 must be that of its text");
  for (const ProtocolFile& file : protocol.files) validator.present("name of a file", file.name);
}

void validate(Validator& validator, const RunInfo& info, bool simulated) {
  validator.positive("session", info.session);
  validator.present("program version", info.program_version);
  validator.present("device", info.device);
  validator.text("build", info.build);
  validator.text("device calibration", info.device_calibration);
  validator.text("response device", info.response_device);
  validator.text("consent version", info.consent_version);
  validator.text("hand", info.hand);
  validator.text("observer's checksum", info.observer_sha256);
  validator.expect(simulated || info.observer_sha256.empty(),
                   "only a simulated participant has observer settings");
  if (info.response_latency) validator.finite("response latency", *info.response_latency);
}

void validate_plan(Validator& validator, const TrialRecord& record, int session) {
  validator.expect(record.session == session,
                   "session must be the run's, " + std::to_string(session));
  validator.positive("block", record.block);
  validator.positive("trial", record.trial);
  validator.present("renderer", record.renderer);
  validator.present("shape", record.shape);
  for (const double q : record.orientation_wxyz) validator.finite("orientation", q);
}

void validate(Validator& validator, const PageAnswer& answer) {
  validator.present("page", answer.page);
  validator.present("item", answer.item);
  validator.text("version", answer.version);
  validator.text("answer", answer.answer);
  validator.expect(answer.text_sha256.size() == 64, "text_sha256 must be a SHA-256");
}

void validate_outcome(Validator& validator, const TrialRecord& record) {
  constexpr std::uint64_t kMost = std::numeric_limits<std::int64_t>::max();
  validator.text("response", record.response);
  validator.amount("response_time", record.response_time);
  if (record.first_contact_time) validator.amount("first_contact_time", *record.first_contact_time);
  for (int i = 0; i < 3; ++i) {
    validator.finite("start_tip", record.start_tip[i]);
    validator.finite("start_tail", record.start_tail[i]);
  }
  for_each_measured(record, [&](const MeasuredColumn& column, const auto& value) {
    const auto amount = amount_of(value);
    if (!amount) return;
    validator.amount(column.name, *amount);
    std::ostringstream most;
    most << column.name << " must be at most " << column.most;
    validator.expect(!(*amount > column.most), most.str());
  });
  validate_task(validator, record.task);
  validator.expect(record.ticks <= kMost && record.missed_ticks <= kMost, "ticks must fit 63 bits");
  validator.expect(!record.timed_out || (record.response.empty() && !record.correct),
                   "a time-out has no response and is not correct");
}

}  // namespace palpate::data
