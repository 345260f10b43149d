#include "runner/session/level_scenes.h"

#include <cstddef>
#include <utility>

#include "protocols/tasks/levels.h"
#include "stimuli/shapes.h"

namespace palpate::runner {
namespace {

constexpr std::size_t kMostKnown = 32;  // a sphere with its trees has a megabyte

protocols::StimulusSpec shown_stimulus(const protocols::Protocol& protocol,
                                       const protocols::Trial& trial,
                                       const protocols::Interval& interval) {
  const auto& block = protocol.blocks[static_cast<std::size_t>(trial.task_block)];
  if (interval.level)
    return protocols::at_level(protocol, block, interval.stimulus, *interval.level);
  return protocol.stimuli[static_cast<std::size_t>(interval.stimulus)];
}

}  // namespace

LevelScenes::LevelScenes(const protocols::Protocol& protocol)
    : protocol_(protocol), one_(protocol) {
  one_.stimuli.clear();
  one_.stimulus_texts.clear();
  one_.source_text.clear();
  one_.blocks.clear();
}

const StimulusLibrary& LevelScenes::library(const protocols::Trial& trial,
                                            const protocols::Interval& interval) {
  auto key = std::make_tuple(trial.task_block, interval.stimulus, interval.level);
  if (const auto found = known_.find(key); found != known_.end()) return *found->second;
  if (known_.size() >= kMostKnown) known_.clear();
  one_.stimuli.clear();
  if (interval.stimulus >= 0) one_.stimuli.push_back(shown_stimulus(protocol_, trial, interval));
  return *known_.emplace(std::move(key), std::make_unique<const StimulusLibrary>(one_))
              .first->second;
}

rendering::Scene LevelScenes::scene(const protocols::Trial& trial,
                                    const protocols::Interval& interval) {
  const StimulusLibrary& shown = library(trial, interval);
  if (interval.stimulus < 0) return shown.empty_scene(interval.renderer);
  protocols::Trial one;
  one.renderer = interval.renderer;
  one.orientation = trial.orientation;
  return shown.scene(one);
}

const SharpEdges& LevelScenes::edges(const protocols::Trial& trial,
                                     const protocols::Interval& interval) {
  static const SharpEdges kNone;
  return interval.stimulus < 0 ? kNone : library(trial, interval).edges(0);
}

stimuli::ObjectSpec shown_object(const protocols::Protocol& protocol, const protocols::Trial& trial,
                                 const protocols::Interval& interval) {
  stimuli::ObjectSpec object = shown_stimulus(protocol, trial, interval).object;
  object.pose = stimuli::compose({Vec3(0), trial.orientation}, object.pose);
  return object;
}

}  // namespace palpate::runner
