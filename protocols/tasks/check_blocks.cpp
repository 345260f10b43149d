// Whether the blocks of a protocol can be shown as they stand.

#include <cstddef>
#include <optional>
#include <set>
#include <string>

#include "protocols/order.h"
#include "protocols/schedule.h"
#include "protocols/tasks/levels.h"
#include "protocols/tasks/parse_blocks.h"
#include "protocols/tasks/task_plan.h"
#include "protocols/tasks/typical_participant.h"

namespace palpate::protocols {
namespace {

constexpr long long kMostTaskTrials = 1000000;

std::string pointer_of_block(std::size_t i) { return "/blocks/" + std::to_string(i); }

void check_levels_of(const Protocol& protocol, const TaskBlock& block, const std::string& pointer,
                     FaultList& faults) {
  std::set<std::string> told;
  for (const int stimulus : block.stimuli) {
    for (const double level : levels_of(block)) {
      try {
        at_level(protocol, block, stimulus, level);
      } catch (const InputError& error) {
        const Fault& fault = error.faults().front();
        const std::string text =
            "expected a level that '" + protocol.stimuli[static_cast<std::size_t>(stimulus)].name +
            "' can have: at " + level_text(level) + ", " + fault.location + ": " + fault.expected;
        // One level of a kind tells it.
        if (told.insert(protocol.stimuli[static_cast<std::size_t>(stimulus)].name + fault.location)
                .second)
          faults.add(pointer + "/level/path", text);
      }
    }
  }
}

/// Which levels have more successes of two intervals follows from what is asked. \return nullopt:
/// the task does not tell
std::optional<Easier> expected_easier(const Protocol& protocol, const TaskBlock& block) {
  if (block.task != TaskKind::compare || block.same_different || block.intervals > 2)
    return std::nullopt;
  if (const int side = side_of_levels(protocol, block); side != 0)
    return side > 0 ? Easier::higher : Easier::lower;
  if (!block.standard || !own_level(protocol, block, *block.standard)) return std::nullopt;
  return block.asks_smaller ? Easier::lower : Easier::higher;
}

void check_easier(const Protocol& protocol, const TaskBlock& block, const std::string& pointer,
                  FaultList& faults) {
  const std::optional<Easier> expected =
      block.level ? expected_easier(protocol, block) : std::nullopt;
  if (!expected) return;
  for (std::size_t i = 0; i < block.procedures.size(); ++i) {
    const std::optional<Easier> easier = easier_of(block.procedures[i]);
    if (!easier || *easier == *expected) continue;
    const bool one_side = side_of_levels(protocol, block) != 0;
    const std::string place =
        pointer + "/procedure" + (block.procedures.size() > 1 ? "/" + std::to_string(i) : "");
    faults.add(
        place + "/easier",
        std::string("expected '") + (*expected == Easier::higher ? "higher" : "lower") +
            (one_side ? "': all levels lie on one side of the standard, farther ones are easier"
                      : "': levels lie on both sides of the standard, and what counts is that "
                        "the comparison is chosen"));
  }
}

}  // namespace

void check_blocks(const Protocol& protocol, FaultList& faults) {
  for (std::size_t i = 0; i < protocol.blocks.size(); ++i) {
    const TaskBlock& block = protocol.blocks[i];
    check_levels_of(protocol, block, pointer_of_block(i), faults);
    if (block.level && block.task != TaskKind::detect && block.standard &&
        !own_level(protocol, block, *block.standard)) {
      faults.add(pointer_of_block(i) + "/standard",
                 "expected a stimulus that has " + block.level->pointer + " itself");
    }
  }
  faults.throw_if_any();
  for (std::size_t i = 0; i < protocol.blocks.size(); ++i)
    check_easier(protocol, protocol.blocks[i], pointer_of_block(i), faults);
  long long trials = 0;
  for (const TaskBlock& block : protocol.blocks) trials += most_trials_of(block);
  if (trials > kMostTaskTrials) {
    faults.add("/blocks", "expected at most " + std::to_string(kMostTaskTrials) +
                              " trials for each participant, found " + std::to_string(trials));
    return;
  }
  for (std::size_t i = 0; i < protocol.blocks.size(); ++i) {
    try {
      check_order(protocol, static_cast<int>(i));
    } catch (const ScheduleError& error) {
      faults.add(pointer_of_block(i) + "/order", error.what());
    }
  }
}

}  // namespace palpate::protocols
