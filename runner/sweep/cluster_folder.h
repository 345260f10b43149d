#pragma once
// The folder of a job on a cluster: inputs, parts and scripts.

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "protocols/protocol.h"
#include "runner/sweep/cluster_job.h"

namespace palpate::runner::sweep {

/// The file of a shard, from 1.
std::filesystem::path part_of(const std::filesystem::path& folder, const ClusterJob& job,
                              std::int64_t shard);
/// Units in a shard's file.
std::int64_t recorded_in(const ClusterJob& job, const std::string& path);
/// Units in the merged file; 0: there is none yet. A plan has no such file and needs none.
/// \throws data::StoreRefused
std::int64_t merged_units(const std::filesystem::path& folder, const ClusterJob& job);

/// Copies the inputs of the tasks, so that the originals may change while they run: the protocol
/// with the files that it names, and others. \return paths of the copies of protocol and others, in
/// order. \throws UsageError: the protocol names a file by an absolute path
std::vector<std::string> copy_inputs(const std::filesystem::path& folder,
                                     const protocols::Protocol& protocol,
                                     const std::vector<std::string>& others);

/// \throws UsageError: other users may change what would run under this account
void require_own_scripts(const std::filesystem::path& folder);

}  // namespace palpate::runner::sweep
