#pragma once
// A folder of 'palpate cluster': its work, its number of shards, and the progress of each.

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "protocols/protocol.h"
#include "runner/commands/plan/plan.h"

namespace palpate::runner::commands {

// The scripts of a plan's shards.

/// Like write_scripts, with a shard for each number of trials. \param values  as parsed
void write_plan_scripts(const std::filesystem::path& folder, const std::vector<std::size_t>& trials,
                        const PlanOptions& options,
                        const boost::program_options::variables_map& values);

// Slurm through its own commands, sbatch and squeue, without a library: works with any version.

/// Quotes a word for a shell's command line.
std::string shell_quoted(const std::string& text);

/// "1-64", "3,7,9-12": ascending numbers as --array takes them.
std::string array_text(const std::vector<std::int64_t>& tasks);

/// Runs sbatch with --parsable. \return the job's number. \throws std::runtime_error with sbatch's
/// message, also if there is no sbatch
std::string submit(const std::vector<std::string>& arguments);

/// States of the array's tasks in the queue, by number: PENDING, RUNNING, ... Empty if the job has
/// ended. \throws std::runtime_error: no squeue, or it failed
std::map<std::int64_t, std::string> queue_states(const std::string& job);

/// The contents of DIR/cluster.json.
struct ClusterJob {
  std::string work;  ///< "sweep", "simulate", "plan"
  std::string unit;  ///< "points", "sessions", "curves": the unit of progress
  std::int64_t shards = 0;
  std::int64_t items = 0;            ///< shared among the shards: points, participants, curves
  std::int64_t per_item = 1;         ///< units of each
  std::vector<std::string> options;  ///< of sbatch
  std::string array_job;             ///< latest one; "": none was submitted
  std::int64_t submitted_s = 0;      ///< since 1970
  std::int64_t done_then = 0;        ///< units on record at submission

  const char* extension() const {
    return work == "sweep" ? ".sweep" : work == "simulate" ? ".db" : ".json";
  }
};

/// The progress of a shard, in units.
struct ShardState {
  std::int64_t wanted = 0, recorded = 0;
  bool done() const { return recorded >= wanted; }
};

std::int64_t seconds_since_1970();

void write_job(const std::filesystem::path& folder, const ClusterJob& job);
/// \throws UsageError: the file was not written by write_job
ClusterJob read_job(const std::filesystem::path& folder);

/// Units in the merged file; 0: there is none yet. A plan has no such file and needs none.
/// \throws data::StoreRefused
std::int64_t merged_units(const std::filesystem::path& folder, const ClusterJob& job);

/// By shard, from 1, read from its file. \throws data::StoreRefused
std::vector<ShardState> shard_states(const std::filesystem::path& folder, const ClusterJob& job);
std::int64_t recorded_units(const std::vector<ShardState>& states);

/// Submits the unfinished shards as an array job, followed by the merging job; reports on stdout.
/// \throws std::runtime_error with sbatch's message
void submit_shards(const std::filesystem::path& folder, ClusterJob& job);

/// Copies the inputs of the tasks, so that the originals may change while they run: the protocol
/// with the files that it names, and others. \return paths of the copies of protocol and others, in
/// order. \throws UsageError: the protocol names a file by an absolute path
std::vector<std::string> copy_inputs(const std::filesystem::path& folder,
                                     const protocols::Protocol& protocol,
                                     const std::vector<std::string>& others);

/// Writes shard.sh K, which runs or resumes a shard, and finish.sh, which merges the parts and
/// analyses them. \param command  of a shard, without --jobs, --shard and --db
void write_scripts(const std::filesystem::path& folder, const ClusterJob& job,
                   const std::string& command);
/// \param text  after the first line, which names the shell
void write_script(const std::filesystem::path& path, const std::string& text);

}  // namespace palpate::runner::commands
