#pragma once
// The group's location and width of psychometric functions, from all answers at once: no function
// is fitted singly, so a participant without errors counts as much as the answers say.

#include <cstddef>
#include <string>
#include <vector>

#include "analysis/statistics/group_answers.h"
#include "analysis/statistics/group_model.h"

namespace palpate::analysis {

/// Steps and room beyond the levels. The coarse one is for simulations.
struct GroupGrid {
  std::size_t locations = 201, widths = 121;
  double beyond = 0.5;  ///< of the range of levels, on both sides
  double floor_parts = 100, width_floor = 0.05;
};
inline constexpr GroupGrid kCoarseGroupGrid{81, 81, 0.25, 53, 0.075};

struct GroupPsychometricData {
  std::string undefined;  ///< reason if there is no model
  GroupData data;
  std::vector<double> lapse_means;  ///< of each setting
  double least_spacing = 0;         ///< of levels on the scale
};

/// \param answers  [condition][participant]
GroupPsychometricData group_psychometric_data(const std::vector<std::vector<GroupAnswers>>& answers,
                                              const GroupPsychometricModel& model,
                                              const GroupGrid& grid = {});

/// The location as a level or distance, in its unit. \param location  as in GroupFit
double group_level(const GroupPsychometricModel& model, double location);

}  // namespace palpate::analysis
