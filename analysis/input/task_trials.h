#pragma once
// Trials of protocols of version 2: what was asked, at which level, and what was answered.

#include <optional>
#include <string>
#include <vector>

#include "analysis/input/trials.h"

namespace palpate::analysis {

/// One completed trial that is not practice.
struct TaskTrial {
  std::string participant, task, block_name, renderer, shape, response;
  std::string track;
  std::optional<double> level, standard_level, number, confidence;
  bool catch_trial = false, success = false, correct = false, answered = false;
  int session = 1, block = 1, trial = 1;
  bool timed_out = false, simulated = false;
  std::optional<double> response_time;  ///< s; none: not in the source
};

struct TaskTable {
  std::string source;             ///< path as the user gave it
  std::vector<TaskTrial> trials;  ///< in the order of the source
  std::size_t n_practice = 0;     ///< left out
  bool simulated = false;         ///< some of them
  Provenance provenance;          ///< of all of them
};

/// Whether a CSV file has a column "task" (an export of a study of version 2).
bool has_task_column(const std::string& path);

/// Reads an export of trials. Needs participant_id, task, renderer and shape; of level,
/// standard_level, success, number, confidence, ... what is there. \throws protocols::InputError
/// with every fault.
TaskTable read_task_trials_csv(const std::string& path);

/// The trials of identification without catch trials and levels as those of a study of version 1;
/// nullopt: there are none, or their times or places are not in the source.
std::optional<TrialTable> identification_of(const TaskTable& table);

/// Whether a database holds a protocol of version 2. \throws what data::Store::open throws.
bool has_tasks(const std::string& database);
/// Reads the completed trials of a database. \throws protocols::InputError if there are none, and
/// what data::Store::open throws.
TaskTable read_task_trials_store(const std::string& path);

}  // namespace palpate::analysis
