#pragma once
// Slurm through its own commands, sbatch and squeue, without a library: works with any version.

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace palpate::runner::sweep {

/// "1-64", "3,7,9-12": ascending numbers as --array takes them.
std::string array_text(const std::vector<std::int64_t>& tasks);

/// Runs sbatch with --parsable. \return the job's number. \throws std::runtime_error with sbatch's
/// message, also if there is no sbatch
std::string submit(const std::vector<std::string>& arguments);

/// States of the array's tasks in the queue, by number: PENDING, RUNNING, ... Empty if the job has
/// ended. \throws std::runtime_error: no squeue, or it failed
std::map<std::int64_t, std::string> queue_states(const std::string& job);

}  // namespace palpate::runner::sweep
