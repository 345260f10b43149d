#pragma once
// How often intervals hold the truth, as text and JSON.

#include <string>
#include <vector>

#include "analysis/statistics/group_simulation.h"
#include "analysis/statistics/interval_coverage.h"

namespace palpate::analysis {

std::string coverage_text(const std::vector<CoverageResult>& results,
                          const CoverageSettings& settings);
std::string group_coverage_text(const std::vector<GroupCoverage>& results,
                                const GroupCoverageSettings& settings);
std::string coverage_json(const std::vector<CoverageResult>& results,
                          const CoverageSettings& settings,
                          const std::vector<GroupCoverage>& groups);

}  // namespace palpate::analysis
