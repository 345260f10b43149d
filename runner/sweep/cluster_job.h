#pragma once
// A folder of 'palpate cluster': its work and its number of shards.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace palpate::runner::sweep {

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

void write_job(const std::filesystem::path& folder, const ClusterJob& job);
/// \throws protocols::InputError with every fault: the file was not written by write_job
ClusterJob read_job(const std::filesystem::path& folder);
ClusterJob parse_job(const std::string& text, const std::string& path);

}  // namespace palpate::runner::sweep
