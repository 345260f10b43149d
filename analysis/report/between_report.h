#pragma once
// Groups of participants in reports: their effects, means and contrasts.

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "analysis/report/tables.h"
#include "analysis/statistics/study_groups.h"

namespace palpate::analysis {

/// Adds "design", "between_groups" and, by name, "effects.MEASURE[.BLOCK[.STIMULUS]].EFFECT" to the
/// results of a study with groups.
void put_groups(const std::vector<GroupedMeasure>& measures, nlohmann::ordered_json& out);

std::string groups_text(const std::vector<GroupedMeasure>& measures);

/// Means, effects and contrasts of each measure. \param label  "SIMULATED PARTICIPANTS" or empty
std::vector<Table> groups_tables(const std::vector<GroupedMeasure>& measures,
                                 const std::string& label);

/// The finding for a headline: the clearest effect of the group, Holm-adjusted over all effects
/// with the group; "": there are no groups.
std::string groups_conclusion(const std::vector<GroupedMeasure>& measures);

}  // namespace palpate::analysis
