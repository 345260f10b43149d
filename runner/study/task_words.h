#pragma once
// A block of tasks in words, and a run of a session with answers by chance: for `validate` and
// `schedule`.

#include <cstdint>
#include <string>
#include <vector>

#include "protocols/protocol.h"
#include "protocols/schedule.h"
#include "protocols/session_plan.h"
#include "runner/usage_error.h"

namespace palpate::runner::study {

// The columns of a schedule: those of an exported trials.csv that are known before the response.

inline std::vector<std::string> schedule_columns() {
  return {"participant_id", "session",         "block",          "trial",         "renderer",
          "shape",          "orientation_w",   "orientation_x",  "orientation_y", "orientation_z",
          "practice",       "protocol_sha256", "program_version"};
}

/// \param row  a CsvText or a data::ColumnTable. \param participant  number
template <class Row>
void put_scheduled(Row& row, const protocols::Protocol& protocol, const protocols::Trial& trial,
                   int participant) {
  const Quat& q = trial.orientation;
  row << participant << trial.session << trial.block << trial.trial
      << protocols::to_string(trial.renderer)
      << protocol.stimuli[static_cast<std::size_t>(trial.stimulus)].name << q.w << q.x << q.y << q.z
      << trial.practice << protocol.sha256 << PALPATE_VERSION;
  row.end_row();
}

/// \throws UsageError
inline void check_participant_number(int participant) {
  if (participant < 1)
    throw UsageError("--participant: expected 1 or more, found " + std::to_string(participant));
}

/// "young, older: in turn by participant number"; "": no groups
std::string groups_in_words(const protocols::Protocol& protocol);

// The schedule of a protocol of version 2, printed.

/// \param participant  number. \param format  table, csv or json
std::string task_schedule_text(const protocols::Protocol& protocol, int participant,
                               const std::string& format);

/// "staircase, 2 down 1 up, from 500 within 300 to 600, ..."
std::string in_words(const protocols::ProcedureSpec& procedure);
/// Contents of a block and the choice of its levels, in one or more lines, without indentation.
std::vector<std::string> in_words(const protocols::Protocol& protocol,
                                  const protocols::TaskBlock& block);

/// Parts of a protocol of version 2 that the eight buttons of a device cannot answer, so that a
/// session with --buttons needs a keyboard: "numbers of 'estimate'", ...
std::vector<std::string> keyboard_parts(const protocols::Protocol& protocol);

/// Position of the interval compared with the standard, from 1; 0: none.
int comparison_interval(const protocols::TaskBlock& block, const protocols::Trial& trial);

/// How well the procedures of a protocol find a known threshold, for `schedule --recover`.
/// A line for each procedure: its target, bias and spread over the simulated participants.
/// \param format  table, csv or json
std::string recovery_text(const protocols::Protocol& protocol, int participants, std::uint64_t seed,
                          const std::string& format);

}  // namespace palpate::runner::study
