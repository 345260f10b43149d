// Processor time of the group's model for a large study: 20 participants, 400 trials with each of
// two renderers, with all intervals and both comparisons, on one core. Usage: group_model_bench

#include <ctime>
#include <iostream>

#include "analysis/statistics/group_psychometric.h"
#include "analysis/statistics/group_simulation.h"

int main() {
  using namespace palpate::analysis;
  // Processor time: other programs do not count.
  const auto seconds = [](std::clock_t from) {
    return static_cast<double>(std::clock() - from) / CLOCKS_PER_SEC;
  };
  GroupStudy two_sided = group_coverage_studies()[3], adaptive = group_coverage_studies()[8];
  std::get<palpate::protocols::ConstantStimuli>(two_sided.tracks[0]).repetitions = 57;  // of 7
  std::get<palpate::protocols::Staircase>(adaptive.tracks[0]).stop_trials = 400;
  for (GroupStudy* study : {&two_sided, &adaptive}) {
    study->participants = 20;
    const auto answers = simulated_answers(*study, 1, 0);
    const auto start = std::clock();
    const GroupPsychometricData data = group_psychometric_data(answers, study->model);
    std::cout << study->name << ", now n 20, 400 trials\n  likelihoods " << seconds(start);
    const auto fitted = std::clock();
    const GroupFit fit = fit_group(data.data);
    std::cout << " s, each renderer " << seconds(fitted);
    const auto compared = std::clock();
    for (const GroupCoordinate coordinate : {GroupCoordinate::first, GroupCoordinate::second})
      compare_group(data.data, fit, coordinate, 0, 1, {true, true, false});
    std::cout << " s, comparisons " << seconds(compared) << " s, in all " << seconds(start)
              << " s\n";
  }
}
