#pragma once
// Internal to data/: the SQL columns of a participant, a run and a trial, each list beside the
// function that reads it, in the same order.

#include <SQLiteCpp/Database.h>

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "data/record.h"
#include "data/store/statement.h"
#include "data/store/store.h"

namespace palpate::data {

/// Validates values read from a file that may be damaged or edited. Together with RowReader, which
/// refuses NULL and booleans other than 0 and 1, these are all of the table's CHECK constraints on
/// an attempt. SQLite's quick_check takes twice as long for them, and skips them on a read-only
/// disk.
/// \throws SQLite::Exception (damage), naming participant, session, trial and field.
void require_valid_run(const StoredTrial& trial);
void require_valid_record(const StoredTrial& trial);

// Aliases: pr protocols, pa participants, s sessions, r runs, a attempts.
std::string person_columns(int version);  ///< of the schema
RowReader& operator>>(RowReader& row, Participant& person);

std::string run_columns(int version);
RowReader& operator>>(RowReader& row, RunInfo& info);

/// \throws SQLite::Exception (damage)
RunEnd run_end_of(const std::string& text);

/// The sealed values of a session: participant, protocol and number.
struct SessionHead {
  std::int64_t id = 0, protocol_id = 0;
  std::string protocol_name, protocol_sha256;
  Participant participant;
  int number = 1;
  std::string observer_sha256;
};
/// \throws SQLite::Exception: there is none.
SessionHead read_session_head(SQLite::Database& db, std::int64_t id, int version);

inline constexpr const char* kPlanColumns =
    "a.id, a.block, a.trial, a.attempt, a.renderer, a.shape, a.practice, "
    "a.orientation_w, a.orientation_x, a.orientation_y, a.orientation_z, a.began_ns";
/// Reads kPlanColumns into every field of a plan but the session. Until read_outcome sets it,
/// onset_ns is the start of the attempt. \return the row id of the attempt
std::int64_t read_plan(RowReader& row, TrialRecord& record);

/// The column that read_task reads.
const char* task_column(int version);
/// \throws SQLite::Exception (damage)
void read_task(RowReader& row, TrialRecord& record);

std::string outcome_columns(int version);  ///< of the schema
/// After read_task.
void read_outcome(RowReader& row, TrialRecord& record);

/// p: page_answers. Read by operator>>.
inline constexpr const char* kPageAnswerColumns =
    "p.page, p.item, p.version, p.text_sha256, p.answer, p.at_ns";
RowReader& operator>>(RowReader& row, PageAnswer& answer);

// CROSS JOIN fixes SQLite's join order (https://www.sqlite.org/optoverview.html, 7.3): each level
// is read in the order of its index, without sorting in memory or in a temporary file.
inline constexpr const char* kFromProtocolDown =
    " FROM protocols pr CROSS JOIN participants pa ON pa.protocol_id = pr.id CROSS JOIN sessions s "
    "ON s.participant_id = pa.id ";

/// Collects the faults of one record before it is written, so that a caller learns every fault at
/// once instead of SQLite's first failed CHECK. Every writing call of Store uses it.
class Validator {
 public:
  /// Text that SQLite and CSV return unchanged: UTF-8 without NUL.
  void text(const char* field, std::string_view value);
  void present(const char* field, std::string_view value);  ///< text, and not empty
  void finite(const char* field, double value);
  void amount(const char* field, double value);  ///< finite, and not below zero
  void positive(const char* field, int value);
  void expect(bool holds, const std::string& expectation);
  /// \throws StoreRefused with all faults. \param what is validated: "PATH: trial 3"
  void throw_if_invalid(const std::string& what) const;

 private:
  std::vector<std::string> faults_;
};

bool is_clean_utf8(std::string_view text);  ///< well-formed, and no NUL; also of what is read

void validate(Validator& validator, const ProtocolInfo& protocol);
void validate(Validator& validator, const RunInfo& info, bool simulated);
/// Fields known before the trial is shown.
void validate_plan(Validator& validator, const TrialRecord& record, int session);
void validate(Validator& validator, const PageAnswer& answer);
/// Fields known after it has ended.
void validate_outcome(Validator& validator, const TrialRecord& record);

}  // namespace palpate::data
