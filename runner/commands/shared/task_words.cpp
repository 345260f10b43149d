#include "runner/commands/shared/task_words.h"

#include <algorithm>
#include <cstddef>
#include <iomanip>
#include <sstream>

#include "data/base/random.h"
#include "protocols/tasks/levels.h"

namespace palpate::runner {
namespace {

using protocols::level_text;

std::string joined(const std::vector<double>& values) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "" : ", ") + level_text(value);
  return text;
}

std::string range_of(const std::vector<double>& values) {
  if (values.size() <= 8) return joined(values);
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  return std::to_string(values.size()) + " from " + level_text(*least) + " to " + level_text(*most);
}

std::string words(const protocols::ConstantStimuli& spec) {
  return "constant stimuli: levels " + range_of(spec.levels) + ", each " +
         std::to_string(spec.repetitions) + " times";
}

std::string words(const protocols::Staircase& spec) {
  std::ostringstream out;
  out << "staircase: " << spec.down << " down " << spec.up << " up from " << level_text(spec.start)
      << " within " << level_text(spec.min) << " to " << level_text(spec.max) << ", steps "
      << joined(spec.steps) << "; ends after ";
  if (spec.stop_reversals) out << *spec.stop_reversals << " reversals or ";
  out << spec.stop_trials << " trials; converges at " << std::fixed << std::setprecision(3)
      << protocols::convergence_point(spec);
  return out.str();
}

std::string words(const protocols::QuestPlus& spec) {
  std::ostringstream out;
  out << "QUEST+: levels " << range_of(spec.levels) << "; " << spec.threshold.values.size()
      << " thresholds, " << spec.slope.values.size() << " slopes, " << spec.guess.values.size()
      << " guess rates, " << spec.lapse.values.size() << " lapse rates; ends after "
      << spec.stop_trials << " trials";
  if (spec.stop_entropy_bits)
    out << " or at an entropy of " << level_text(*spec.stop_entropy_bits) << " bit";
  return out.str();
}

std::string words(const protocols::Limits& spec) {
  return "limits: " + std::to_string(spec.series) + " series from " + level_text(spec.low) +
         " to " + level_text(spec.high) + " and back, steps of " + level_text(spec.step);
}

/// With the threshold in the middle of the levels.
bool succeeds(const protocols::Protocol& protocol, const protocols::TaskBlock& block,
              const protocols::Trial& trial, Random& random) {
  const double draw = random.unit();
  if (!trial.level || protocols::levels_of(block).size() < 2) return draw < 0.75;
  const protocols::PsychometricParticipant typical =
      protocols::typical_participant(protocol, block);
  return draw <
         protocols::psychometric_probability(typical.function, typical.parameters, *trial.level);
}

}  // namespace

std::string in_words(const protocols::ProcedureSpec& procedure) {
  return std::visit([](const auto& spec) { return words(spec); }, procedure);
}

std::vector<std::string> in_words(const protocols::Protocol& protocol,
                                  const protocols::TaskBlock& block) {
  const auto name = [&](int i) { return protocol.stimuli[static_cast<std::size_t>(i)].name; };
  std::string head = std::string(to_string(block.task)) + " ";
  for (std::size_t i = 0; i < block.stimuli.size(); ++i)
    head += (i > 0 ? ", " : "") + name(block.stimuli[i]);
  if (block.standard) head += " with " + name(*block.standard);
  if (block.task == protocols::TaskKind::compare)
    head += ", " + std::to_string(block.intervals) + " intervals";
  if (block.level) head += "; " + block.level->pointer + " varies";
  if (block.catch_trials > 0)
    head += "; " + level_text(100 * block.catch_trials) + " % catch trials";
  if (block.practice) head += "; practice";
  head += "; " + std::string(protocols::is_adaptive(block) ? "at most " : "") +
          std::to_string(protocols::most_trials_of(block)) + " trials";
  std::vector<std::string> lines{head};
  for (const protocols::ProcedureSpec& procedure : block.procedures)
    lines.push_back(in_words(procedure));
  return lines;
}

std::vector<protocols::Trial> example_trials(const protocols::Protocol& protocol, int participant) {
  std::vector<protocols::Trial> trials;
  Random random(protocol.seed, {static_cast<std::uint64_t>(participant), 0x5c});
  for (int session = 1; session <= protocol.sessions.count; ++session) {
    protocols::TaskPlan plan(protocol, participant, session);
    while (!plan.finished()) {
      const protocols::Trial& trial = plan.next();
      const auto& block = protocol.blocks[static_cast<std::size_t>(trial.task_block)];
      const bool success = succeeds(protocol, block, trial, random);
      trials.push_back(trial);
      plan.answered({success, success, true});
    }
  }
  return trials;
}

std::vector<std::string> keyboard_parts(const protocols::Protocol& protocol) {
  constexpr std::size_t kButtons = 8;
  std::vector<std::string> parts;
  for (const protocols::TaskBlock& block : protocol.blocks) {
    if (block.answers.empty()) parts.push_back("numbers of '" + block.name + "'");
    if (block.answers.size() > kButtons) parts.push_back("answers to '" + block.name + "'");
    if (block.confidence && block.confidence->scale.size() > kButtons)
      parts.push_back("confidence of '" + block.name + "'");
  }
  for (const protocols::PageSpec& page : protocol.pages) {
    for (const protocols::PageItem& item : page.items) {
      const bool typed = item.kind == protocols::PageItem::Kind::text ||
                         item.kind == protocols::PageItem::Kind::number;
      if (typed || item.choices.size() > kButtons)
        parts.push_back("'" + item.name + "' of page '" + page.name + "'");
    }
  }
  return parts;
}

int comparison_interval(const protocols::TaskBlock& block, const protocols::Trial& trial) {
  if (block.task != protocols::TaskKind::compare) return 0;
  for (std::size_t i = 0; i < trial.intervals.size(); ++i) {
    if (!trial.intervals[i].standard) return static_cast<int>(i) + 1;
  }
  return 0;
}

}  // namespace palpate::runner
