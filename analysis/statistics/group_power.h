#pragma once
// Power to find that groups of participants differ, by simulation: participants' mean log times are
// drawn from the mixed model and tested by the mixed analysis of variance, as `analyze` does.

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

#include "analysis/statistics/power.h"

namespace palpate::analysis {

/// The effects to be found, natural logs of ratios. The last group differs from all others, which
/// are equal; half of an effect on the gain is in each renderer.
struct GroupEffects {
  std::size_t groups = 2;
  double between = 0;      ///< of the times
  double interaction = 0;  ///< of the gain: renderer minus reference
};

struct GroupPower {
  std::size_t participants = 0;  ///< of each group
  std::size_t trials = 0;        ///< of each participant with each renderer
  std::size_t studies = 0;
  std::size_t group = 0, interaction = 0;  ///< studies with p < alpha

  double share(std::size_t found) const {
    return static_cast<double>(found) / static_cast<double>(studies);
  }
};

/// Study i is drawn from random stream i of the seed. \param participants  of each group, 2 or more
GroupPower simulate_group_power(const StudyModel& model, const GroupEffects& effects,
                                std::size_t participants, std::size_t trials,
                                const PowerSettings& settings);

/// The fewest participants of each group, of least .. most, for which both effects that are above 0
/// are found with this probability, by bisection; the last one tried if none.
/// \return every number that was simulated, ascending
std::vector<GroupPower> plan_groups(const StudyModel& model, const GroupEffects& effects,
                                    std::size_t least, std::size_t most, std::size_t trials,
                                    double power, const PowerSettings& settings,
                                    const std::function<void(std::size_t)>& simulating);

/// Whether both effects that are above 0 are found with this probability.
bool reaches(const GroupPower& found, const GroupEffects& effects, double power);

}  // namespace palpate::analysis
