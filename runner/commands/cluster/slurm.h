#pragma once
// Slurm through its own commands: sbatch, squeue. No library, so that any version does.

#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace palpate::runner {

/// A word of a shell's command line.
std::string shell_quoted(const std::string& text);

/// "1-64", "3,7,9-12": ascending numbers as --array takes them.
std::string array_text(const std::vector<std::int64_t>& tasks);

/// Runs sbatch with --parsable. \return the job's number. \throws std::runtime_error with what
/// sbatch says, also where there is none
std::string submit(const std::vector<std::string>& arguments);

/// States of the array's tasks that are in the queue, by number: PENDING, RUNNING, ... Empty where
/// the job has ended. \throws std::runtime_error: no squeue, or it failed
std::map<std::int64_t, std::string> queue_states(const std::string& job);

}  // namespace palpate::runner
