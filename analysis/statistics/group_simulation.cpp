#include "analysis/statistics/group_simulation.h"

#include <cmath>
#include <map>
#include <utility>

#include "analysis/statistics/evenly.h"
#include "analysis/statistics/group_psychometric.h"
#include "analysis/statistics/jobs.h"
#include "data/base/random.h"
#include "protocols/procedures/procedure.h"

namespace palpate::analysis {
namespace {

constexpr double kLn3 = 1.0986122886681098;

/// Levels on both sides of a standard of 300, JND 30, PSEs with an SD of half a JND.
GroupStudy two_sided(std::string name, std::size_t participants, int trials, double lapse) {
  GroupStudy study;
  study.name = "levels on both sides, constant, " + std::move(name);
  study.participants = participants;
  study.location = 300;
  study.location_sd = 15;
  study.location_difference_sd = 7.5;
  study.log_width = std::log(30);
  study.lapse = lapse;
  study.tracks = {protocols::ConstantStimuli{evenly(225, 375, 7), trials / 7}};
  return study;
}

GroupStudy two_sided_quest() {
  GroupStudy study = two_sided("", 6, 84, 0.02);
  study.name = "levels on both sides, QUEST+, n 6, 84 trials";
  protocols::QuestPlus quest;
  quest.levels = evenly(200, 400, 21);
  quest.threshold.values = evenly(240, 360, 13);
  for (const double factor : {0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8})
    quest.slope.values.push_back(factor * kLn3 / 30);
  quest.guess.values = quest.lapse.values = {0.02};
  quest.stop_trials = 84;
  study.tracks = {quest};
  return study;
}

/// Forced choice over log levels: threshold 1, two successes in a row make it harder.
GroupStudy forced_choice(std::string name, int alternatives, std::size_t participants,
                         double lapse) {
  GroupStudy study;
  study.name = "forced choice of " + std::to_string(alternatives) + ", " + std::move(name);
  study.participants = participants;
  study.model.asymptotes = GroupAsymptotes::fixed_guess;
  study.model.guess = 1.0 / alternatives;
  study.model.function.scale = protocols::LevelScale::log10;
  study.location_sd = 0.3;
  study.location_difference_sd = 0.15;
  study.log_width = std::log(0.35);
  study.lapse = lapse;
  return study;
}

protocols::Staircase log_staircase(int trials) {
  protocols::Staircase spec;
  spec.scale = protocols::LevelScale::log10;
  spec.start = 5;
  spec.min = 0.05;
  spec.max = 5;
  spec.steps = {0.2, 0.1};
  spec.down = 2;
  spec.stop_trials = trials;
  return spec;
}

GroupStudy yes_no() {
  GroupStudy study = forced_choice("", 2, 8, 0.02);
  study.name = "yes/no, constant, n 8, 84 trials and 28 catch trials, guesses 8 %";
  study.model.asymptotes = GroupAsymptotes::own_guess;
  study.guess = 0.08;
  study.catch_trials = 28;
  study.tracks = {protocols::ConstantStimuli{{0.3, 0.5, 0.7, 1, 1.4, 2, 3}, 12}};
  return study;
}

/// One participant with one renderer.
struct SimulatedObserver {
  double location = 0, width = 1, low = 0, lapse = 0;

  double chance(double place) const {
    return low + (1 - low - lapse) / (1 + std::exp(-kLn3 * (place - location) / width));
  }
};

GroupAnswers answers_of(const GroupStudy& study, const SimulatedObserver& observer,
                        Random& random) {
  const bool linear = study.model.function.scale == protocols::LevelScale::linear;
  protocols::InterleavedTracks tracks(study.tracks, random.next());
  std::map<double, LevelCount> counts;
  while (const auto asked = tracks.next()) {
    const double place = linear ? asked->level : std::log(asked->level);
    const bool success = random.unit() < observer.chance(place);
    tracks.record({asked->level, success});
    LevelCount& count =
        counts.try_emplace(asked->level, LevelCount{asked->level, 0, 0}).first->second;
    ++count.trials;
    count.successes += success ? 1 : 0;
  }
  GroupAnswers out;
  for (const auto& [level, count] : counts) out.counts.push_back(count);
  out.catch_trials = study.catch_trials;
  for (int i = 0; i < study.catch_trials; ++i)
    out.catch_successes += random.unit() < observer.low ? 1 : 0;
  return out;
}

struct GroupEstimate {
  double estimate = 0, truth = 0;
  Interval ci95;
  bool low_open = false, high_open = false;
  double p = 1;
};

void tally(GroupTally& sum, const GroupEstimate& one, double alpha) {
  ++sum.results;
  sum.held +=
      (one.low_open || one.ci95.low <= one.truth) && (one.high_open || one.truth <= one.ci95.high)
          ? 1
          : 0;
  sum.open += one.low_open || one.high_open ? 1 : 0;
  sum.both_open += one.low_open && one.high_open ? 1 : 0;
  sum.found += one.p < alpha ? 1 : 0;
  sum.error += one.estimate - one.truth;
}

void add(GroupTally& sum, const GroupTally& one) {
  sum.results += one.results;
  sum.held += one.held;
  sum.open += one.open;
  sum.both_open += one.both_open;
  sum.found += one.found;
  sum.error += one.error;
}

void add_mean(GroupTally& sum, const GroupMoments& found, double truth) {
  tally(sum, {found.mean, truth, found.ci95, found.low_open, found.high_open, 1}, 0);
}

void add_difference(GroupTally& sum, const GroupDifference& found, double truth,
                    const GroupCoverageSettings& settings) {
  tally(sum,
        {found.difference, truth, found.ci95.value_or(Interval{truth, truth}), found.low_open,
         found.high_open, found.p},
        settings.alpha);
}

GroupCoverage one_study(const GroupStudy& study, std::size_t number,
                        const GroupCoverageSettings& settings) {
  GroupCoverage out;
  out.studies = 1;
  const GroupPsychometricData data = group_psychometric_data(
      simulated_answers(study, settings.seed, number), study.model, kCoarseGroupGrid);
  if (!data.undefined.empty()) return out;
  const GroupFit fit = fit_group(data.data, settings.means || settings.intervals);
  for (std::size_t c = 0; settings.means && c < 2; ++c) {
    const double half = c == 0 ? -0.5 : 0.5;
    add_mean(out.location, fit.conditions[c].first,
             study.location + half * study.location_difference);
    add_mean(out.log_width, fit.conditions[c].second, study.log_width + half * study.log_ratio);
  }
  const GroupDifferenceSettings how{settings.intervals, false};
  add_difference(out.location_difference,
                 compare_group(data.data, fit, GroupCoordinate::first, 0, 1, how),
                 study.location_difference, settings);
  add_difference(out.log_width_difference,
                 compare_group(data.data, fit, GroupCoordinate::second, 0, 1, how), study.log_ratio,
                 settings);
  return out;
}

}  // namespace

GroupStudy hardest_group_study() {
  GroupStudy study = forced_choice("staircase, n 6, 42 trials, lapses 5 %", 3, 6, 0.05);
  study.tracks = {log_staircase(42)};
  return study;
}

std::vector<GroupStudy> group_coverage_studies() {
  std::vector<GroupStudy> out;
  out.push_back(two_sided("n 5, 84 trials", 5, 84, 0.02));
  out.push_back(two_sided("n 6, 42 trials", 6, 42, 0.02));
  out.push_back(two_sided("n 6, 168 trials", 6, 168, 0.02));
  out.push_back(two_sided("n 12, 84 trials", 12, 84, 0.02));
  out.push_back(two_sided("n 12, 42 trials, lapses 5 %", 12, 42, 0.05));
  out.push_back(two_sided("n 6, 84 trials, lapses differ", 6, 84, 0.03));
  out.back().lapses_differ = true;
  out.push_back(two_sided("n 6, 84 trials, JND 12 with levels 35 apart", 6, 84, 0.02));
  out.back().log_width = std::log(12);
  out.back().tracks = {protocols::ConstantStimuli{evenly(195, 405, 7), 12}};
  out.push_back(two_sided_quest());
  out.push_back(forced_choice("staircase, n 8, 84 trials", 2, 8, 0.02));
  out.back().tracks = {log_staircase(84)};
  out.push_back(forced_choice("constant, n 6, 84 trials, no lapses", 3, 6, 0));
  out.back().tracks = {protocols::ConstantStimuli{{0.3, 0.5, 0.7, 1, 1.4, 2, 3}, 12}};
  out.push_back(yes_no());
  out.push_back(hardest_group_study());
  return out;
}

std::vector<std::vector<GroupAnswers>> simulated_answers(const GroupStudy& study,
                                                         std::uint64_t seed, std::size_t number) {
  std::vector<std::vector<GroupAnswers>> out(2);
  for (std::size_t i = 0; i < study.participants; ++i) {
    Random random(seed, {0x67, number, i});
    const double location = study.location + study.location_sd * random.normal();
    const double moved = study.location_difference + study.location_difference_sd * random.normal();
    const double log_width = study.log_width + study.log_width_sd * random.normal();
    const double log_ratio = study.log_ratio + study.log_ratio_sd * random.normal();
    // More than a third of lapses is no task.
    const double drawn = -study.lapse * std::log(1 - random.unit());
    const double lapse = study.lapses_differ ? std::min(drawn, 0.3) : study.lapse;
    for (std::size_t c = 0; c < 2; ++c) {
      const double half = c == 0 ? -0.5 : 0.5;
      SimulatedObserver observer;
      observer.location = location + half * moved;
      observer.width = std::exp(log_width + half * log_ratio);
      observer.lapse = lapse;
      observer.low = study.model.asymptotes == GroupAsymptotes::both_lapse    ? lapse
                     : study.model.asymptotes == GroupAsymptotes::fixed_guess ? study.model.guess
                                                                              : study.guess;
      out[c].push_back(answers_of(study, observer, random));
    }
  }
  return out;
}

std::vector<GroupCoverage> group_coverage(const std::vector<GroupStudy>& studies,
                                          const GroupCoverageSettings& settings) {
  const std::size_t all = studies.size() * settings.studies;
  std::vector<GroupCoverage> single(all);
  do_jobs(
      all, settings.jobs,
      [&](std::size_t i) {
        single[i] = one_study(studies[i / settings.studies], i % settings.studies, settings);
      },
      settings.progress);
  std::vector<GroupCoverage> out;
  for (std::size_t s = 0; s < studies.size(); ++s) {
    GroupCoverage& sum = out.emplace_back();
    sum.study = studies[s];
    for (std::size_t i = s * settings.studies; i < (s + 1) * settings.studies; ++i) {
      sum.studies += single[i].studies;
      add(sum.location, single[i].location);
      add(sum.log_width, single[i].log_width);
      add(sum.location_difference, single[i].location_difference);
      add(sum.log_width_difference, single[i].log_width_difference);
    }
  }
  return out;
}

}  // namespace palpate::analysis
