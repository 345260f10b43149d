#pragma once
// Trials of protocols of version 2: task, level and answer.

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "analysis/input/study_record.h"
#include "analysis/input/trials.h"
#include "data/record.h"
#include "data/store/participant_columns.h"
#include "protocols/tasks/task_plan.h"

namespace palpate::analysis {

/// One completed trial that is not practice.
struct TaskTrial {
  std::string participant, task, block_name, renderer, shape, response;
  std::string track;
  std::optional<double> level, standard_level, number, confidence;
  bool catch_trial = false, success = false, answered = false;
  std::optional<bool> correct;  ///< none: no answer is right or wrong
  int participant_number = 0;   ///< orders the trials; 0: unknown
  int session = 1, block = 1, trial = 1;
  bool timed_out = false, simulated = false;
  int intervals = 0;                    ///< compare: number of intervals; 0: unknown
  std::string protocol_sha256;          ///< "": unknown
  std::optional<double> response_time;  ///< s; none: not in the source
};

struct TaskTable {
  std::string source;             ///< path as the user gave it
  std::vector<TaskTrial> trials;  ///< in the order of the source
  std::size_t n_practice = 0;     ///< left out
  bool simulated = false;         ///< some participants are simulated
  Provenance provenance;          ///< of all trials
  std::string title;              ///< of the study, from its protocol; "": unknown
  std::vector<std::string> warnings;
  /// Answers that describe the participants of these trials; from databases only.
  std::vector<data::ParticipantColumn> people;
  /// Their protocols: name and SHA-256, each once.
  std::vector<std::pair<std::string, std::string>> protocols;
  /// The procedures, by SHA-256 of the protocol and name of the block; of a table only if its
  /// protocols were given.
  std::map<std::string, std::map<std::string, protocols::BlockProcedures>> procedures;
};

/// Whether the rows of a CSV file are of tasks: an export of a study of version 2, which may have
/// rows of version 1. \param protocol  the one that is wanted (is_protocol)
bool has_task_trials(const std::string& path, const std::string& protocol = "");

/// Reads an export of trials. Needs participant_id, task, renderer and shape; level,
/// standard_level, success, number, confidence, ... are optional. \param protocol  name of the
/// protocol to read, or the first six or more digits of its SHA-256; "": all.
/// \throws protocols::InputError with every fault.
/// \param protocols  of the study, with their texts: their names and procedures belong to the
/// trials, as in a database
TaskTable read_task_trials_csv(const std::string& path, const std::string& protocol = "",
                               const std::vector<ProtocolText>& protocols = {});

/// Converts trials of identification without catch trials and levels to those of version 1;
/// nullopt: there are none, or the source lacks their times or numbers.
std::optional<TrialTable> identification_of(const TaskTable& table);

/// Converts a stored completed trial.
TaskTrial task_trial_of(const std::string& participant, const data::TrialRecord& record);
/// Reads the completed trials of a database. \throws protocols::InputError: there are none; as
/// data::Store::open. \param protocol as above
TaskTable read_task_trials_store(const std::string& path, const std::string& protocol = "");

}  // namespace palpate::analysis
