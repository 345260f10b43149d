#include <cmath>

#include "analysis/statistics/paired.h"
#include "analysis/statistics/sensitivity.h"
#include "analysis/text.h"
#include "protocols/schedule.h"
#include "runner/registration/answers.h"
#include "runner/usage_error.h"

namespace palpate::runner::registration {
namespace {

using analysis::counted;
using analysis::joined;

/// Of a study of version 1: which shape it is.
class IdentificationAnswers final : public StudyAnswers {
 public:
  explicit IdentificationAnswers(const Registration& made) : StudyAnswers(made) {
    for (const protocols::StimulusSpec& stimulus : protocol_.stimuli)
      stimuli_.push_back(stimulus.name);
    for (const protocols::RendererKind kind : protocol_.renderers)
      renderers_.emplace_back(protocols::to_string(kind));
  }

  std::string names() const override {
    return "In these conditions, paired.SHAPE.reduction is the geometric percent reduction of "
           "the response time with " +
           renderers_.back() + " against " + renderers_.front() +
           ", ci95_low and ci95_high are the ends of its 95 % interval, p_holm is the "
           "Holm-adjusted p value of the paired t-test (question 17), and alpha is that of "
           "question 19. The README of palpate's analysis lists all names.";
  }

  std::string feedback() const override {
    return protocol_.blocks.front().feedback
               ? "After each answer the participant's window says whether it was right."
               : "";
  }

  std::vector<Paragraph> design() const override {
    std::vector<Paragraph> out;
    const auto cells = protocol_.renderers.size() * protocol_.stimuli.size();
    out.push_back(text("Two factors within participants: renderer (" + joined(renderers_) +
                       ") and shape (" + joined(stimuli_) + "), " + std::to_string(cells) +
                       " cells. In each trial the participant feels one object through the stylus, "
                       "unseen, and says which shape it is."));
    out.push_back(item("Trials: " + std::to_string(protocol_.repetitions) + " in each cell, " +
                       std::to_string(protocols::main_trials(protocol_)) + " for each participant" +
                       (protocol_.sessions.count > 1
                            ? ", over " + std::to_string(protocol_.sessions.count) + " sessions"
                            : "") +
                       "."));
    out.push_back(item("Renderers: " + order_of_renderers()));
    if (protocol_.practice.repetitions > 0) out.push_back(item("Practice: " + practice()));
    if (protocol_.sessions.warm_up_trials > 0)
      out.push_back(item(
          "Warm-up: " +
          counted(static_cast<std::size_t>(protocol_.sessions.warm_up_trials), "trial", "trials") +
          " at the start of the second and later sessions; not analysed."));
    out.push_back(item("An answer is given by a key within " +
                       plain(protocol_.blocks.front().time_out) +
                       " s; a trial without one is a time-out."));
    out.push_back(
        text("The protocol, protocol.json, says all of it for the program that runs the "
             "sessions. SHA-256 of the file: " +
             protocol_.sha256 + "."));
    return out;
  }

  std::vector<Paragraph> randomisation() const override {
    std::vector<Paragraph> out;
    const auto& order = protocol_.order;
    std::string rule = order.kind == protocols::OrderKind::random
                           ? "Within a block the shapes come in a random order"
                           : "Within a block the shapes come in the protocol's order";
    if (order.max_run)
      rule += ", with at most " + std::to_string(*order.max_run) + " equal ones in a row";
    if (order.min_distance)
      rule += ", equal ones at least " +
              counted(static_cast<std::size_t>(*order.min_distance), "trial", "trials") + " apart";
    rule += protocol_.orientation == protocols::OrientationKind::uniform
                ? "; each object is turned at random (uniform over all rotations)."
            : protocol_.orientation == protocols::OrientationKind::listed
                ? "; orientations are drawn from a list in the protocol."
                : "; objects are not turned.";
    out.push_back(text(rule));
    out.push_back(text(
        "All of it is fixed now: it follows from the protocol's seed (" +
        std::to_string(protocol_.seed) +
        ") and the participant's number, which is given in the order of arrival. 'palpate schedule "
        "protocol.json --participant N' prints it. The SHA-256 of each participant's order (a line "
        "a trial that is analysed, session,renderer,shape,w,x,y,z, the orientation with 17 "
        "significant digits):"));
    return out;
  }

  std::vector<Paragraph> sample_size() const override {
    return {text(counted(made_.participants, "participant", "participants") + " with " +
                 std::to_string(protocols::main_trials(protocol_)) +
                 " trials each that are analysed, " +
                 std::to_string(made_.participants *
                                static_cast<std::size_t>(protocols::main_trials(protocol_))) +
                 " in all.")};
  }

  std::vector<Paragraph> manipulated() const override {
    std::vector<Paragraph> out;
    out.push_back(
        item("renderer: point (only the tip of the stylus is felt: a force) and ray (the "
             "stylus is felt along its whole length: force and torque)."));
    out.push_back(
        item("shape: " + joined(stimuli_) + "; sizes and materials are in the protocol."));
    return out;
  }

  std::vector<Paragraph> measured() const override {
    return {item("response_time, s: from the first tick with forces on to the answer."),
            item("response and correct: the shape that was answered, and whether it was shown."),
            item("timed_out: no answer within the limit."),
            text("codebook.csv explains every column of the data.")};
  }

  std::vector<Paragraph> indices() const override {
    return {
        text("For each participant, renderer and shape: the mean of the natural logarithms of "
             "the response times that count (question 20).")};
  }

  std::vector<Paragraph> models() const override {
    const std::string& reference = renderers_.front();
    const std::string& other = renderers_.back();
    std::vector<Paragraph> out;
    out.push_back(text(
        "Primary, for each shape: a paired t-test, two-sided, over participants on d = mean log "
        "time with " +
        other + " - mean log time with " + reference +
        " (each a participant's mean "
        "over trials). t = mean(d) / (sd(d) / sqrt(n)), df = n - 1. The percent reduction is 100 "
        "(1 - exp(mean(d))), with the t-test's 95 % interval."));
    out.push_back(text(
        "Beside it, not decisive unless a hypothesis names its numbers: exact Wilcoxon signed-rank "
        "test, bootstrap interval (BCa, 9,999 resamples), repeated-measures ANOVA renderer x shape "
        "with sphericity corrections, and a mixed model by REML:"));
    out.push_back(lines("log(response_time) ~ renderer * shape + (1 + renderer | participant)"));
    if (made_.plan.measure() != nullptr) out.push_back(text(accuracy_in_words()));
    out.push_back(text("The analysis is palpate " + made_.program_version +
                       "'s 'palpate analyze'; analysis-simulated.json shows its numbers for "
                       "simulated data."));
    return out;
  }

  std::vector<Paragraph> transformations() const override {
    return {
        text("Response times are analysed as natural logarithms of seconds. Differences on "
             "that scale are reported as percent reductions, 100 (1 - exp(difference)).")};
  }

  std::vector<Paragraph> inference() const override {
    return {text("Two-sided tests with alpha = " + plain(made_.alpha) +
                 ". p values of the paired t-tests are adjusted by Holm's method over the " +
                 counted(stimuli_.size(), "shape", "shapes") +
                 ". Hypotheses are judged by their conditions (question 2); there is no adjustment "
                 "over hypotheses.")};
  }

  std::vector<Paragraph> exclusion() const override {
    return {item("Times: wrong answers and answers faster than " + plain(made_.too_fast) +
                 " s are left out."),
            item("Practice and warm-up trials are left out of everything."),
            item("An attempt that was interrupted is shown again and is not analysed."),
            item("Slow answers are kept up to the time-out. Accuracy uses all trials that are not "
                 "practice."),
            fill_in("for what reasons a whole participant is left out, if any.")};
  }

  std::vector<Paragraph> missing() const override {
    return {item("A time-out counts as wrong and has no time in the primary test; a log-normal "
                 "model with time-outs as censored times (at " +
                 plain(protocol_.blocks.front().time_out) + " s) is reported beside it."),
            item("A participant without a time in a cell is left out of that shape's paired test."),
            item("Of participants who withdraw, all data are deleted.")};
  }

  std::string rehearsal() const override {
    return " SIMULATED studies with the planned effect and as many with no effect were drawn from "
           "the model of the plan and analysed as above. No person took part; the numbers say what "
           "the design and the conditions can show, not what people will do. The model has no mean "
           "time; " +
           plain(std::round(10 * made_.typical_time) / 10) + " s was assumed.";
  }

  std::unique_ptr<PlannedStudies> planned() const override { return planned_identification(made_); }
  std::string simulated() const override {
    return "Drawn from the model of plan.json, in the registered orders of "
           "trials: no person took part. `planned-effect.csv` has the effects that the study "
           "is to find, `no-effect.csv` none. `../codebook.csv` explains the columns.";
  }

 private:
  std::vector<Paragraph> plan() const override {
    const analysis::PlanRecord& plan = made_.plan;
    std::vector<Paragraph> out;
    if (plan.times() == nullptr) return plan_of_measure(made_);
    out.push_back(text("A power analysis by simulation (palpate plan; plan.json has all of it): " +
                       std::to_string(plan.studies) +
                       " studies for each number of participants, "
                       "drawn from a mixed model of log times and tested by " +
                       (plan.test == analysis::StudyTest::paired ? "paired t-tests"
                                                                 : "contrasts of a mixed model") +
                       " with Holm's adjustment over the shapes, alpha " + plain(plan.alpha) +
                       ", two-sided."));
    out.push_back(item("Effects to be found, percent less time with " + renderers_.back() +
                       " than with " + renderers_.front() + ": " + planned_effects() + "."));
    const analysis::StudyModel& model = *plan.times();
    out.push_back(
        item("Standard deviations of log times: single trials " + plain(model.residual_sd) +
             ", participants' gains " + plain(model.gain_sd) + ", their gains for single shapes " +
             plain(model.shape_gain_sd) + ", participants " + plain(model.intercept_sd) +
             "; share of trials that give a time: " + plain(model.proportion_used) + "."));
    if (!plan.pilot_label.empty())
      out.push_back(item(plan.pilot_label + ": these standard deviations come from a pilot of "
                                            "simulated participants, a model and no people."));
    return out;
  }

  std::string goal() const override {
    if (made_.plan.times() == nullptr) return "the effect";
    return made_.plan.goal == analysis::Goal::all ? "all of the effects"
                                                  : "at least one of the effects";
  }

  std::string planned_effects() const {
    std::vector<std::string> parts, none;
    const analysis::StudyModel& model = *made_.plan.times();
    for (std::size_t s = 0; s < model.shapes.size(); ++s) {
      if (model.log_ratios[s] == 0) {
        none.push_back(model.shapes[s]);
      } else {
        parts.push_back(model.shapes[s] + " " +
                        plain(analysis::percent_reduction(model.log_ratios[s])) + " %");
      }
    }
    return joined(parts) + (none.empty() ? "" : ", none for " + joined(none));
  }

  std::string order_of_renderers() const {
    switch (protocol_.renderer_order) {
      case protocols::RendererOrder::counterbalanced:
        return "one after the other, in an order that is counterbalanced over participant numbers "
               "(balanced Latin square; it repeats after " +
               counted(static_cast<std::size_t>(protocols::renderer_orders(protocol_)),
                       "participant", "participants") +
               ").";
      case protocols::RendererOrder::interleaved:
        return "mixed from trial to trial.";
      case protocols::RendererOrder::fixed:
        break;
    }
    return "one after the other, in the same order for everybody: " + renderers_.front() +
           " first.";
  }

  std::string practice() const {
    const auto& practice = protocol_.practice;
    std::string out = counted(static_cast<std::size_t>(practice.repetitions), "trial", "trials") +
                      " of each shape before the first block with a renderer";
    if (practice.criterion)
      out += ", again until " + percent(*practice.criterion) + " are right, at most " +
             counted(static_cast<std::size_t>(practice.max_rounds), "round", "rounds");
    return out + "; not analysed.";
  }

  std::vector<std::string> stimuli_, renderers_;
};

}  // namespace

std::unique_ptr<StudyAnswers> identification_answers(const Registration& made) {
  return std::make_unique<IdentificationAnswers>(made);
}

void require_two_renderers(const protocols::Protocol& protocol, const std::string& path) {
  if (protocol.renderers.size() != 2)
    throw UsageError(path + ": /renderers: expected two renderers to compare, point and ray");
}

}  // namespace palpate::runner::registration
