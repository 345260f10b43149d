#include "runner/commands/register/registration_text.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "analysis/statistics/paired.h"
#include "analysis/statistics/sensitivity.h"
#include "analysis/text.h"
#include "data/base/markdown.h"
#include "data/base/text.h"
#include "data/files/utc.h"
#include "runner/commands/shared/command.h"

namespace palpate::runner::commands {
namespace {

/// A paragraph, an item of a list, literal lines, or what only the lab can say.
struct Paragraph {
  enum class Kind { text, item, lines, field } kind = Kind::text;
  std::string text;
};

/// A question of the form with its answer.
struct Question {
  std::string id;     ///< "q2"
  std::string title;  ///< "Hypotheses"
  std::vector<Paragraph> answer;
  std::vector<std::string> chosen = {};  ///< of the form's options, in its words
  bool several = false;                  ///< options can be chosen together
};

using Kind = Paragraph::Kind;
using analysis::counted;
using analysis::joined;

/// The fewest digits that identify the number.
std::string plain(double value) {
  std::array<char, 40> digits{};
  std::snprintf(digits.data(), digits.size(), "%.6g", value);
  return digits.data();
}

std::string percent(double share) { return plain(100 * share) + " %"; }

Paragraph text(std::string words) { return {Kind::text, std::move(words)}; }
Paragraph item(std::string words) { return {Kind::item, std::move(words)}; }
Paragraph lines(std::string words) { return {Kind::lines, std::move(words)}; }
Paragraph fill_in(std::string words) { return {Kind::field, std::move(words)}; }

class Questions {
 public:
  explicit Questions(const Registration& registration)
      : made_(registration), protocol_(registration.protocol) {
    for (const protocols::StimulusSpec& stimulus : protocol_.stimuli)
      stimuli_.push_back(stimulus.name);
    for (const protocols::RendererKind kind : protocol_.renderers)
      renderers_.emplace_back(protocols::to_string(kind));
  }

  std::vector<Question> all() const {
    return {
        hypotheses(),
        study_type(),
        blinding(),
        more_blinding(),
        design(),
        randomisation(),
        existing_data(),
        {"q9", "Explanation of existing data", explanation()},
        {"q10",
         "Data collection procedures",
         {fill_in("who takes part, how they are recruited and paid, who may not take part and "
                  "why, when the study runs, and which force-feedback device it uses.")}},
        {"q11", "Sample size", sample_size()},
        {"q12", "Sample size rationale", rationale()},
        {"q13",
         "Stopping rule",
         {text("The study ends with the number of participants above. No test is made before; "
               "sequential looks are not planned."),
          fill_in("when data collection ends if that number is not reached, and how "
                  "participants who withdraw are replaced.")}},
        {"q14", "Manipulated variables", manipulated()},
        {"q15", "Measured variables", measured()},
        {"q16", "Indices", indices()},
        {"q17", "Statistical models", models()},
        {"q18",
         "Transformations",
         {text("Response times are analysed as natural logarithms of seconds. Differences on "
               "that scale are reported as percent reductions, 100 (1 - exp(difference)).")}},
        {"q19", "Inference criteria", inference()},
        {"q20", "Data exclusion", exclusion()},
        {"q21", "Missing data", missing()},
        {"q22",
         "Exploratory analysis",
         {fill_in("analyses beyond those of question 17, if any. All numbers of analysis.json "
                  "that no hypothesis names are exploratory.")}},
        {"q23",
         "Other",
         {text("Digest of this registration: " + std::string(kDigestMark) +
               ". It covers every file of the folder but registration.md and osf.json; what these "
               "two say beside the fields that the lab fills in follows from form.json, which it "
               "covers. 'palpate check --digest' compares it."),
          fill_in("related work, funding, conflicts of interest, or nothing.")}}};
  }

 private:
  Question hypotheses() const {
    Question question{"q2", "Hypotheses", {}};
    question.answer.push_back(
        text("Each hypothesis has two conditions on numbers of the analysis: one that corroborates "
             "it and one that refutes it. It is corroborated if the first holds and the second "
             "does not, refuted if the second holds and the first does not, else undecided."));
    for (const analysis::Hypothesis& one : made_.hypotheses) {
      question.answer.push_back(text(one.id + ". " + one.text));
      question.answer.push_back(
          lines("corroborated if  " + one.corroborated + "\nrefuted if       " + one.refuted));
    }
    question.answer.push_back(
        text("In these conditions, paired.SHAPE.reduction is the geometric percent reduction of "
             "the response time with " +
             renderers_.back() + " against " + renderers_.front() +
             ", ci95_low and ci95_high are the ends of its 95 % interval, p_holm is the "
             "Holm-adjusted p value of the paired t-test (question 17), and alpha is that of "
             "question 19. The README of palpate's analysis lists all names."));
    question.answer.push_back(fill_in("the reasons for these hypotheses."));
    return question;
  }

  static Question study_type() {
    return {"q3",
            "Study type",
            {text("An experiment within participants: every participant does trials of all "
                  "conditions, in an order that is drawn beforehand.")},
            {"Experiment - A researcher randomly assigns treatments to study subjects, this "
             "includes field or lab experiments. This is also known as an intervention experiment "
             "and includes randomized controlled trials."}};
  }

  Question blinding() const {
    Question question{"q4", "Blinding", {}};
    question.several = true;
    question.chosen = {
        "For studies that involve human subjects, they will not know the treatment group to which "
        "they have been assigned."};
    question.answer = {
        text("The participant's window shows the protocol's texts and the keys of the answers; it "
             "names neither the renderer nor the object that is shown. The experimenter's console "
             "shows both.")};
    if (protocol_.response.feedback)
      question.answer.push_back(
          text("After each answer the participant's window says whether it was right."));
    return question;
  }

  Question more_blinding() const {
    std::vector<Paragraph> answer;
    if (protocol_.masking_noise)
      answer.push_back(text(
          "During trials, " + std::string(protocols::to_string(protocol_.masking_noise->kind)) +
          " noise in the participant's headphones masks the sound of the device."));
    answer.push_back(fill_in("whether the device or the hand is hidden from sight, or no more."));
    return {"q5", "Is there any additional blinding in this study?", std::move(answer)};
  }

  Question design() const {
    Question question{"q6", "Study design", {}};
    auto& out = question.answer;
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
    out.push_back(item("An answer is given by a key within " + plain(protocol_.response.time_out) +
                       " s; a trial without one is a time-out."));
    out.push_back(
        text("The protocol, protocol.json, says all of it for the program that runs the "
             "sessions. SHA-256 of the file: " +
             protocol_.sha256 + "."));
    return question;
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

  Question randomisation() const {
    Question question{"q7", "Randomization", {}};
    auto& out = question.answer;
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
    std::string rows;
    for (std::size_t i = 0; i < made_.order_sha256.size(); ++i)
      rows += (i > 0 ? "\n" : "") + analysis::pad_left(std::to_string(i + 1), 4) + "  " +
              made_.order_sha256[i];
    out.push_back(lines(rows));
    return question;
  }

  Question existing_data() const {
    Question question{"q8", "Existing Data", {}};
    if (made_.sessions_so_far && *made_.sessions_so_far > 0) {
      question.answer = {text("The database of the study holds " +
                              counted(*made_.sessions_so_far, "session", "sessions") +
                              " of this protocol already."),
                         fill_in("which of the form's options applies.")};
      return question;
    }
    question.chosen = {"Registration prior to creation of data"};
    question.answer = {text(made_.sessions_so_far
                                ? "The database of the study holds 0 sessions of this protocol."
                                : "0 sessions: no database of the study was given when this "
                                  "registration was made. The first session's date will be held "
                                  "against the date of this registration.")};
    return question;
  }

  std::vector<Paragraph> explanation() const {
    if (made_.sessions_so_far && *made_.sessions_so_far > 0)
      return {fill_in("who has seen the existing data, and what of them.")};
    return {text("There are no data of this study.")};
  }

  const analysis::PlanRecord::Curve* curve() const {
    for (const auto& one : made_.plan.curves) {
      if (one.trials == static_cast<std::size_t>(protocol_.repetitions)) return &one;
    }
    return nullptr;
  }

  std::vector<Paragraph> sample_size() const {
    return {text(counted(made_.participants, "participant", "participants") + " with " +
                 std::to_string(protocols::main_trials(protocol_)) +
                 " trials each that are analysed, " +
                 std::to_string(made_.participants *
                                static_cast<std::size_t>(protocols::main_trials(protocol_))) +
                 " in all.")};
  }

  std::string planned_effects() const {
    std::vector<std::string> parts, none;
    const analysis::StudyModel& model = made_.plan.model;
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

  std::vector<Paragraph> rationale() const {
    const analysis::PlanRecord& plan = made_.plan;
    std::vector<Paragraph> out;
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
    const analysis::StudyModel& model = plan.model;
    out.push_back(
        item("Standard deviations of log times: single trials " + plain(model.residual_sd) +
             ", participants' gains " + plain(model.gain_sd) + ", their gains for single shapes " +
             plain(model.shape_gain_sd) + ", participants " + plain(model.intercept_sd) +
             "; share of trials that give a time: " + plain(model.proportion_used) + "."));
    if (!plan.pilot_label.empty())
      out.push_back(item(plan.pilot_label + ": these standard deviations come from a pilot of "
                                            "simulated participants, a model and no people."));
    const auto* found = curve();
    if (found == nullptr) return out;
    const std::string goal =
        plan.goal == analysis::Goal::all ? "all of the effects" : "at least one of the effects";
    if (found->participants)
      out.push_back(item(counted(*found->participants, "participant finds", "participants find") +
                         " " + goal + " with a power of at least " + percent(plan.power) + "."));
    const auto power = found->power.find(made_.participants);
    if (power != found->power.end()) {
      out.push_back(item("The power with " +
                         counted(made_.participants, "participant", "participants") + ": " +
                         percent(power->second) + " to find " + goal + "."));
    } else {
      out.push_back(fill_in("why " + counted(made_.participants, "participant", "participants") +
                            ", for which the plan has no power."));
    }
    return out;
  }

  std::vector<Paragraph> manipulated() const {
    std::vector<Paragraph> out;
    out.push_back(
        item("renderer: point (only the tip of the stylus is felt: a force) and ray (the "
             "stylus is felt along its whole length: force and torque)."));
    out.push_back(
        item("shape: " + joined(stimuli_) + "; sizes and materials are in the protocol."));
    return out;
  }

  static std::vector<Paragraph> measured() {
    return {item("response_time, s: from the first tick with forces on to the answer."),
            item("response and correct: the shape that was answered, and whether it was shown."),
            item("timed_out: no answer within the limit."),
            text("codebook.csv explains every column of the data.")};
  }

  static std::vector<Paragraph> indices() {
    return {
        text("For each participant, renderer and shape: the mean of the natural logarithms of "
             "the response times that count (question 20).")};
  }

  std::vector<Paragraph> models() const {
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
    out.push_back(text("The analysis is palpate " + made_.program_version +
                       "'s 'palpate analyze'; analysis-simulated.json shows its numbers for "
                       "simulated data."));
    return out;
  }

  std::vector<Paragraph> inference() const {
    return {text("Two-sided tests with alpha = " + plain(made_.alpha) +
                 ". p values of the paired t-tests are adjusted by Holm's method over the " +
                 counted(stimuli_.size(), "shape", "shapes") +
                 ". Hypotheses are judged by their conditions (question 2); there is no adjustment "
                 "over hypotheses.")};
  }

  std::vector<Paragraph> exclusion() const {
    return {item("Times: wrong answers and answers faster than " + plain(made_.too_fast) +
                 " s are left out."),
            item("Practice and warm-up trials are left out of everything."),
            item("An attempt that was interrupted is shown again and is not analysed."),
            item("Slow answers are kept up to the time-out. Accuracy uses all trials that are not "
                 "practice."),
            fill_in("for what reasons a whole participant is left out, if any.")};
  }

  std::vector<Paragraph> missing() const {
    return {item("A time-out counts as wrong and has no time in the primary test; a log-normal "
                 "model with time-outs as censored times (at " +
                 plain(protocol_.response.time_out) + " s) is reported beside it."),
            item("A participant without a time in a cell is left out of that shape's paired test."),
            item("Of participants who withdraw, all data are deleted.")};
  }

  const Registration& made_;
  const protocols::Protocol& protocol_;
  std::vector<std::string> stimuli_, renderers_;
};

std::string outcome_row(const std::string& id, const char* studies, const VerdictCounts& counts) {
  const auto share = [&](std::size_t n) {
    return std::to_string(n) + " of " + std::to_string(counts.studies());
  };
  return "| " + id + " | " + studies + " | " + share(counts.corroborated) + " | " +
         share(counts.refuted) + " | " + share(counts.undecided) + " |\n";
}

std::string in_markdown(const Paragraph& paragraph) {
  switch (paragraph.kind) {
    case Kind::item:
      return "* " + as_paragraph(paragraph.text) + "\n";
    case Kind::lines: {
      std::string out;
      std::string_view rest = paragraph.text;
      while (!rest.empty()) {
        const std::size_t end = std::min(rest.find('\n'), rest.size());
        out += "    " + one_line(rest.substr(0, end)) + "\n";
        rest.remove_prefix(std::min(end + 1, rest.size()));
      }
      return out;
    }
    case Kind::field:
      return as_field("**FILL IN:** " + as_markdown(paragraph.text)) + "\n";
    case Kind::text:
      break;
  }
  return as_paragraph(paragraph.text) + "\n";
}

void put_answer(const Question& question, std::string& out) {
  if (!question.chosen.empty()) {
    for (const std::string& option : question.chosen) out += "> " + as_markdown(option) + "\n";
    out += "\n";
  }
  for (std::size_t i = 0; i < question.answer.size(); ++i) {
    const bool in_list =
        i > 0 && question.answer[i].kind == Kind::item && question.answer[i - 1].kind == Kind::item;
    if (i > 0 && !in_list) out += "\n";
    out += in_markdown(question.answer[i]);
  }
}

/// registration.md with its marks.
std::string markdown_of(const Registration& made, const std::vector<Question>& questions) {
  const protocols::Protocol& protocol = made.protocol;
  const std::string title = protocol.title.empty() ? protocol.name : protocol.title;
  std::string out = "# Registration: " + as_markdown(title) + "\n\n";
  out += "Made on " + data::format_utc(made.made_utc_ns).substr(0, 10) + " at " +
         data::format_utc(made.made_utc_ns).substr(11, 8) + " UTC with palpate " +
         as_markdown(made.program_version) +
         ", a program that runs, simulates and analyses experiments of touch: objects are felt "
         "through a stylus whose device renders forces. It answers the questions of the OSF "
         "Preregistration form (version 3) in their order. What the program cannot know is marked "
         "**FILL IN**: answer it before you deposit this folder.\n";
  out += "\nDigest: `" + std::string(kDigestMark) +
         "`. It is the SHA-256 of `SHA256SUMS`. The registry that holds this text dates it, and so "
         "every file of the folder; `palpate check --digest` compares it.\n";
  if (!protocol.description.empty()) out += "\n" + as_paragraph(protocol.description) + "\n";
  if (!made.warnings.empty()) {
    out += "\n## Warnings\n\n";
    for (const std::string& warning : made.warnings) out += "* " + as_paragraph(warning) + "\n";
  }
  out += "\n## Questions\n";
  for (const Question& question : questions) {
    out += "\n### " + question.id.substr(1) + ". " + question.title + "\n\n";
    put_answer(question, out);
  }
  out += "\n## What simulated studies say\n\n" +
         std::to_string(made.rehearsals.front().with_effect.studies()) +
         " SIMULATED studies with the planned effect and as many with no effect were drawn from "
         "the model of the plan and analysed as above. No person took part; the numbers say what "
         "the design and the conditions can show, not what people will do. The model has no mean "
         "time; " +
         plain(std::round(10 * made.typical_time) / 10) +
         " s was assumed.\n\n"
         "| hypothesis | simulated with | corroborated | refuted | undecided |\n"
         "|---|---|---|---|---|\n";
  for (std::size_t h = 0; h < made.hypotheses.size(); ++h) {
    out += outcome_row(made.hypotheses[h].id, "the planned effect", made.rehearsals[h].with_effect);
    out += outcome_row(made.hypotheses[h].id, "no effect", made.rehearsals[h].without_effect);
  }
  out +=
      "\n## Files\n\n"
      "| file | what it is |\n|---|---|\n"
      "| `protocol.json`, with the files it names | the protocol, byte for byte |\n"
      "| `plan.json` | the power analysis |\n"
      "| `hypotheses.json` | the hypotheses with their conditions |\n"
      "| `registration.json` | numbers, checksums and versions, which `palpate check` reads |\n"
      "| `osf.json` | the answers above by the id of their question |\n"
      "| `form.json` | both texts as made, with their fields |\n"
      "| `codebook.csv` | every column of the data |\n"
      "| `simulated/` | SIMULATED data: one study with the planned effect, one with no effect |\n"
      "| `analysis-simulated.json` | the analysis of both |\n"
      "| `SHA256SUMS` | checksums of all files but this one and `osf.json` |\n"
      "\nReplace what is marked FILL IN in this file and in `osf.json`, which `SHA256SUMS` leaves "
      "out; leave everything else as it is. After the study, `palpate check` compares the data "
      "with "
      "this folder.\n";
  out += "\nMade with " + as_markdown(made.build) +
         "; simulated participants of `palpate simulate` "
         "are version " +
         std::to_string(made.participant_version) + " by default (settings " +
         made.participant_sha256.substr(0, 12) + "...).\n";
  return out;
}

/// The answers of osf.json.
std::vector<FormAnswer> osf_of(const std::vector<Question>& questions) {
  std::vector<FormAnswer> out;
  for (const Question& question : questions) {
    if (question.several) {
      out.push_back({question.id, {}, question.chosen});
      continue;
    }
    if (!question.chosen.empty()) {
      out.push_back({question.id, form_text(question.chosen.front()), {}});
      continue;
    }
    std::string text;
    for (std::size_t i = 0; i < question.answer.size(); ++i) {
      const Paragraph& paragraph = question.answer[i];
      const bool in_list =
          i > 0 && paragraph.kind == Kind::item && question.answer[i - 1].kind == Kind::item;
      text += (i == 0    ? ""
               : in_list ? "\n"
                         : "\n\n") +
              std::string(paragraph.kind == Kind::item ? "- " : "");
      const std::string words = printable_lines(paragraph.text);
      text += paragraph.kind == Kind::field ? as_field("FILL IN: " + words) : words;
    }
    out.push_back({question.id, form_text(text), {}});
  }
  return out;
}

}  // namespace

Form registration_form(const Registration& registration) {
  const std::vector<Question> questions = Questions(registration).all();
  return {form_text(markdown_of(registration, questions)), osf_of(questions)};
}

}  // namespace palpate::runner::commands
