#pragma once
// A protocol in a few lines, as `palpate validate` prints it, and the trials of a participant in
// order, as `palpate schedule` does.

#include <string>
#include <vector>

#include "protocols/protocol.h"
#include "protocols/schedule.h"
#include "runner/usage_error.h"

namespace palpate::runner::study {

/// The columns of a schedule: those of an exported trials.csv that are known before the response.
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

/// Position of the interval compared with the standard, from 1; 0: none.
int comparison_interval(const protocols::TaskBlock& block, const protocols::Trial& trial);

std::string summary_text(const protocols::Protocol& protocol);

/// Trials of adaptive blocks are an example: those of a participant whose threshold is in the
/// middle of the levels.
/// \param participant  number. \param format  table, csv or json
std::string schedule_text(const protocols::Protocol& protocol, int participant,
                          const std::string& format);

}  // namespace palpate::runner::study
