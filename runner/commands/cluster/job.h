#pragma once
// A folder of 'palpate cluster': what is to be done in how many shards, and how far each is.

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "protocols/protocol.h"
#include "runner/commands/plan/plan.h"

namespace palpate::runner {

// The scripts of a plan's shards.

/// As write_scripts, a shard for each number of trials. \param values  as they were parsed
void write_plan_scripts(const std::filesystem::path& folder, const std::vector<std::size_t>& trials,
                        const PlanOptions& options,
                        const boost::program_options::variables_map& values);

// Slurm through its own commands: sbatch, squeue. No library, so that any version does.

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

/// What DIR/cluster.json holds.
struct ClusterJob {
  std::string work;  ///< "sweep", "simulate", "plan"
  std::string unit;  ///< "points", "sessions", "curves": what progress is counted in
  std::int64_t shards = 0;
  std::int64_t items = 0;     ///< that are shared among the shards: points, participants, curves
  std::int64_t per_item = 1;  ///< units of each
  std::vector<std::string> options;  ///< of sbatch
  std::string array_job;             ///< latest one; "": none was submitted
  std::int64_t submitted_s = 0;      ///< since 1970
  std::int64_t done_then = 0;        ///< units on record when it was submitted

  const char* extension() const {
    return work == "sweep" ? ".sweep" : work == "simulate" ? ".db" : ".json";
  }
};

/// How far a shard is, in units.
struct ShardState {
  std::int64_t wanted = 0, recorded = 0;
  bool done() const { return recorded >= wanted; }
};

std::int64_t seconds_since_1970();

void write_job(const std::filesystem::path& folder, const ClusterJob& job);
/// \throws UsageError: it is not what write_job wrote
ClusterJob read_job(const std::filesystem::path& folder);

/// Units in the merged file; 0: there is none yet. A plan has no such file, and none is missing.
/// \throws data::StoreRefused
std::int64_t merged_units(const std::filesystem::path& folder, const ClusterJob& job);

/// By shard, from 1, as its file has it. \throws data::StoreRefused
std::vector<ShardState> shard_states(const std::filesystem::path& folder, const ClusterJob& job);
std::int64_t recorded_units(const std::vector<ShardState>& states);

/// The shards that are not done as an array job, and after them what puts all together; says so on
/// stdout. \throws std::runtime_error with what sbatch says
void submit_shards(const std::filesystem::path& folder, ClusterJob& job);

/// Copies what the tasks read, so that it can change outside while they run: the protocol with the
/// files that it names, and others. \return where the copies of protocol and others are, in order.
/// \throws UsageError: the protocol names a file by a whole path
std::vector<std::string> copy_inputs(const std::filesystem::path& folder,
                                     const protocols::Protocol& protocol,
                                     const std::vector<std::string>& others);

/// Writes shard.sh K, which runs a shard or goes on with it, and finish.sh, which puts the parts
/// together and analyses them. \param command  of a shard, without --jobs, --shard and --db
void write_scripts(const std::filesystem::path& folder, const ClusterJob& job,
                   const std::string& command);
/// \param text  after the first line, which names the shell
void write_script(const std::filesystem::path& path, const std::string& text);

}  // namespace palpate::runner
