#include "protocols/procedures/recovery.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "data/base/random.h"
#include "protocols/procedures/portable_math.h"
#include "protocols/procedures/procedure.h"
#include "protocols/procedures/procedure_spec.h"

namespace palpate::protocols {
namespace {

double level_of_success(const PsychometricParticipant& participant, double share) {
  const auto& parameters = participant.parameters;
  const double core = (share - parameters.guess) / (1 - parameters.guess - parameters.lapse);
  return psychometric_level(participant.function, parameters, core);
}

double place_of(const ProcedureSpec& spec, double level) {
  return scale_position(scale_of(spec).value_or(LevelScale::linear), level);
}

constexpr int kCourses = 20;
/// Standard deviation of a simulated participant's threshold in a course, in steps.
constexpr double kBlurInSteps = 2;

/// A participant for a course: the share of successes at `threshold` is `share`.
struct CourseParticipant {
  double threshold, sd, share;  // threshold and sd on the scale
  bool higher_is_easier;

  bool succeeds(double position, Random& random) const {
    const double easier = (higher_is_easier ? position - threshold : threshold - position) / sd;
    // Logistic, shifted so that it passes through `share`.
    const double odds = share / (1 - share) * portable_exp(1.7 * easier);
    return random.unit() < odds / (1 + odds);
  }
};

std::optional<CourseParticipant> course_participant(const ProcedureSpec& spec,
                                                    const Procedure& so_far) {
  const auto place = [&](double level) { return place_of(spec, level); };
  const std::optional<double> known = so_far.estimate().threshold;
  if (const auto* const stairs = std::get_if<Staircase>(&spec)) {
    if (!stairs->stop_reversals) return std::nullopt;
    const bool higher = stairs->easier == Easier::higher;
    const double middle = (place(stairs->start) + place(higher ? stairs->min : stairs->max)) / 2;
    return CourseParticipant{known ? place(*known) : middle, kBlurInSteps * stairs->steps.back(),
                             convergence_point(*stairs), higher};
  }
  if (const auto* const limits = std::get_if<Limits>(&spec)) {
    const double middle = (place(limits->low) + place(limits->high)) / 2;
    return CourseParticipant{known ? place(*known) : middle, kBlurInSteps * limits->step, 0.5,
                             limits->easier == Easier::higher};
  }
  return std::nullopt;
}

}  // namespace

double true_threshold(const ProcedureSpec& spec, const PsychometricParticipant& participant) {
  if (const auto* staircase = std::get_if<Staircase>(&spec))
    return level_of_success(participant, convergence_point(*staircase));
  if (std::holds_alternative<QuestPlus>(spec)) return participant.parameters.threshold;
  if (std::holds_alternative<Limits>(spec)) return level_of_success(participant, 0.5);
  return 0;
}

double expected_trials(const ProcedureSpec& spec, const Procedure& so_far) {
  if (so_far.ended()) return 0;
  const double done = so_far.estimate().trials;
  const auto participant = course_participant(spec, so_far);
  if (!participant) return static_cast<double>(most_trials(spec)) - done;
  double trials = 0;
  for (int i = 0; i < kCourses; ++i) {
    Random random(1, {static_cast<std::uint64_t>(i)});
    Procedure course = so_far;
    while (const auto level = course.next_level()) {
      const double position = place_of(spec, *level);
      course.record({*level, participant->succeeds(position, random)});
      ++trials;
    }
  }
  return trials / kCourses;
}

Recovery simulate_recovery(const ProcedureSpec& spec, const PsychometricParticipant& participant,
                           int participants, std::uint64_t seed) {
  Recovery result;
  result.participants = participants;
  const double truth = place_of(spec, true_threshold(spec, participant));
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
    errors.push_back(place_of(spec, *estimate.threshold) - truth);
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
