#pragma once
// Trials of protocols of version 2: what was asked, at which level, and what was answered.

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "analysis/input/trials.h"
#include "data/record.h"
#include "protocols/tasks/task_plan.h"

namespace palpate::analysis {

/// One completed trial that is not practice.
struct TaskTrial {
  std::string participant, task, block_name, renderer, shape, response;
  std::string track;
  std::optional<double> level, standard_level, number, confidence;
  bool catch_trial = false, success = false, answered = false;
  std::optional<bool> correct;  ///< none: no answer is right or wrong
  int participant_number = 0;   ///< in whose order it was shown; 0: unknown
  int session = 1, block = 1, trial = 1;
  bool timed_out = false, simulated = false;
  int intervals = 0;                    ///< compare: how many; 0: unknown
  std::string protocol_sha256;          ///< "": unknown
  std::optional<double> response_time;  ///< s; none: not in the source
};

struct TaskTable {
  std::string source;             ///< path as the user gave it
  std::vector<TaskTrial> trials;  ///< in the order of the source
  std::size_t n_practice = 0;     ///< left out
  bool simulated = false;         ///< some of them
  Provenance provenance;          ///< of all of them
  std::string title;              ///< of the study, as its protocol says it; "": unknown
  std::vector<std::string> warnings;
  /// Whose trials they are: name and SHA-256, each once.
  std::vector<std::pair<std::string, std::string>> protocols;
  /// How levels were chosen, by SHA-256 of the protocol and name of the block: of databases.
  std::map<std::string, std::map<std::string, protocols::BlockProcedures>> procedures;
};

/// Whether a CSV file has a column "task" (an export of a study of version 2).
bool has_task_column(const std::string& path);

/// Reads an export of trials. Needs participant_id, task, renderer and shape; of level,
/// standard_level, success, number, confidence, ... what is there. \param protocol  name of the
/// protocol whose trials are read, or six or more digits that its SHA-256 begins with; "": all.
/// \throws protocols::InputError with every fault.
TaskTable read_task_trials_csv(const std::string& path, const std::string& protocol = "");

/// The trials of identification without catch trials and levels as those of a study of version 1;
/// nullopt: there are none, or their times or places are not in the source.
std::optional<TrialTable> identification_of(const TaskTable& table);

/// Whether a database holds a protocol of version 2. \throws what data::Store::open throws.
bool has_tasks(const std::string& database);
/// A completed trial as it is stored.
TaskTrial task_trial_of(const std::string& participant, const data::TrialRecord& record);
/// Reads the completed trials of a database. \throws protocols::InputError if there are none, and
/// what data::Store::open throws. \param protocol  as above
TaskTable read_task_trials_store(const std::string& path, const std::string& protocol = "");

/// Whether a protocol is the one that is named by its name or what its SHA-256 begins with.
bool is_protocol(const std::string& wanted, const std::string& name, const std::string& sha256);

}  // namespace palpate::analysis
