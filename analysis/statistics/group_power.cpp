#include "analysis/statistics/group_power.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "analysis/statistics/mixed_anova.h"
#include "data/base/random.h"

namespace palpate::analysis {
namespace {

/// Participants' mean log times with both renderers, over all shapes.
std::vector<GroupedRow> drawn_means(const StudyModel& model, const GroupEffects& effects,
                                    std::size_t participants, std::size_t trials, Random& random) {
  const double other = std::sqrt(std::max(0.0, 1 - model.correlation * model.correlation));
  const auto shapes = static_cast<double>(std::max<std::size_t>(model.shapes.size(), 1));
  double gain_of_all = 0;
  for (const double ratio : model.log_ratios) gain_of_all += ratio / shapes;
  const double noise =
      model.residual_sd / std::sqrt(static_cast<double>(trials) * model.proportion_used);
  std::vector<GroupedRow> rows;
  for (std::size_t group = 0; group < effects.groups; ++group) {
    const bool differs = group + 1 == effects.groups;
    for (std::size_t i = 0; i < participants; ++i) {
      const double first = random.normal(), second = random.normal(), third = random.normal();
      const double intercept = model.intercept_sd * first + (differs ? effects.between : 0);
      // Gains for single shapes average out over them.
      const double gain =
          gain_of_all + model.gain_sd * (model.correlation * first + other * second) +
          model.shape_gain_sd / std::sqrt(shapes) * third + (differs ? effects.interaction : 0);
      // The random slope stands on the renderer; the effect on both, so that it is no group's.
      const double shift = differs ? effects.interaction / 2 : 0;
      rows.push_back({group,
                      {intercept - shift + noise * random.normal(),
                       intercept - shift + gain + noise * random.normal()}});
    }
  }
  return rows;
}

}  // namespace

GroupPower simulate_group_power(const StudyModel& model, const GroupEffects& effects,
                                std::size_t participants, std::size_t trials,
                                const PowerSettings& settings) {
  GroupPower out{participants, trials, settings.studies, 0, 0};
  for (std::size_t study = 0; study < settings.studies; ++study) {
    Random random(settings.seed, {study, participants, effects.groups});
    const MixedAnova anova = mixed_anova(drawn_means(model, effects, participants, trials, random),
                                         effects.groups, {{"renderer", 2}});
    for (const GroupEffect& effect : anova.effects) {
      const bool found = effect.p && *effect.p < settings.alpha;
      if (effect.name == "group") out.group += found;
      if (effect.name == "group:renderer") out.interaction += found;
    }
  }
  return out;
}

bool reaches(const GroupPower& found, const GroupEffects& effects, double power) {
  return (effects.between == 0 || found.share(found.group) >= power) &&
         (effects.interaction == 0 || found.share(found.interaction) >= power);
}

std::vector<GroupPower> plan_groups(const StudyModel& model, const GroupEffects& effects,
                                    std::size_t least, std::size_t most, std::size_t trials,
                                    double power, const PowerSettings& settings,
                                    const std::function<void(std::size_t)>& simulating) {
  std::map<std::size_t, GroupPower> known;
  const auto enough = [&](std::size_t participants) {
    const auto found = known.find(participants);
    if (found != known.end()) return reaches(found->second, effects, power);
    simulating(participants);
    const GroupPower made = simulate_group_power(model, effects, participants, trials, settings);
    known.emplace(participants, made);
    return reaches(made, effects, power);
  };
  // Twice as many until they are enough, then the border by bisection.
  std::size_t low = least, high = least;
  while (!enough(high) && high < most) {
    low = high;
    high = std::min(most, 2 * high);
  }
  while (high - low > 1) {
    const std::size_t middle = (low + high) / 2;
    (enough(middle) ? high : low) = middle;
  }
  std::vector<GroupPower> out;
  for (const auto& [participants, made] : known) out.push_back(made);
  return out;
}

}  // namespace palpate::analysis
