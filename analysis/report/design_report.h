#pragma once
// The design in reports: effects, means and contrasts of groups and factors.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "analysis/report/tables.h"
#include "analysis/statistics/study_design.h"

namespace palpate::analysis {

/// Adds "design", "by_design" and, by name, "effects.MEASURE[.BLOCK[.STIMULUS]].EFFECT" to the
/// results of a study with groups or factors.
void put_design(const StudyTable& table, const std::vector<GroupedMeasure>& measures,
                nlohmann::ordered_json& out);

std::string design_text(const std::vector<GroupedMeasure>& measures);

/// Means, effects and contrasts of each measure. \param label  "SIMULATED PARTICIPANTS" or empty
std::vector<Table> design_tables(const std::vector<GroupedMeasure>& measures,
                                 const std::string& label);

/// The finding for a headline: the clearest effect, Holm-adjusted over all effects of the factors
/// and of the group, or over those named; "": there are neither. \param tests  empty: all
std::string design_conclusion(const std::vector<GroupedMeasure>& measures,
                              const std::vector<std::string>& tests);

}  // namespace palpate::analysis
