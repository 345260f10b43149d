#include "runner/commands/shared/recovery_table.h"

#include <array>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "protocols/procedures/recovery.h"
#include "protocols/tasks/levels.h"
#include "runner/commands/shared/command.h"
#include "runner/commands/shared/csv_text.h"
#include "runner/commands/shared/task_words.h"

namespace palpate::runner {
namespace {

struct RecoveredProcedure {
  const protocols::TaskBlock* block;
  std::size_t number;  ///< from 1, within the block
  protocols::PsychometricParticipant participant;
  double truth;  ///< a level
  protocols::Recovery recovery;
};

/// QUEST+ is tried with a participant that it can find: of its function, in the middle of its
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

std::vector<RecoveredProcedure> recovered(const protocols::Protocol& protocol, int participants,
                                          std::uint64_t seed) {
  std::vector<RecoveredProcedure> all;
  for (const protocols::TaskBlock& block : protocol.blocks) {
    for (std::size_t i = 0; i < block.procedures.size(); ++i) {
      const protocols::ProcedureSpec& procedure = block.procedures[i];
      if (block.practice || std::holds_alternative<protocols::ConstantStimuli>(procedure)) continue;
      const auto participant = participant_for(protocol, block, procedure);
      all.push_back({&block, i + 1, participant, protocols::true_threshold(procedure, participant),
                     protocols::simulate_recovery(procedure, participant, participants, seed)});
    }
  }
  if (all.empty())
    throw UsageError(
        "--recover: expected a protocol of version 2 with a staircase, QUEST+ or limits");
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

std::string recovery_text(const protocols::Protocol& protocol, int participants, std::uint64_t seed,
                          const std::string& format) {
  const std::vector<RecoveredProcedure> all = recovered(protocol, participants, seed);
  if (format == "table") return table_text(all, participants, seed);
  const std::vector<std::string> columns{
      "block", "procedure", "participants", "seed",        "true_threshold",
      "bias",  "bias_se",   "spread",       "mean_trials", "without_estimate"};
  CsvText csv(columns, "\r\n");
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

}  // namespace palpate::runner
