#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "analysis/report/plan_report.h"
#include "analysis/statistics/paired.h"
#include "analysis/text.h"
#include "data/base/cell_name.h"
#include "protocols/groups.h"
#include "protocols/tasks/block_order.h"
#include "protocols/tasks/levels.h"
#include "runner/registration/answers.h"
#include "runner/registration/planned_conditions.h"
#include "runner/study/study_order.h"
#include "runner/study/task_words.h"
#include "runner/usage_error.h"

namespace palpate::runner::registration {
namespace {

using analysis::counted;
using analysis::joined;
using protocols::TaskBlock;
using protocols::TaskKind;

/// The kinds of tasks of a study's blocks, of which the answers speak.
struct Kinds {
  bool identify = false, compare = false, two_sided = false, one_sided = false;
  bool same_different = false, detect = false, rate = false, numbers = false, adjust = false;
  bool reach = false;
  bool confidence = false, catch_trials = false;
  bool field = false;  ///< levels of several dimensions

  bool functions() const { return compare || detect; }
};

Kinds kinds_of(const protocols::Protocol& protocol) {
  Kinds out;
  for (const TaskBlock& block : protocol.blocks) {
    if (block.practice) continue;
    out.confidence |= block.confidence.has_value();
    out.catch_trials |= block.catch_trials > 0;
    if (!block.dimensions.empty() && block.task != TaskKind::rate) {
      out.field = true;
      continue;
    }
    switch (block.task) {
      case TaskKind::identify:
        out.identify = true;
        break;
      case TaskKind::compare:
        if (block.same_different || !block.level) {
          out.same_different |= block.same_different;
          break;
        }
        out.compare = true;
        (protocols::side_of_levels(protocol, block) == 0 ? out.two_sided : out.one_sided) = true;
        break;
      case TaskKind::detect:
        out.detect = true;
        break;
      case TaskKind::rate:
        (block.level && block.answers.empty() ? out.numbers : out.rate) = true;
        break;
      case TaskKind::adjust:
        out.adjust = true;
        break;
      case TaskKind::reach:
        out.reach = true;
        break;
      case TaskKind::external:
        break;
    }
  }
  return out;
}

/// The cells of a block have one name.
void add_once(const std::string& name, std::vector<std::string>& names) {
  if (std::ranges::find(names, name) == names.end()) names.push_back(name);
}

/// The participant's task, in words.
std::string question_of(TaskKind task) {
  switch (task) {
    case TaskKind::identify:
      return "says which of the stimuli it was";
    case TaskKind::compare:
      return "says in which interval the comparison was, by the block's question";
    case TaskKind::detect:
      return "says whether anything was there";
    case TaskKind::rate:
      return "gives a number or a step of a scale";
    case TaskKind::adjust:
      return "turns a number of the stimulus until it feels like the standard";
    case TaskKind::reach:
      return "moves the stylus from the start to a target";
    case TaskKind::external:
      break;
  }
  return "answers";
}

/// Of a study of version 2: blocks of tasks.
class TaskAnswers final : public StudyAnswers {
 public:
  explicit TaskAnswers(const Registration& made)
      : StudyAnswers(made),
        kinds_(kinds_of(protocol_)),
        conditions_(conditions_of(protocol_, made.plan)) {
    for (const protocols::RendererKind kind : protocol_.renderers)
      renderers_.emplace_back(protocols::to_string(kind));
    for (const TaskBlock& block : protocol_.blocks) {
      if (!block.practice) blocks_.push_back(&block);
    }
  }

  std::string names() const override {
    std::string out =
        "In these conditions a name begins with the measure and the block (and the stimulus, where "
        "a block has several): MEASURE.BLOCK.";
    if (renderers_.size() > 1)
      out +=
          " MEASURE.BLOCK.ratio (or .difference) compares the ray with the point within "
          "participants.";
    if (!protocol_.factors.empty() || protocol_.groups.any())
      out +=
          " effects.MEASURE.BLOCK.EFFECT has f, num_df, den_df, p, p_holm and "
          "generalized_eta_squared of "
          "an effect such as " +
          example_of_effect() + ".";
    if (compares_blocks())
      out +=
          " between.MEASURE.BLOCK.OTHER compares block OTHER with BLOCK within participants (of "
          "ratings between.rating.BLOCK.STIMULUS.OTHER).";
    out +=
        " MEASURE.BLOCK.RENDERER.estimate is the group's value. ci95_low and ci95_high are the "
        "ends of the 95 % interval, ci90_low and ci90_high of the 90 % interval, p_holm is the "
        "adjusted p value (question 19), equivalence.MEASURE.BLOCK.least_bound the least bound "
        "within which equivalence would be shown";
    if (kinds_.identify) out += "; accuracy.difference is in shares";
    return out +
           "; alpha is that of question 19. The README of palpate's analysis lists all names.";
  }

  std::string feedback() const override {
    std::vector<std::string> with;
    for (const TaskBlock* block : blocks_) {
      if (block->feedback) add_once(block->name, with);
    }
    if (with.empty()) return "";
    return "In " + blocks_in_words(with) +
           " the participant's window says after each answer whether it was right.";
  }

  std::vector<Paragraph> design() const override {
    std::vector<Paragraph> out;
    std::string factors = "renderer (" + joined(renderers_) + ")";
    if (renderers_.size() < 2) factors = "one renderer, " + renderers_.front();
    out.push_back(text("Within participants, " +
                       counted(names_of_blocks().size(), "block", "blocks") + " of trials; " +
                       factors +
                       ". In each trial the participant feels one or more objects through the "
                       "stylus, unseen, and answers."));
    for (const TaskBlock* block : blocks_) out.push_back(item(block_in_words(*block)));
    out.push_back(item("Order of the blocks: " + order_of_blocks()));
    if (protocol_.groups.any()) out.push_back(item(groups()));
    if (protocol_.sessions.count > 1)
      out.push_back(item("Sessions: " + std::to_string(protocol_.sessions.count) + "."));
    if (const std::string words = practice(); !words.empty()) out.push_back(item(words));
    out.push_back(
        text("The protocol, protocol.json, says all of it for the program that runs the "
             "sessions. SHA-256 of the file: " +
             protocol_.sha256 + "."));
    return out;
  }

  std::vector<Paragraph> randomisation() const override {
    std::vector<Paragraph> out;
    std::vector<std::string> fixed, adaptive;
    for (const TaskBlock* block : blocks_)
      add_once(block->name, protocols::is_adaptive(*block) ? adaptive : fixed);
    const std::string turns = protocol_.orientation == protocols::OrientationKind::uniform
                                  ? "Each object is turned at random (uniform over all rotations)."
                              : protocol_.orientation == protocols::OrientationKind::listed
                                  ? "Orientations are drawn from a list in the protocol."
                                  : "Objects are not turned.";
    out.push_back(text(
        "Everything random follows from the protocol's seed (" + std::to_string(protocol_.seed) +
        ") and the participant's number, which is given in the order of arrival. " + turns));
    if (!fixed.empty())
      out.push_back(text("Fixed now in " + blocks_in_words(fixed) +
                         ": every trial. Stimuli, renderers and levels come in a random order "
                         "under the limits of the block; where stimuli are compared, the interval "
                         "of the comparison is balanced and drawn."));
    if (!adaptive.empty())
      out.push_back(text(
          "Fixed now in " + blocks_in_words(adaptive) +
          ": the place of the block, and for the first, second, ... trial in it whether it is a "
          "catch trial, the interval of the comparison and the orientation; for each round of one "
          "trial of every track the order of the tracks, as long as none has ended. The answers "
          "determine the levels, when a track ends, and the number of trials, by the rules of "
          "question 6. 'palpate check' replays them: each level must be the one that the answers "
          "so far lead to."));
    out.push_back(text(
        "'palpate schedule protocol.json --participant N --format order' prints all that is fixed, "
        "a line each: session,renderer,shape,w,x,y,z,block,name,track,level,catch,comparison of a "
        "trial that is analysed (the orientation with 17 significant digits" +
        std::string(kinds_.reach ? "; of movements also field, catch or clamp)" : ")") +
        std::string(
            adaptive.empty()
                ? ""
                : "; block,session,number,name with its lines "
                  "trial,place,catch,comparison,w,x,y,z and round,place,tracks "
                  "where answers choose the levels" +
                      std::string(std::ranges::any_of(blocks_, &TaskBlock::cells_share_tracks)
                                      ? ", and cells,track,stimuli where they share tracks"
                                      : "")) +
        ". The SHA-256 of these lines of each participant:"));
    return out;
  }

  std::vector<Paragraph> sample_size() const override {
    const std::size_t each = study::planned_trials(protocol_), people = made_.participants;
    const bool about = study::has_adaptive_blocks(protocol_);
    if (protocol_.groups.any()) {
      std::size_t all = 0;
      for (const auto& [number, sha256] : made_.order_sha256)
        all += study::planned_trials(protocols::protocol_of(protocol_, number));
      return {text(counted(people, "participant", "participants") + " with " +
                   (about ? "about " : "") + std::to_string(all) +
                   " trials in all that are analysed; each has those of the own group.")};
    }
    return {text(counted(people, "participant", "participants") + " with " +
                 (about ? "about " : "") + std::to_string(each) +
                 " trials each that are analysed, " + (about ? "about " : "") +
                 std::to_string(people * each) + " in all.")};
  }

  std::vector<Paragraph> stopping() const override {
    if (!study::has_adaptive_blocks(protocol_)) return {};
    return {
        text("Within a session an adaptive block ends by the rule of its procedure (question "
             "6), or when many trials in it had no answer.")};
  }

  std::vector<Paragraph> manipulated() const override {
    std::vector<Paragraph> out;
    if (renderers_.size() > 1)
      out.push_back(
          item("renderer: point (only the tip of the stylus is felt: a force) and ray (the "
               "stylus is felt along its whole length: force and torque)."));
    std::map<std::string, std::vector<std::string>> varied;  // blocks by what varies
    for (const TaskBlock* block : blocks_) {
      if (block->level)
        add_once(block->name,
                 varied[protocols::level_name(block->level->pointer) + " of the stimulus" +
                        (unit_of(*block).empty() ? "" : " (" + unit_of(*block) + ")")]);
    }
    for (const TaskBlock* block : blocks_) {
      for (const protocols::LevelDimension& one : block->dimensions) {
        const std::string unit = protocols::unit_of_level(one.target.pointer);
        add_once(block->name,
                 varied[one.name + ", " + protocols::level_name(one.target.pointer) + " of the " +
                        (block->standard ? to_string(one.of) : "stimulus") +
                        (unit == "1" ? "" : " (" + unit + ")")]);
      }
    }
    for (const auto& [level, names] : varied)
      out.push_back(item("level: " + level + ", in " + blocks_in_words(names) +
                         "; the levels are in question 6."));
    for (const protocols::Factor& factor : protocol_.factors)
      out.push_back(item(levels_of(factor)));
    std::set<std::string> shown;
    for (const TaskBlock* block : blocks_) {
      for (const int stimulus : block->stimuli)
        shown.insert(base_name(protocol_.stimuli[static_cast<std::size_t>(stimulus)].name));
    }
    if (shown.size() > 1)
      out.push_back(
          item("stimulus: " + joined(std::vector<std::string>(shown.begin(), shown.end())) +
               "; sizes and materials are in the protocol."));
    if (names_of_blocks().size() > 1)
      out.push_back(item("block: " + joined(names_of_blocks()) + "."));
    if (out.empty()) out.push_back(text("Nothing: one stimulus is shown in one condition."));
    return out;
  }

  std::vector<Paragraph> measured() const override {
    std::vector<Paragraph> out;
    if (kinds_.identify)
      out.push_back(
          item("response and correct: the stimulus that was answered, and whether it was "
               "shown; response_time, s."));
    if (kinds_.compare)
      out.push_back(
          item("success: whether the interval of the comparison was chosen; in a forced "
               "choice, whether the answer was right."));
    if (kinds_.same_different) out.push_back(item("success: whether the answer was different."));
    if (kinds_.detect) out.push_back(item("success: whether the answer was yes."));
    if (kinds_.rate || kinds_.numbers) out.push_back(item("number: as answered."));
    if (kinds_.adjust) out.push_back(item("number: the level that was set."));
    if (kinds_.reach)
      out.push_back(item(
          "response: in_time, fast or slow, by the block's time window; correct: in time. "
          "Of the recorded path: deviation, largest_deviation, duration, peak_speed, "
          "path_ratio, endpoint_error; in clamp trials adaptation; reach_kind: with the field, "
          "without it (catch) or along a channel (clamp)."));
    if (kinds_.confidence) out.push_back(item("confidence: the step of its scale."));
    out.push_back(item("timed_out: no answer within the limit."));
    out.push_back(text("codebook.csv explains every column of the data."));
    return out;
  }

  std::vector<Paragraph> indices() const override {
    std::vector<Paragraph> out;
    if (kinds_.two_sided)
      out.push_back(
          item("PSE: the level that is chosen as often as the standard. JND: half the "
               "distance of the levels that are chosen in 25 and in 75 % of the trials. "
               "Weber fraction: JND / standard."));
    if (kinds_.one_sided)
      out.push_back(
          item("Threshold of a forced choice: the level half way between the guess rate "
               "and 1. JND: its distance from the standard. Weber fraction: JND / "
               "standard."));
    if (kinds_.detect)
      out.push_back(item("Threshold of detection: the level half way between guess rate and 1."));
    if (kinds_.field)
      out.push_back(
          item("Levels of several dimensions: the parameters of the form that the protocol names, "
               "by maximum likelihood for each participant; of a form with a JND, that JND at the "
               "median of the standards shown. What the profile likelihood leaves open at an end "
               "is left out and counted."));
    if (kinds_.detect || kinds_.same_different)
      out.push_back(
          item("d' and criterion from the rates of hits and false alarms, where there "
               "are catch trials."));
    if (kinds_.rate) out.push_back(item("Mean rating of each participant in each condition."));
    if (kinds_.numbers)
      out.push_back(
          item("Exponent: slope of log10 number over log10 level, by least squares on a "
               "participant's means of logarithms at each level (Stevens)."));
    if (kinds_.adjust)
      out.push_back(
          item("PSE: the mean of a participant's settings; constant error: PSE minus "
               "standard."));
    if (kinds_.reach)
      out.push_back(
          item("Deviation: the mean over a participant's trials with the field, at peak speed, "
               "sideways from the line to the target; left is positive. Aftereffect: the same over "
               "its catch trials. Adaptation: the mean over its clamp trials of the slope of the "
               "channel's sideways force on that of the field."));
    if (kinds_.identify)
      out.push_back(
          item("Share correct, and the mean of the natural logarithms of the response "
               "times that count (question 20), for each participant, renderer and "
               "shape."));
    return out;
  }

  std::vector<Paragraph> models() const override {
    std::vector<Paragraph> out;
    if (kinds_.functions()) put_functions(out);
    if (kinds_.rate) put_ratings(out);
    if (kinds_.numbers || kinds_.adjust) put_log_t_test(out);
    if (kinds_.reach)
      out.push_back(
          text("Course of learning of each participant: end + (start - end) exp(-trial / trials), "
               "fitted to the deviations over the trials of a block by least squares, where it "
               "explains at least a tenth of their variance. Deviations, aftereffects and "
               "adaptations are not transformed. Means over participants have t intervals."));
    if (kinds_.detect || kinds_.same_different)
      out.push_back(
          text("d' and criterion of the group: H = Phi(d'/2 - c), F = Phi(-d'/2 - c) with "
               "binomial likelihoods and the same integrals over participants, at each "
               "level."));
    if (kinds_.identify) {
      out.push_back(text(accuracy_in_words()));
      out.push_back(
          text("Times of identification: for each shape a paired t-test over participants "
               "on d = mean log time with the ray - mean log time with the point."));
    }
    if (compares_blocks())
      out.push_back(text(
          "Blocks and stimuli are compared by the paired t-test of the participants' "
          "own figures" +
          std::string(kinds_.functions() ? " from single fits; undetermined fits are left out and "
                                           "counted."
                                         : ".")));
    if (!protocol_.factors.empty())
      out.push_back(
          text("Factors: an analysis of variance of the participants' values in each cell, "
               "with repeated measures (type III; groups, if any, between participants); levels "
               "are compared by paired t-tests of the participants' means over the other factors. "
               "Participants without a value in a cell are left out and counted."));
    if (made_.plan.measure() != nullptr && made_.plan.measure()->bound)
      out.push_back(
          text("Equivalence: two one-sided tests at 5 %, that is, the 90 % interval lies "
               "within the bound: " +
               analysis::bound_in_words(*made_.plan.measure()) + "."));
    out.push_back(text("The analysis is palpate " + made_.program_version +
                       "'s 'palpate analyze'; analysis-simulated.json shows its numbers for "
                       "simulated data."));
    return out;
  }

  std::vector<Paragraph> transformations() const override {
    std::vector<std::string> logs;
    if (kinds_.functions()) logs.emplace_back("JNDs");
    if (kinds_.one_sided || kinds_.detect)
      logs.emplace_back("thresholds whose levels have a logarithmic scale");
    if (kinds_.numbers) logs.emplace_back("exponents");
    if (kinds_.identify) logs.emplace_back("response times");
    if (kinds_.reach) logs.emplace_back("numbers of trials of learning");
    std::string words =
        logs.empty() ? ""
                     : "Natural logarithms of " + joined(logs) +
                           "; differences on that scale are reported as ratios, exp(difference), "
                           "and means as geometric means.";
    if (kinds_.two_sided || kinds_.adjust)
      words += std::string(words.empty() ? "" : " ") + "PSEs are analysed as they are.";
    if (kinds_.rate)
      words += std::string(words.empty() ? "" : " ") + "Ratings are analysed as they are.";
    return {text(words.empty() ? "None." : words)};
  }

  std::vector<Paragraph> inference() const override {
    std::string family = "p values are adjusted by Holm's method over the comparisons of a measure";
    if (kinds_.rate) family += " (of ratings, over all of a block)";
    if (!protocol_.factors.empty() || protocol_.groups.any())
      family += "; those of effects of an analysis of variance (p_holm) over " +
                (protocol_.tests.empty() ? std::string("all effects of a measure")
                                         : joined(protocol_.tests) + " of a measure");
    return {text("Two-sided tests with alpha = " + plain(made_.alpha) + ". " + family +
                 ". Hypotheses are judged by their conditions (question 2); there is no adjustment "
                 "over hypotheses.")};
  }

  std::vector<Paragraph> exclusion() const override {
    std::vector<Paragraph> out;
    out.push_back(item("Practice trials are left out of everything."));
    out.push_back(item("An attempt that was interrupted is shown again and is not analysed."));
    if (kinds_.functions())
      out.push_back(
          item("A participant whose answers are reversed relative to the task, by more "
               "than chance, is left out of the group's functions and counted. Nobody "
               "else is: a function without errors or without a threshold among the "
               "levels stays in the group's model with its likelihood."));
    if (kinds_.numbers)
      out.push_back(item("Numbers of 0 or below have no logarithm; they are counted."));
    if (kinds_.identify)
      out.push_back(item("Times: wrong answers and answers faster than " + plain(made_.too_fast) +
                         " s are left out. Accuracy uses all trials that are not practice."));
    out.push_back(fill_in("for what reasons a whole participant is left out, if any."));
    return out;
  }

  std::vector<Paragraph> missing() const override {
    std::vector<Paragraph> out;
    if (kinds_.functions() || kinds_.rate || kinds_.numbers || kinds_.adjust || kinds_.reach ||
        kinds_.same_different)
      out.push_back(item("A trial without an answer is left out and counted" +
                         std::string(study::has_adaptive_blocks(protocol_)
                                         ? "; an adaptive procedure shows its level again."
                                         : ".")));
    if (kinds_.identify)
      out.push_back(item("In identification a time-out counts as wrong and has no time."));
    out.push_back(
        item("A participant without a figure in one of two conditions is left out of "
             "their paired test; the group's model of functions uses those of one "
             "condition for its values."));
    out.push_back(item("Of participants who withdraw, all data are deleted."));
    return out;
  }

  std::string rehearsal() const override {
    std::string out =
        " SIMULATED studies with the planned effect and as many with " + contrast() +
        " were run trial by trial: simulated participants in the loop of 'palpate simulate', "
        "whose " +
        std::string(plans_movements()
                        ? "movements have the paths of those of 'palpate simulate' and the plan's "
                          "means and standard deviations of the planned measure. They were "
                        : "judgements of the true levels have the plan's means and standard "
                          "deviations. They were ") +
        "analysed as above. No person took part; the numbers say what the design and the "
        "conditions can show, not what people will do. So few studies tell a share of verdicts "
        "only roughly: its standard error is up to " +
        plain(std::round(50 / std::sqrt(static_cast<double>(studies())))) + " %.";
    if (conditions_.contrast == analysis::PlannedContrast::groups)
      out += " The planned effect is between the groups.";
    if (!conditions_.factor.empty())
      out += " The planned effect is between the first level of the factor " + conditions_.factor +
             " and each other one; the other factors have none.";
    if (made_.typical_time > 0)
      out += " A typical time of " + plain(std::round(10 * made_.typical_time) / 10) +
             " s was assumed for identification.";
    return out;
  }

  std::unique_ptr<PlannedStudies> planned() const override { return planned_tasks(made_); }
  std::string simulated() const override {
    return "Simulated participants did the protocol's trials in the loop of `palpate simulate` "
           "and " +
           std::string(plans_movements()
                           ? "moved as there; the planned measure of each movement is plan.json's"
                           : "judged as plan.json says") +
           ": no person took part. `planned-effect.csv` has the planned effect, `no-effect.csv` " +
           contrast() + ". `../codebook.csv` explains the columns.";
  }

 private:
  std::vector<Paragraph> plan() const override {
    if (made_.plan.measure() != nullptr) return plan_of_measure(made_);
    const analysis::StudyModel& model = *made_.plan.times();
    std::vector<std::string> effects;
    for (std::size_t s = 0; s < model.shapes.size(); ++s)
      effects.push_back(model.shapes[s] + " " +
                        (model.log_ratios[s] == 0
                             ? "none"
                             : plain(analysis::percent_reduction(model.log_ratios[s])) + " %"));
    return {text("A power analysis by simulation (palpate plan; plan.json has all of it): " +
                 std::to_string(made_.plan.studies) +
                 " studies for each number of participants, drawn from a mixed model of log times, "
                 "alpha " +
                 plain(made_.plan.alpha) + ", two-sided."),
            item("Effects to be found, percent less time with the ray than with the point: " +
                 joined(effects) + ".")};
  }
  std::string goal() const override {
    if (made_.plan.measure() == nullptr) return "the effects";
    return made_.plan.measure()->bound ? "equivalence" : "the effect";
  }

  bool plans_movements() const {
    return made_.plan.measure() != nullptr &&
           analysis::is_of_reaching(made_.plan.measure()->measure);
  }

  std::size_t studies() const { return made_.rehearsals.front().with_effect.studies(); }

  std::vector<std::string> names_of_blocks() const {
    std::vector<std::string> out;
    for (const TaskBlock* block : blocks_) add_once(block->name, out);
    return out;
  }

  /// Whether the analysis compares blocks or stimuli, for want of another condition.
  bool compares_blocks() const {
    return conditions_.differ && !conditions_.by_renderer && conditions_.factor.empty();
  }

  /// "surface:size"
  std::string example_of_effect() const {
    if (protocol_.factors.empty()) return "group";
    const std::string& first = protocol_.factors.front().name;
    return protocol_.factors.size() < 2 ? first : first + ":" + protocol_.factors[1].name;
  }

  /// "factor surface (smooth, rough), in block stiffness: cells mixed."
  std::string levels_of(const protocols::Factor& factor) const {
    std::vector<std::string> levels, mixed, apart, shared;
    for (const protocols::FactorLevel& level : factor.levels) levels.push_back(level.name);
    for (const TaskBlock* block : blocks_) {
      for (const protocols::CrossedFactor& crossed : block->factors) {
        if (&protocol_.factors[crossed.factor] == &factor)
          add_once(block->name, block->cells_apart          ? apart
                                : block->cells_share_tracks ? shared
                                                            : mixed);
      }
    }
    std::string out = "factor " + factor.name + " (" + joined(levels) + ")";
    if (!mixed.empty()) out += "; trials mixed in " + blocks_in_words(mixed);
    if (!apart.empty())
      out += "; one cell after the other, in the order of a Williams' square, in " +
             blocks_in_words(apart);
    if (!shared.empty())
      out += "; balanced in the tracks of " + blocks_in_words(shared) +
             ", whose figures are of all its levels";
    return out + "; what each level sets is in the protocol.";
  }

  static std::string blocks_in_words(const std::vector<std::string>& names) {
    return std::string(names.size() == 1 ? "block " : "blocks ") + joined(names);
  }

  static std::string unit_of(const TaskBlock& block) {
    const std::string unit = protocols::unit_of_level(block.level->pointer);
    return unit == "1" ? "" : unit;
  }

  std::string block_in_words(const TaskBlock& block) const {
    std::string out = block.name + ": ";
    const std::vector<std::string> words = study::in_words(protocol_, block);
    for (std::size_t i = 0; i < words.size(); ++i) out += (i > 0 ? ". " : "") + words[i];
    out += ". The participant " + question_of(block.task);
    if (!block.question.empty()) out += " (\"" + block.question + "\")";
    out += ", within " + plain(block.time_out) + " s.";
    if (block.level && block.level->pointer != "/orientation")
      out += " Levels in " +
             (unit_of(block).empty() ? std::string("the protocol's unit") : unit_of(block)) + ".";
    if (block.confidence) out += " Then how sure that answer is.";
    return out;
  }

  /// Who belongs to which group, and how many.
  std::string groups() const {
    std::vector<std::size_t> counts(protocol_.groups.names.size());
    for (const auto& [number, sha256] : made_.order_sha256)
      ++counts[protocol_.groups.group(number)];
    std::string out = "Groups of participants: " + study::groups_in_words(protocol_) + ". Planned:";
    for (std::size_t i = 0; i < counts.size(); ++i)
      out +=
          (i == 0 ? " " : ", ") + protocol_.groups.true_name(i) + " " + std::to_string(counts[i]);
    return out +
           ". Compared by a mixed analysis of variance of the participants' values (type "
           "III), and by Welch's t.";
  }

  std::string order_of_blocks() const {
    if (names_of_blocks().size() == 1) return "there is one.";
    const int orders = protocols::block_orders(protocol_);
    if (orders < 2) return "the same for everybody: " + study::condition_order(protocol_, 1) + ".";
    return "counterbalanced over participant numbers within a session (balanced Latin square; it "
           "repeats after " +
           counted(static_cast<std::size_t>(orders), "participant", "participants") +
           (protocol_.groups.any() ? " of a group)." : ").");
  }

  std::string practice() const {
    std::vector<std::string> names;
    for (const TaskBlock& block : protocol_.blocks) {
      if (block.practice) add_once(block.name, names);
    }
    return names.empty() ? "" : "Practice: " + blocks_in_words(names) + "; not analysed.";
  }

  void put_functions(std::vector<Paragraph>& out) const {
    out.push_back(text(
        "Psychometric functions: the probability of a success at level x (or at its logarithm, "
        "where the procedure's scale is logarithmic) is"));
    std::string formulas = "F(x) = 1 / (1 + exp(-ln(3) (x - l) / w))";
    if (kinds_.two_sided)
      formulas += "\npsi = lambda + (1 - 2 lambda) F    levels on both sides of the standard";
    if (kinds_.one_sided) formulas += "\npsi = 1/m + (1 - 1/m - lambda) F   forced choice of m";
    if (kinds_.detect)
      formulas += "\npsi = gamma + (1 - gamma - lambda) F   yes or no; F = 0 in catch trials";
    out.push_back(lines(formulas));
    out.push_back(
        text("with location l (PSE or threshold), width w (half the distance of the quartiles) and "
             "lapse "
             "rate lambda. The group: in each condition l and ln w are normal over participants, "
             "lambda has an exponential distribution whose mean is fitted; the integrals over "
             "participants are done on a grid, without approximation. Estimates maximise the "
             "likelihood; those of JNDs are geometric means."));
    if (renderers_.size() > 1)
      out.push_back(
          text("Two renderers: a participant's two values are a - d/2 and a + d/2, with a "
               "and d normal; the mean of d is the difference (of ln w: the logarithm of "
               "the ratio of JNDs), all other parameters are free."));
    out.push_back(text(
        "Intervals and p values come from the profile of the likelihood ratio LR: the 95 % "
        "interval holds the values with LR <= n ln(1 + t^2 / (n - 1)), t the 0.975 quantile of "
        "the t distribution with n - 1 degrees of freedom, n participants; p from "
        "t = sqrt((n - 1) (exp(LR / n) - 1)), two-sided."));
  }

  void put_ratings(std::vector<Paragraph>& out) const {
    out.push_back(text(
        "Ratings: paired t-test, two-sided, over participants on the difference of their mean "
        "ratings, t = mean(d) / (sd(d) / sqrt(n)), df = n - 1, with its 95 % interval. Beside it "
        "the exact Wilcoxon signed-rank test" +
        std::string(made_.participants <= 5
                        ? ", which with so few participants can never have p below 0.05."
                        : ".")));
  }

  void put_log_t_test(std::vector<Paragraph>& out) const {
    std::vector<std::string> figures;
    if (kinds_.numbers) figures.emplace_back("exponents");
    if (kinds_.adjust) figures.emplace_back("PSEs of adjustment");
    out.push_back(text("Participants' " + joined(figures) +
                       ": the group's value is their mean with a t interval; conditions are "
                       "compared by a paired t-test, two-sided, on natural logarithms if all are "
                       "above 0."));
  }

  Kinds kinds_;
  PlannedConditions conditions_;
  std::vector<std::string> renderers_;
  std::vector<const TaskBlock*> blocks_;  ///< that are analysed
};

}  // namespace

std::unique_ptr<StudyAnswers> task_answers(const Registration& made) {
  return std::make_unique<TaskAnswers>(made);
}

void require_own_trials(const protocols::Protocol& protocol, const std::string& path) {
  if (protocols::is_external(protocol))
    throw UsageError(path + ": /blocks: expected blocks whose trials the protocol determines: " +
                     "another program chooses those of a block 'external'");
}

}  // namespace palpate::runner::registration
