// Prints the levels of some procedures with all their digits, for compilers.sh.

#include <cstdio>

#include "protocols/procedures/procedure.h"

using namespace palpate::protocols;

namespace {

void print_run(const ProcedureSpec& spec, const PsychometricParticipant& participant) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    palpate::Random random(seed);
    Procedure procedure(spec, seed);
    while (const auto level = procedure.next_level()) {
      const bool success = participant.succeeds(*level, random);
      std::printf("%a %d\n", *level, success ? 1 : 0);
      procedure.record({*level, success});
    }
    std::printf("threshold %a\n", procedure.estimate().threshold.value_or(0));
  }
}

}  // namespace

int main() {
  Staircase staircase;
  staircase.start = 10;
  staircase.steps = {4, 2, 1};
  staircase.step_ratio = step_ratio_for(0.8, 1);
  staircase.scale = LevelScale::decibel;
  staircase.min = 0.1;
  staircase.max = 100;
  staircase.stop_trials = 80;
  for (const PsychometricShape shape :
       {PsychometricShape::logistic, PsychometricShape::normal, PsychometricShape::weibull}) {
    QuestPlus quest;
    quest.function = {shape, LevelScale::log10};
    for (int i = 0; i < 30; ++i) quest.levels.push_back(level_at(LevelScale::log10, 0.05 * i));
    quest.threshold.values = quest.levels;
    quest.slope.values = {1, 2, 3, 5, 8};
    quest.guess.values = {0.5};
    quest.lapse.values = {0, 0.02, 0.05};
    quest.stop_trials = 60;
    const PsychometricParticipant participant{quest.function, {7, 3, 0.5, 0.02}};
    print_run(quest, participant);
    print_run(staircase, participant);
  }
}
