#include "data/store/stored_values.h"

#include <SQLiteCpp/Exception.h>
#include <sqlite3.h>

#include <cmath>
#include <string>

#include "data/store/validation.h"

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
  require_amount(trial, "max_force", record.max_force);
  require_amount(trial, "contact_share", record.contact_share.value_or(0));
  if (record.contact_share.value_or(0) > 1) throw_damaged(trial, "contact_share", "is above 1");
  require_amount(trial, "edge_dwell", record.edge_dwell.value_or(0));
}

}  // namespace palpate::data
