#include "runner/study/task_words.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdio>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "data/base/cell_name.h"
#include "data/base/random.h"
#include "protocols/procedures/procedure.h"
#include "protocols/procedures/recovery.h"
#include "protocols/tasks/block_order.h"
#include "protocols/tasks/levels.h"
#include "runner/output/outputs.h"
#include "runner/usage_error.h"

namespace palpate::runner::study {
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

/// "4 x 21" values, or the range of each dimension.
std::string ranges_in_words(const protocols::ProcedureSpec& spec) {
  std::string text;
  for (const protocols::DimensionRange& range : protocols::ranges_of(spec))
    text += (text.empty() ? "" : ", ") + level_text(range.min) + " to " + level_text(range.max);
  return text;
}

std::string words(const protocols::SobolPoints& spec) {
  return "Sobol's sequence: " + std::to_string(spec.trials) + " points within " +
         ranges_in_words(spec);
}

std::string words(const protocols::AskedPoints& spec) {
  return "a program is asked for points within " + ranges_in_words(spec) + " (--ask); ends after " +
         std::to_string(spec.own.trials) + " trials";
}

std::string words(const protocols::FieldQuestPlus& spec) {
  std::ostringstream out;
  out << "QUEST+ of the form " << to_string(spec.function.form) << ": ";
  for (const auto& values : spec.levels)
    out << (&values == &spec.levels.front() ? "" : " x ") << values.size();
  out << " points within " << ranges_in_words(spec) << "; ";
  const std::vector<std::string> names = protocols::grid_names(spec.function.form);
  for (std::size_t k = 0; k < names.size(); ++k)
    out << (k > 0 ? ", " : "") << spec.parameters[k].values.size() << " of " << names[k];
  if (std::ranges::find(spec.interest, false) != spec.interest.end()) {
    out << "; of interest:";
    for (std::size_t k = 0; k < names.size(); ++k)
      if (spec.interest[k]) out << " " << names[k];
  }
  out << "; ends after " << spec.stop_trials << " trials";
  if (spec.stop_entropy_bits)
    out << " or at an entropy of " << level_text(*spec.stop_entropy_bits) << " bit";
  return out.str();
}

std::string words(const protocols::ConstantStimuli& spec) {
  if (!spec.points.empty())
    return "constant stimuli: " + std::to_string(spec.points.size()) + " points within " +
           ranges_in_words(spec) + ", each " + std::to_string(spec.repetitions) + " times";
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

std::string words(const protocols::Asked& spec) {
  return "a program is asked for levels from " + level_text(spec.min) + " to " +
         level_text(spec.max) + " (--ask); ends after " + std::to_string(spec.stop_trials) +
         " trials";
}

struct RecoveredProcedure {
  const protocols::TaskBlock* block;
  std::size_t number;  ///< from 1, within the block
  protocols::PsychometricParticipant participant;
  double truth;  ///< a level
  protocols::Recovery recovery;
};

/// QUEST+ is tried with a participant that fits its model: of its function, in the middle of its
/// grids.
protocols::PsychometricParticipant participant_for(const protocols::Protocol& protocol,
                                                   const protocols::TaskBlock& block,
                                                   const protocols::ProcedureSpec& procedure) {
  protocols::PsychometricParticipant participant = protocols::typical_participant(protocol, block);
  if (const auto* quest = std::get_if<protocols::QuestPlus>(&procedure)) {
    const auto middle = [](const protocols::ParameterGrid& grid) {
      return grid.values[grid.values.size() / 2];
    };
    participant.function = quest->function;
    participant.parameters = {middle(quest->threshold), middle(quest->slope),
                              quest->guess.values.front(), quest->lapse.values.front()};
  }
  return participant;
}

bool has_no_estimate(const protocols::ProcedureSpec& spec) {
  return std::holds_alternative<protocols::ConstantStimuli>(spec) || protocols::is_asked(spec) ||
         !protocols::ranges_of(spec).empty();
}

std::vector<RecoveredProcedure> recovered(const protocols::Protocol& protocol, int participants,
                                          std::uint64_t seed) {
  std::vector<RecoveredProcedure> all;
  for (const protocols::TaskBlock& block : protocol.blocks) {
    for (std::size_t i = 0; i < block.procedures.size(); ++i) {
      const protocols::ProcedureSpec& procedure = block.procedures[i];
      if (block.practice || has_no_estimate(procedure)) continue;
      const auto participant = participant_for(protocol, block, procedure);
      all.push_back({&block, i + 1, participant, protocols::true_threshold(procedure, participant),
                     protocols::simulate_recovery(procedure, participant, participants, seed)});
    }
  }
  if (all.empty())
    throw UsageError(
        "--recover: expected a protocol of version 2 with a staircase, QUEST+ or limits of one "
        "dimension");
  return all;
}

std::string table_text(const std::vector<RecoveredProcedure>& all, int participants,
                       std::uint64_t seed) {
  std::string text = std::to_string(participants) +
                     " SIMULATED participants whose function is known, seed " +
                     std::to_string(seed) + "; bias and spread on the scale of the procedure\n";
  for (const RecoveredProcedure& one : all) {
    std::array<char, 300> line{};
    std::snprintf(line.data(), line.size(),
                  "%s, %s\n  true threshold %.6g: bias %.4g (standard error %.2g), spread %.4g, "
                  "%.1f trials, %d without an estimate\n",
                  one.block->name.c_str(),
                  in_words(one.block->procedures[one.number - 1]).substr(0, 150).c_str(), one.truth,
                  one.recovery.bias, one.recovery.bias_se, one.recovery.spread,
                  one.recovery.mean_trials, one.recovery.without_estimate);
    text += line.data();
  }
  return text;
}

}  // namespace

std::string groups_in_words(const protocols::Protocol& protocol) {
  const GroupAssignment& groups = protocol.groups;
  if (!groups.any()) return "";
  const auto listed = [](const std::vector<std::string>& all) {
    std::string out;
    for (const std::string& name : all) out += (out.empty() ? "" : ", ") + name;
    return out;
  };
  const std::string masks = groups.masked() ? " (masked as " + listed(groups.listed()) + ")" : "";
  const std::string names = listed(groups.unmasked().names) + masks;
  switch (groups.rule) {
    case GroupAssignment::Rule::balanced:
      return names + ": in turn by participant number";
    case GroupAssignment::Rule::blocked:
      return names + ": in permuted blocks with " + std::to_string(groups.block) + " of each";
    case GroupAssignment::Rule::given:
      break;
  }
  return names + ": chosen by the experimenter";
}

std::string in_words(const protocols::ProcedureSpec& procedure) {
  return std::visit([](const auto& spec) { return words(spec); }, procedure);
}

std::vector<std::string> in_words(const protocols::Protocol& protocol,
                                  const protocols::TaskBlock& block) {
  const auto name = [&](int i) { return protocol.stimuli[static_cast<std::size_t>(i)].name; };
  std::string head = std::string(to_string(block.task)) + " ";
  std::vector<std::string> shown;
  for (const int stimulus : block.stimuli) {
    const std::string plain = base_name(name(stimulus));
    if (std::ranges::find(shown, plain) == shown.end()) shown.push_back(plain);
  }
  for (std::size_t i = 0; i < shown.size(); ++i) head += (i > 0 ? ", " : "") + shown[i];
  if (block.standard) head += " with " + name(*block.standard);
  if (block.task == protocols::TaskKind::compare)
    head += ", " + std::to_string(block.intervals) + " intervals";
  if (block.level) head += "; " + block.level->pointer + " varies";
  for (const protocols::LevelDimension& one : block.dimensions)
    head += (&one == &block.dimensions.front() ? "; " : ", ") + one.name + " (" +
            one.target.pointer + (block.standard ? std::string(" of ") + to_string(one.of) : "") +
            ")";
  if (!block.dimensions.empty()) head += " vary";
  if (block.cell) {
    const CellName cell = cell_name(name(block.stimuli.front()));
    for (const auto& [factor, level] : cell.levels) head += "; " + factor + " " + level;
  } else if (!block.factors.empty()) {
    head += "; mixed:";
    for (const protocols::CrossedFactor& crossed : block.factors) {
      const protocols::Factor& factor = protocol.factors[crossed.factor];
      head += (&crossed == &block.factors.front() ? " " : " x ") + factor.name + " (";
      for (const std::size_t level : crossed.levels)
        head += (level == crossed.levels.front() ? "" : ", ") + factor.levels[level].name;
      head += ")";
    }
    if (block.cells_share_tracks) head += ", tracks shared by all cells";
  }
  if (block.reaching) {
    const protocols::ReachingSpec& reaching = *block.reaching;
    head += "; " + std::to_string(reaching.targets.size()) +
            (reaching.targets.size() == 1 ? " target" : " targets");
    if (reaching.most_time)
      head += " in " + level_text(*reaching.least_time) + " to " + level_text(*reaching.most_time) +
              " s";
    if (reaching.clamp_share > 0)
      head += "; " + level_text(100 * reaching.clamp_share) + " % clamp trials";
    if (reaching.catch_share > 0)
      head += "; " + level_text(100 * reaching.catch_share) + " % catch trials";
  }
  if (block.catch_trials > 0)
    head += "; " + level_text(100 * block.catch_trials) + " % catch trials";
  if (block.practice) head += "; practice";
  head += "; " + std::string(protocols::is_adaptive(block) ? "at most " : "") +
          std::to_string(protocols::most_trials_of(block)) + " trials";
  const long long expected = protocols::expected_trials_of(block);
  if (expected != protocols::most_trials_of(block))
    head += ", usually about " + std::to_string(expected);
  std::vector<std::string> lines{head};
  for (const protocols::ProcedureSpec& procedure : block.procedures)
    lines.push_back(in_words(procedure));
  return lines;
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

std::string recovery_text(const protocols::Protocol& protocol, int participants, std::uint64_t seed,
                          const std::string& format) {
  const std::vector<RecoveredProcedure> all = recovered(protocol, participants, seed);
  if (format == "table") return table_text(all, participants, seed);
  const std::vector<std::string> columns{
      "block", "procedure", "participants", "seed",        "true_threshold",
      "bias",  "bias_se",   "spread",       "mean_trials", "without_estimate"};
  output::CsvText csv(columns, "\r\n");
  nlohmann::ordered_json rows = nlohmann::ordered_json::array();
  for (const RecoveredProcedure& one : all) {
    const protocols::Recovery& r = one.recovery;
    csv << one.block->name << static_cast<int>(one.number) << participants << std::to_string(seed)
        << one.truth << r.bias << r.bias_se << r.spread << r.mean_trials << r.without_estimate;
    csv.end_row();
    rows.push_back({{"block", one.block->name},
                    {"procedure", one.number},
                    {"true_threshold", one.truth},
                    {"slope", one.participant.parameters.slope},
                    {"guess", one.participant.parameters.guess},
                    {"lapse", one.participant.parameters.lapse},
                    {"bias", r.bias},
                    {"bias_se", r.bias_se},
                    {"spread", r.spread},
                    {"mean_trials", r.mean_trials},
                    {"without_estimate", r.without_estimate}});
  }
  if (format == "csv") return csv.text();
  const nlohmann::ordered_json document{{"protocol", protocol.name},
                                        {"simulated", true},
                                        {"participants", participants},
                                        {"seed", seed},
                                        {"procedures", rows}};
  return document.dump(1) + "\n";
}

}  // namespace palpate::runner::study
