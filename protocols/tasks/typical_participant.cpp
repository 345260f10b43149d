#include "protocols/tasks/typical_participant.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "protocols/tasks/levels.h"

namespace palpate::protocols {
namespace {

double guesses_of(const TaskBlock& block, const TypicalSettings& settings, bool both_sides) {
  if (block.task != TaskKind::compare || block.same_different) return settings.false_alarm;
  return both_sides ? settings.lapse : 1.0 / block.intervals;
}

}  // namespace

std::optional<Easier> easier_of(const ProcedureSpec& spec) {
  if (const auto* staircase = std::get_if<Staircase>(&spec)) return staircase->easier;
  if (const auto* quest = std::get_if<QuestPlus>(&spec)) return quest->function.easier;
  if (const auto* limits = std::get_if<Limits>(&spec)) return limits->easier;
  return std::nullopt;
}

LevelScale procedure_scale(const ProcedureSpec& spec) {
  if (const auto* staircase = std::get_if<Staircase>(&spec)) return staircase->scale;
  if (const auto* quest = std::get_if<QuestPlus>(&spec)) return quest->function.scale;
  if (const auto* limits = std::get_if<Limits>(&spec)) return limits->scale;
  return LevelScale::linear;
}

PsychometricParticipant typical_participant(const Protocol& protocol, const TaskBlock& block,
                                            const TypicalSettings& settings) {
  PsychometricParticipant participant;
  participant.function.shape = PsychometricShape::normal;
  const int side = side_of_levels(protocol, block);
  if (side < 0 || (side == 0 && block.asks_smaller)) participant.function.easier = Easier::lower;
  for (const ProcedureSpec& procedure : block.procedures) {
    const std::optional<Easier> easier = easier_of(procedure);
    if (!easier) continue;
    participant.function.easier = *easier;
    participant.function.scale = procedure_scale(procedure);
    break;
  }
  const LevelScale scale = participant.function.scale;
  const std::vector<double> levels = levels_of(block);
  double hard = scale_position(scale, levels.front()), easy = scale_position(scale, levels.back());
  if (participant.function.easier == Easier::lower) std::swap(hard, easy);
  const double range = std::max(std::abs(easy - hard), 1e-12);
  const bool both_sides =
      block.task == TaskKind::compare && !block.same_different && block.intervals == 2 && side == 0;
  double threshold = level_at(scale, hard + settings.place * (easy - hard));
  if (both_sides && block.standard)
    threshold = own_level(protocol, block, *block.standard).value_or(threshold);
  participant.parameters = {threshold, 1 / (settings.spread * range),
                            guesses_of(block, settings, both_sides), settings.lapse};
  return participant;
}

}  // namespace palpate::protocols
