#include "runner/study/duration.h"

#include <algorithm>
#include <cstddef>
#include <vector>

#include "protocols/session_plan.h"

namespace palpate::runner::study {
namespace {

// s, to feel a stimulus: to identify it, to judge it, to adjust it. The first is a little more than
// in the paper; the others are guesses of the same kind.
constexpr double kToIdentify = 10, kToJudge = 5, kToAdjust = 20;

double seconds_of(const protocols::TaskBlock& block) {
  switch (block.task) {
    case protocols::TaskKind::identify:
      return kToIdentify;
    case protocols::TaskKind::adjust:
      return kToAdjust;
    default:
      return kToJudge;
  }
}

/// Stimuli felt in a trial.
int felt_in_trial(const protocols::TaskBlock& block) {
  if (block.task == protocols::TaskKind::compare || block.task == protocols::TaskKind::external)
    return block.intervals;
  return block.task == protocols::TaskKind::rate && block.standard ? 2 : 1;
}

}  // namespace

Duration duration_of(const protocols::Protocol& protocol) {
  Duration out;
  const std::vector<protocols::TrialCounts> counts = protocols::trial_counts(protocol);
  for (std::size_t i = 0; i < protocol.blocks.size(); ++i) {
    const protocols::TaskBlock& block = protocol.blocks[i];
    const double felt = felt_in_trial(block), pauses = (felt - 1) * block.inter_interval;
    const double limit = block.interval_limit.value_or(block.time_out);
    const double one = std::min(seconds_of(block), limit);
    const double rests = felt * protocol.home.rest + pauses;
    // The limit of the answer counts from the begin of the last interval.
    const double before = (felt - 1) * limit;
    out.usual += static_cast<double>(counts[i].expected) * (felt * one + rests);
    out.longest += static_cast<double>(counts[i].most) * (before + block.time_out + rests);
  }
  return out;
}

}  // namespace palpate::runner::study
