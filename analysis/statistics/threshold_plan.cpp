#include "analysis/statistics/threshold_plan.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "analysis/statistics/between_groups.h"
#include "analysis/statistics/describe.h"
#include "analysis/statistics/group_psychometric.h"
#include "analysis/statistics/group_simulation.h"
#include "analysis/statistics/jobs.h"
#include "analysis/statistics/paired_evidence.h"
#include "analysis/statistics/sensitivity.h"
#include "data/base/random.h"

namespace palpate::analysis {
namespace {

constexpr int kPlanLevels = 7;
constexpr std::size_t kPlanShapes = 4;

/// The difference that a study finds.
struct PlannedOutcome {
  bool determined = false, found = false;
  double estimate = 0;
};

// Functions: the group's model.

/// As many trials at each level as there are; what is left over goes to the first ones.
protocols::ConstantStimuli constant_levels(std::vector<double> levels, std::size_t trials) {
  protocols::ConstantStimuli spec;
  const std::size_t each = std::max<std::size_t>(1, trials / levels.size());
  spec.levels = std::move(levels);
  spec.repetitions = static_cast<int>(each);
  return spec;
}

GroupStudy group_study_of(const ThresholdStudy& study, std::size_t trials) {
  GroupStudy out;
  out.lapse = study.lapse;
  std::vector<double> levels;
  const auto place = [](int i) { return 2.0 * i / (kPlanLevels - 1) - 1; };
  if (study.measure == PlannedMeasure::threshold) {
    out.model.asymptotes = GroupAsymptotes::fixed_guess;
    out.model.function.scale = protocols::LevelScale::log10;
    out.location_sd = study.participant_sd;
    out.location_difference = study.effect;
    out.location_difference_sd = study.effect_sd;
    out.log_width = std::log(study.width);
    for (int i = 0; i < kPlanLevels; ++i)
      levels.push_back(std::exp(place(i) * study.reach * study.width));
  } else {
    const double jnd = study.weber_fraction;  // levels are relative to the standard
    const bool of_pse = study.measure == PlannedMeasure::pse;
    out.location = 1;
    out.location_sd = study.pse_sd * jnd;
    out.location_difference = of_pse ? study.effect * jnd : 0;
    out.location_difference_sd = of_pse ? study.effect_sd * jnd : 0;
    out.log_width = std::log(jnd);
    out.log_width_sd = study.participant_sd;
    out.log_ratio = of_pse ? 0 : study.effect;
    out.log_ratio_sd = of_pse ? 0 : study.effect_sd;
    for (int i = 0; i < kPlanLevels; ++i) levels.push_back(1 + place(i) * study.reach * jnd);
  }
  out.tracks = {constant_levels(std::move(levels), trials)};
  return out;
}

PlannedOutcome outcome_of_functions(const ThresholdStudy& study, const GroupStudy& group,
                                    const std::vector<std::vector<GroupAnswers>>& answers) {
  PlannedOutcome out;
  const GroupPsychometricData data =
      group_psychometric_data(answers, group.model, kCoarseGroupGrid);
  if (!data.undefined.empty()) return out;
  const GroupFit fit = fit_group(data.data, false);
  const bool of_width = study.measure == PlannedMeasure::jnd;
  GroupDifferenceSettings how;
  how.interval = how.interval90 = study.bound.has_value();
  how.open_ends = true;
  const GroupDifference found = compare_group(
      data.data, fit, of_width ? GroupCoordinate::second : GroupCoordinate::first, 0, 1, how);
  if (found.pairs < 3) return out;
  const double unit = study.measure == PlannedMeasure::pse ? study.weber_fraction : 1;
  out.estimate = found.difference / unit;
  out.determined = !(found.low_open && found.high_open);
  out.found = found.p < study.alpha;
  if (study.bound) {
    out.found = found.ci90 && !found.low_open && !found.high_open &&
                found.ci90->low > -*study.bound * unit && found.ci90->high < *study.bound * unit;
  }
  return out;
}

// Shares, ratings, exponents and movements: the t-test of participants' differences.

PlannedOutcome outcome_of_differences(const ThresholdStudy& study,
                                      const std::vector<double>& differences) {
  PlannedOutcome out;
  const TTest test = t_test(differences);
  if (differences.empty()) return out;
  out.estimate = mean(differences);
  out.determined = test.p.has_value();
  if (!test.p) return out;
  out.found =
      study.bound ? *equivalence(differences, *study.bound).p < 0.05 : *test.p < study.alpha;
  return out;
}

double logit(double share) { return std::log(share / (1 - share)); }

/// The expected share at given log odds over participants, by the trapezoid rule.
double expected_share(double middle, double sd) {
  double sum = 0, weights = 0;
  for (int i = -40; i <= 40; ++i) {
    const double z = i / 8.0, weight = std::exp(-0.5 * z * z);
    sum += weight / (1 + std::exp(-(middle + sd * z)));
    weights += weight;
  }
  return sum / weights;
}

double share_difference(const ThresholdStudy& study, double shift, std::size_t trials,
                        Random& random) {
  const double level = logit(study.accuracy) + study.participant_sd * random.normal();
  const double own = study.effect_sd * random.normal();
  const std::size_t each = std::max<std::size_t>(1, trials / kPlanShapes);
  double difference = 0;
  for (std::size_t shape = 0; shape < kPlanShapes; ++shape) {
    for (const bool second : {false, true}) {
      const double log_odds = level + (second ? shift + own / 2 : -own / 2);
      const double p = 1 / (1 + std::exp(-log_odds));
      double correct = 0;
      for (std::size_t i = 0; i < each; ++i) correct += random.unit() < p ? 1 : 0;
      difference += (second ? 1 : -1) * correct / static_cast<double>(each * kPlanShapes);
    }
  }
  return difference;
}

double rating_difference(const ThresholdStudy& study, std::size_t trials, Random& random) {
  const double level = 4 + study.participant_sd * random.normal();
  const double own = study.effect + study.effect_sd * random.normal();
  double difference = 0;
  for (const bool second : {false, true}) {
    for (std::size_t i = 0; i < trials; ++i) {
      const double felt = level + (second ? own / 2 : -own / 2) + study.rating_sd * random.normal();
      difference +=
          (second ? 1 : -1) * std::clamp(std::round(felt), 1.0, 7.0) / static_cast<double>(trials);
    }
  }
  return difference;
}

/// Difference of log exponents as lines are fitted to the participant's numbers.
double exponent_difference(const ThresholdStudy& study, std::size_t trials, Random& random) {
  const double each = std::max(1.0, std::floor(static_cast<double>(trials) / kPlanLevels));
  double squares = 0;  // of the log levels
  for (int i = 0; i < kPlanLevels; ++i) {
    const double place = (i / (kPlanLevels - 1.0) - 0.5) * std::log(10.0);
    squares += place * place;
  }
  const double slope_sd = study.number_sd / std::sqrt(each * squares);
  const double level = std::log(kTypicalExponent) + study.participant_sd * random.normal();
  const double own = study.effect + study.effect_sd * random.normal();
  double difference = 0;
  for (const bool second : {false, true}) {
    const double slope =
        std::exp(level + (second ? own / 2 : -own / 2)) + slope_sd * random.normal();
    difference += (second ? 1 : -1) * std::log(std::max(slope, 1e-3));
  }
  return difference;
}

/// A participant's difference between the conditions; without two of them the mean over the trials.
/// \param group  of the participant
double movement_figure(const ThresholdStudy& study, std::size_t trials, std::size_t group,
                       Random& random) {
  const bool paired = study.contrast == PlannedContrast::conditions;
  const double own = (paired ? study.effect_sd : study.participant_sd) * random.normal();
  const double effect = study.contrast == PlannedContrast::groups && group == 0 ? 0 : study.effect;
  const double means = paired ? 2 : 1;  // of which the figure is made
  const double error = study.movement_sd * std::sqrt(means / static_cast<double>(trials));
  return effect + own + error * random.normal();
}

/// As the analysis of variance of the group of participants.
PlannedOutcome outcome_of_groups(const ThresholdStudy& study, const std::vector<double>& figures) {
  std::vector<GroupedFigures> participants;
  for (std::size_t i = 0; i < figures.size(); ++i)
    participants.push_back({std::to_string(i), planned_group(i + 1), {figures[i]}});
  const BetweenGroups found = compare_groups(participants, 2, {{"renderer", 1}});
  PlannedOutcome out;
  for (const GroupContrast& one : found.contrasts) {
    if (one.estimate) out.estimate = *one.estimate;
  }
  for (const GroupEffect& one : found.anova.effects) {
    if (one.name != "group" || !one.p) continue;
    out.determined = true;
    out.found = *one.p < study.alpha;
  }
  return out;
}

bool is_of_differences(PlannedMeasure measure) {
  return measure == PlannedMeasure::accuracy || measure == PlannedMeasure::rating ||
         measure == PlannedMeasure::exponent || is_of_reaching(measure);
}

double difference_of(const ThresholdStudy& study, double shift, std::size_t trials,
                     std::size_t number, Random& random) {
  switch (study.measure) {
    case PlannedMeasure::accuracy:
      return share_difference(study, shift, trials, random);
    case PlannedMeasure::rating:
      return rating_difference(study, trials, random);
    case PlannedMeasure::exponent:
      return exponent_difference(study, trials, random);
    default:
      return movement_figure(study, trials, planned_group(number), random);
  }
}

/// Outcomes of a study for each number of participants.
std::vector<PlannedOutcome> outcomes_of(const ThresholdStudy& study, std::size_t trials,
                                        const std::vector<std::size_t>& participants,
                                        std::uint64_t seed, std::size_t number) {
  std::vector<PlannedOutcome> out;
  const std::size_t most = participants.back();
  if (is_of_differences(study.measure)) {
    const bool of_shares = study.measure == PlannedMeasure::accuracy;
    const double shift = of_shares ? log_odds_effect(study) : 0;
    std::vector<double> differences;
    for (std::size_t i = 0; i < most; ++i) {
      Random random(seed, {0x7a, trials, number, i});
      differences.push_back(difference_of(study, shift, trials, i + 1, random));
    }
    for (const std::size_t n : participants) {
      const std::vector<double> some(differences.begin(),
                                     differences.begin() + static_cast<std::ptrdiff_t>(n));
      out.push_back(study.contrast == PlannedContrast::groups
                        ? outcome_of_groups(study, some)
                        : outcome_of_differences(study, some));
    }
    return out;
  }
  GroupStudy group = group_study_of(study, trials);
  group.participants = most;
  const auto all = simulated_answers(group, seed, number);
  for (const std::size_t n : participants) {
    std::vector<std::vector<GroupAnswers>> some;
    some.reserve(all.size());
    for (const auto& condition : all)
      some.emplace_back(condition.begin(), condition.begin() + static_cast<std::ptrdiff_t>(n));
    out.push_back(outcome_of_functions(study, group, some));
  }
  return out;
}

ThresholdPower power_of(const ThresholdStudy& study, std::size_t trials, std::size_t participants,
                        const std::vector<PlannedOutcome>& outcomes) {
  ThresholdPower out;
  out.trials = trials;
  out.participants = participants;
  out.studies = outcomes.size();
  double error = 0, determined = 0;
  for (const PlannedOutcome& one : outcomes) {
    // A difference in the wrong direction is no finding.
    const bool right = study.bound || study.effect == 0 || (one.estimate < 0) == (study.effect < 0);
    out.found += one.determined && one.found && right ? 1 : 0;
    out.undetermined += one.determined ? 0 : 1;
    if (!one.determined) continue;
    determined += 1;
    error += one.estimate - study.effect;
  }
  out.bias = determined > 0 ? error / determined : 0;
  const auto n = static_cast<double>(out.studies);
  out.power = static_cast<double>(out.found) / n;
  out.se = std::sqrt(out.power * (1 - out.power) / n);
  out.ci95 = wilson_interval(out.found, out.studies);
  return out;
}

}  // namespace

bool is_of_reaching(PlannedMeasure measure) {
  return measure == PlannedMeasure::deviation || measure == PlannedMeasure::aftereffect ||
         measure == PlannedMeasure::adaptation;
}

double log_odds_effect(const ThresholdStudy& study) {
  const double first = logit(study.accuracy);
  const double sd = std::hypot(study.participant_sd, study.effect_sd / 2);
  const double want = expected_share(first, sd) + study.effect;
  double low = -20, high = 20;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (expected_share(middle, sd) < want ? low : high) = middle;
  }
  return 0.5 * (low + high) - first;
}

ThresholdPlan plan_thresholds(const ThresholdStudy& study, ThresholdPlanSettings settings) {
  ThresholdPlan plan{study, std::move(settings), {}};
  const ThresholdPlanSettings& asked = plan.settings;
  const std::size_t all = asked.trials.size() * asked.studies;
  std::vector<std::vector<PlannedOutcome>> outcomes(all);
  do_jobs(
      all, asked.jobs,
      [&](std::size_t i) {
        outcomes[i] = outcomes_of(study, asked.trials[i / asked.studies], asked.participants,
                                  asked.seed, i % asked.studies);
      },
      asked.progress);
  for (std::size_t t = 0; t < asked.trials.size(); ++t) {
    for (std::size_t n = 0; n < asked.participants.size(); ++n) {
      std::vector<PlannedOutcome> own;
      for (std::size_t s = 0; s < asked.studies; ++s)
        own.push_back(outcomes[t * asked.studies + s][n]);
      plan.powers.push_back(power_of(study, asked.trials[t], asked.participants[n], own));
    }
  }
  return plan;
}

}  // namespace palpate::analysis
