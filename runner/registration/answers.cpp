#include "runner/registration/answers.h"

#include <array>
#include <cstdio>
#include <utility>

#include "analysis/report/plan_report.h"
#include "analysis/text.h"
#include "protocols/schedule.h"
#include "protocols/session_plan.h"
#include "runner/registration/planned_conditions.h"

namespace palpate::runner::registration {

using analysis::counted;
using Kind = Paragraph::Kind;

Paragraph text(std::string words) { return {Kind::text, std::move(words)}; }
Paragraph item(std::string words) { return {Kind::item, std::move(words)}; }
Paragraph lines(std::string words) { return {Kind::lines, std::move(words)}; }
Paragraph fill_in(std::string words) { return {Kind::field, std::move(words)}; }

std::string plain(double value) {
  std::array<char, 40> digits{};
  std::snprintf(digits.data(), digits.size(), "%.6g", value);
  return digits.data();
}

std::string percent(double share) { return plain(100 * share) + " %"; }

std::vector<Paragraph> StudyAnswers::rationale() const {
  const analysis::PlanRecord& plan = made_.plan;
  std::vector<Paragraph> out = this->plan();
  const analysis::PlanRecord::Curve& found = fitting_curve(protocol_, plan);
  const std::string people = counted(made_.participants, "participant", "participants");
  if (found.participants)
    out.push_back(item(counted(*found.participants, "participant finds", "participants find") +
                       " " + goal() + " with a power of at least " + percent(plan.power) + "."));
  const auto power = found.power.find(made_.participants);
  if (power != found.power.end()) {
    out.push_back(item("The power with " + people + ": " + percent(power->second) + " to find " +
                       goal() + "."));
  } else {
    out.push_back(fill_in("why " + people + ", for which the plan has no power."));
  }
  return out;
}

std::string StudyAnswers::contrast() const {
  const analysis::ThresholdStudy* const study = made_.plan.measure();
  return study != nullptr && study->bound ? "a difference as large as the bound" : "no effect";
}

namespace {

/// "with the second condition the JND is ..."
std::string effect_of(const analysis::ThresholdStudy& study, const protocols::Protocol& protocol) {
  const std::string measure = analysis::measure_in_words(study.measure);
  const std::string is = " is " + analysis::effect_in_words(study);
  switch (study.contrast) {
    case analysis::PlannedContrast::conditions:
      return "with the second condition the " + measure + is;
    case analysis::PlannedContrast::groups:
      return "in group " + protocol.groups.true_name(protocol.groups.names.size() - 1) + " the " +
             measure + is + " than in group " + protocol.groups.true_name(0);
    case analysis::PlannedContrast::zero:
      break;
  }
  return "the " + measure + is + " than 0";
}

/// With their units.
std::string deviations_in_words(const analysis::ThresholdStudy& study) {
  const std::string people = "Standard deviations: participants " + plain(study.participant_sd) +
                             ", their differences between the conditions " + plain(study.effect_sd);
  if (!analysis::is_of_reaching(study.measure))
    return people +
           ", on the scale of the plan (natural logarithms of JNDs, thresholds and exponents; PSEs "
           "in JNDs; log odds of shares; ratings in steps).";
  return people + ", single movements " + plain(study.movement_sd) +
         (study.measure == analysis::PlannedMeasure::adaptation ? "." : " (m).");
}

/// The registration of a kind of study.
struct StudyRules {
  std::unique_ptr<StudyAnswers> (*answers)(const Registration& made);
  void (*require)(const protocols::Protocol& protocol, const std::string& path);
};
constexpr StudyRules kOfShapes{identification_answers, require_two_renderers};
constexpr StudyRules kOfTasks{task_answers, require_own_trials};

const StudyRules& rules_of(const protocols::Protocol& protocol) {
  return protocols::is_study_of_shapes(protocol) ? kOfShapes : kOfTasks;
}

}  // namespace

std::vector<Paragraph> plan_of_measure(const Registration& made) {
  const analysis::PlanRecord& plan = made.plan;
  const analysis::ThresholdStudy& study = *plan.measure();
  std::vector<Paragraph> out;
  out.push_back(text("A power analysis by simulation (palpate plan; plan.json has all of it): " +
                     std::to_string(plan.studies) +
                     " studies for each number of participants and " +
                     std::to_string(fitting_curve(made.protocol, plan).trials) +
                     (study.contrast == analysis::PlannedContrast::conditions
                          ? " trials of each with each condition. "
                          : " trials of each that give the measure. ") +
                     analysis::method_in_words(study) +
                     (study.bound ? " Two one-sided tests at 5 %."
                                  : " Alpha " + plain(plan.alpha) + ", two-sided.")));
  const std::string measure = analysis::measure_in_words(study.measure);
  if (study.bound) {
    out.push_back(item("To be shown: the " + measure +
                       (study.contrast == analysis::PlannedContrast::zero
                            ? " is 0, within "
                            : " is the same with both conditions, within ") +
                       analysis::bound_in_words(study) + "."));
  } else {
    out.push_back(item("Effect to be found: " + effect_of(study, made.protocol) + "."));
  }
  out.push_back(item(deviations_in_words(study)));
  for (const std::string& note : plan.notes) out.push_back(item(note));
  return out;
}

std::string accuracy_in_words() {
  return "Accuracy: for each participant the mean over shapes of the share correct with the ray "
         "minus that with the point; a time-out counts as wrong. One-sample t-test of these "
         "differences over participants, with its 95 % interval in shares; df = n - 1. Beside it "
         "a logistic model with a participant's own level and difference, "
         "logit(p) = b0 + delta r + shape + u + s r, whose interval and p follow from the profile "
         "of its likelihood, held against the t distribution.";
}

std::unique_ptr<StudyAnswers> study_answers(const Registration& made) {
  return rules_of(made.protocol).answers(made);
}

void require_registrable(const protocols::Protocol& protocol, const std::string& path) {
  rules_of(protocol).require(protocol, path);
}

}  // namespace palpate::runner::registration
