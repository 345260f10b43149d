#pragma once
// The group's location and width of psychometric functions, from all answers at once: no function
// is fitted singly, so a participant without errors counts as much as the answers say.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "analysis/statistics/group_model.h"
#include "analysis/statistics/psychometric_fit.h"
#include "protocols/procedures/psychometric.h"

namespace palpate::analysis {

/// Chance of a success at the ends of a function: lapses at both ends (levels on both sides of a
/// standard), guesses at a fixed rate (forced choice), or at a rate of the participant's own
/// (yes/no).
enum class GroupAsymptotes { both_lapse, fixed_guess, own_guess };

struct GroupPsychometricModel {
  protocols::PsychometricFunction function;
  GroupAsymptotes asymptotes = GroupAsymptotes::both_lapse;
  double guess = 0.5;  ///< of a forced choice
  /// Levels on one side of it: the location is the log of the threshold's distance from it.
  std::optional<double> standard;

  /// The location is a level (or its log), not the log of a distance.
  bool location_is_log() const {
    return standard || function.scale != protocols::LevelScale::linear;
  }
};

/// Answers of a participant in a condition; catch trials have no stimulus.
struct GroupAnswers {
  std::vector<LevelCount> counts;
  int catch_trials = 0, catch_successes = 0;

  bool empty() const { return counts.empty(); }
};

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
