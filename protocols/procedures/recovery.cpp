#include "protocols/procedures/recovery.h"

#include <cmath>
#include <optional>
#include <vector>

#include "protocols/procedures/procedure.h"

namespace palpate::protocols {
namespace {

double level_of_success(const PsychometricParticipant& participant, double share) {
  const auto& parameters = participant.parameters;
  const double core = (share - parameters.guess) / (1 - parameters.guess - parameters.lapse);
  return psychometric_level(participant.function, parameters, core);
}

LevelScale scale_of(const ProcedureSpec& spec) {
  if (const auto* staircase = std::get_if<Staircase>(&spec)) return staircase->scale;
  if (const auto* quest = std::get_if<QuestPlus>(&spec)) return quest->function.scale;
  if (const auto* limits = std::get_if<Limits>(&spec)) return limits->scale;
  return LevelScale::linear;
}

}  // namespace

double true_threshold(const ProcedureSpec& spec, const PsychometricParticipant& participant) {
  if (const auto* staircase = std::get_if<Staircase>(&spec))
    return level_of_success(participant, convergence_point(*staircase));
  if (std::holds_alternative<QuestPlus>(spec)) return participant.parameters.threshold;
  if (std::holds_alternative<Limits>(spec)) return level_of_success(participant, 0.5);
  return 0;
}

Recovery simulate_recovery(const ProcedureSpec& spec, const PsychometricParticipant& participant,
                           int participants, std::uint64_t seed) {
  Recovery result;
  result.participants = participants;
  const double truth = scale_position(scale_of(spec), true_threshold(spec, participant));
  std::vector<double> errors;
  double trials = 0;
  for (int i = 0; i < participants; ++i) {
    Random random(seed, {0x4e, static_cast<std::uint64_t>(i)});
    Procedure procedure(spec, random.next());
    while (const auto level = procedure.next_level())
      procedure.record({*level, participant.succeeds(*level, random)});
    const Estimate estimate = procedure.estimate();
    trials += estimate.trials;
    if (!estimate.threshold) {
      ++result.without_estimate;
      continue;
    }
    errors.push_back(scale_position(scale_of(spec), *estimate.threshold) - truth);
  }
  const auto n = static_cast<double>(errors.size());
  result.mean_trials = trials / participants;
  if (errors.size() < 2) return result;
  for (const double error : errors) result.bias += error / n;
  for (const double error : errors)
    result.spread += (error - result.bias) * (error - result.bias) / (n - 1);
  result.spread = std::sqrt(result.spread);
  result.bias_se = result.spread / std::sqrt(n);
  return result;
}

}  // namespace palpate::protocols
