#include "runner/registration/registration_text.h"

#include <algorithm>
#include <memory>
#include <nlohmann/json.hpp>

#include "analysis/text.h"
#include "data/base/cell_name.h"
#include "data/base/markdown.h"
#include "data/base/text.h"
#include "data/files/utc.h"
#include "runner/registration/answers.h"
#include "runner/usage_error.h"

namespace palpate::runner::registration {
namespace {

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

class Questions {
 public:
  explicit Questions(const Registration& registration)
      : made_(registration),
        protocol_(registration.protocol),
        study_(study_answers(registration)) {}

  std::vector<Question> all() const {
    return {
        hypotheses(),
        study_type(),
        blinding(),
        more_blinding(),
        {"q6", "Study design", study_->design()},
        randomisation(),
        existing_data(),
        {"q9", "Explanation of existing data", explanation()},
        {"q10",
         "Data collection procedures",
         {fill_in("who takes part, how they are recruited and paid, who may not take part and "
                  "why, when the study runs, and which force-feedback device it uses.")}},
        {"q11", "Sample size", study_->sample_size()},
        {"q12", "Sample size rationale", study_->rationale()},
        {"q13", "Stopping rule", stopping()},
        {"q14", "Manipulated variables", study_->manipulated()},
        {"q15", "Measured variables", study_->measured()},
        {"q16", "Indices", study_->indices()},
        {"q17", "Statistical models", study_->models()},
        {"q18", "Transformations", study_->transformations()},
        {"q19", "Inference criteria", study_->inference()},
        {"q20", "Data exclusion", study_->exclusion()},
        {"q21", "Missing data", study_->missing()},
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
    question.answer.push_back(text(study_->names()));
    question.answer.push_back(fill_in("the reasons for these hypotheses."));
    return question;
  }

  std::vector<Paragraph> stopping() const {
    std::vector<Paragraph> answer = {
        text(made_.looks.empty()
                 ? "The study ends with the number of participants above. No test is made before; "
                   "sequential looks are not planned."
                 : looks_in_words())};
    for (Paragraph& more : study_->stopping()) answer.push_back(std::move(more));
    answer.push_back(
        fill_in("when data collection ends if that number is not reached, and how "
                "participants who withdraw are replaced."));
    if (!made_.looks.empty())
      answer.push_back(fill_in(
          "which hypotheses, once corroborated or refuted at a look, end the study there."));
    return answer;
  }

  std::string looks_in_words() const {
    std::string at, alphas;
    for (const analysis::Look& look : made_.looks) {
      const bool first = at.empty(), last = &look == &made_.looks.back();
      const char* const between = first ? "" : last ? " and " : ", ";
      at += between + std::to_string(look.participants);
      alphas += between + analysis::short_number(look.alpha);
    }
    const bool pocock = made_.spending == analysis::Spending::pocock;
    return "The hypotheses are judged after " + at +
           " participants, in the order of their numbers, and at no other time. The study ends "
           "with the last of these numbers, or before as said below. Alpha " +
           analysis::short_number(made_.alpha) +
           " is spent over these looks (Lan & DeMets 1983, the function that resembles the bounds "
           "of " +
           (pocock ? "Pocock" : "O'Brien and Fleming") +
           ", two-sided, information in proportion to the participants): alpha in the hypotheses "
           "is " +
           alphas +
           " at the looks. An interval of 95 % at a look before the last does not allow for the "
           "looks. The simulated studies of question 2 have all participants and are judged at the "
           "last look.";
  }

  Question study_type() const {
    const bool groups = made_.protocol.groups.any();
    return {"q3",
            "Study type",
            {text(groups ? "An experiment with groups of participants; within each, every "
                           "participant does trials of all conditions of the group, in an order "
                           "that is drawn beforehand."
                         : "An experiment within participants: every participant does trials of "
                           "all conditions, in an order that is drawn beforehand.")},
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
    const auto named = [&](const auto& is_one) {
      std::string names;
      for (const protocols::StimulusSpec& stimulus : protocol_.stimuli) {
        if (is_one(stimulus) && stimulus.name == base_name(stimulus.name))
          names += (names.empty() ? "" : ", ") + stimulus.name;
      }
      return names;
    };
    const std::string seen =
        named([](const auto& stimulus) { return stimulus.seen && stimulus.seen->anything(); });
    if (!seen.empty())
      question.answer.push_back(
          text("It draws what the protocol says is seen of these stimuli: " + seen + "."));
    const std::string heard =
        named([](const auto& stimulus) { return stimulus.sound.has_value(); });
    if (!heard.empty())
      question.answer.push_back(text("Contacts with these are heard: " + heard + "."));
    if (std::string words = study_->feedback(); !words.empty())
      question.answer.push_back(text(std::move(words)));
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

  Question randomisation() const {
    Question question{"q7", "Randomization", study_->randomisation()};
    std::string rows;
    for (const auto& [number, sha256] : made_.order_sha256)
      rows += (rows.empty() ? "" : "\n") + analysis::pad_left(std::to_string(number), 4) + "  " +
              sha256;
    question.answer.push_back(lines(rows));
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

  const Registration& made_;
  const protocols::Protocol& protocol_;
  std::unique_ptr<StudyAnswers> study_;
};

std::string outcome_row(const std::string& id, const std::string& studies,
                        const VerdictCounts& counts) {
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
  const std::unique_ptr<StudyAnswers> study = study_answers(made);
  out += "\n## What simulated studies say\n\n" +
         std::to_string(made.rehearsals.front().with_effect.studies()) + study->rehearsal() +
         "\n\n"
         "| hypothesis | simulated with | corroborated | refuted | undecided |\n"
         "|---|---|---|---|---|\n";
  for (std::size_t h = 0; h < made.hypotheses.size(); ++h) {
    out += outcome_row(made.hypotheses[h].id, "the planned effect", made.rehearsals[h].with_effect);
    out += outcome_row(made.hypotheses[h].id, study->contrast(), made.rehearsals[h].without_effect);
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
      "| `simulated/` | SIMULATED data: one study with the planned effect, one with " +
      study->contrast() +
      " |\n"
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

}  // namespace palpate::runner::registration
