#include "runner/participants/seen_trial.h"

#include <cstddef>
#include <cstdint>

#include "data/base/random.h"
#include "protocols/tasks/block_order.h"
#include "protocols/tasks/levels.h"
#include "runner/scene_builder.h"
#include "stimuli/shapes.h"

namespace palpate::runner::participants {

std::shared_ptr<const display::SeenTrial> seen_trial_of(const protocols::Protocol& protocol,
                                                        const protocols::Trial& trial,
                                                        const protocols::Interval& interval) {
  if (!protocol.view || interval.stimulus < 0) return nullptr;
  const protocols::TaskBlock& block = protocols::block_of(protocol, trial);
  const protocols::StimulusSpec shown = protocols::shown_stimulus(protocol, block, interval);
  if (!shown.seen || !shown.seen->anything() || !protocols::is_seen(block, interval))
    return nullptr;
  auto out = std::make_shared<display::SeenTrial>();
  out->view = *protocol.view;
  out->seen = *shown.seen;
  out->object = shown.seen->shape ? *shown.seen->shape : shown.object;
  out->object.pose = stimuli::compose({Vec3(0), trial.orientation}, out->object.pose);
  out->tool = tool_of(protocol.tool);
  out->workspace = workspace_of(protocol);
  // Of each trial its own, and the same whenever it is shown.
  out->seed = Random(protocol.seed, {static_cast<std::uint64_t>(trial.session),
                                     static_cast<std::uint64_t>(trial.trial)})
                  .next();
  return out;
}

}  // namespace palpate::runner::participants
