#pragma once
// The scripts of a plan's shards.

#include <filesystem>

#include "runner/commands/plan/options.h"

namespace palpate::runner {

/// As write_scripts, a shard for each number of trials. \param values  as they were parsed
void write_plan_scripts(const std::filesystem::path& folder, const std::vector<std::size_t>& trials,
                        const PlanOptions& options,
                        const boost::program_options::variables_map& values);

}  // namespace palpate::runner
