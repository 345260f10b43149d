#include "runner/session/session_scenes.h"

#include <cstddef>
#include <utility>

#include "protocols/tasks/levels.h"
#include "stimuli/shapes.h"

namespace palpate::runner::session {
namespace {

constexpr std::size_t kMostKnown = 32;  // a sphere with its trees takes a megabyte

protocols::StimulusSpec shown_stimulus(const protocols::Protocol& protocol,
                                       const protocols::Trial& trial,
                                       const protocols::Interval& interval) {
  return protocols::shown_stimulus(protocol, protocols::block_of(protocol, trial), interval);
}

}  // namespace

SessionScenes::SessionScenes(const protocols::Protocol& protocol, const StimulusLibrary* library)
    : protocol_(protocol), library_(library), one_(protocol) {
  one_.stimuli.clear();
  one_.stimulus_texts.clear();
  one_.source_text.clear();
  one_.blocks.clear();
}

SessionScenes::Place SessionScenes::find(const protocols::Trial& trial,
                                         const protocols::Interval& interval) {
  if (library_ != nullptr && !interval.level && interval.point.empty())
    return {*library_, interval.stimulus};
  Shown key{trial.task_block, interval.stimulus, interval.level, interval.standard, interval.point};
  if (const auto found = known_.find(key); found != known_.end()) return {*found->second, 0};
  if (known_.size() >= kMostKnown) known_.clear();
  one_.stimuli.clear();
  if (interval.stimulus >= 0) one_.stimuli.push_back(shown_stimulus(protocol_, trial, interval));
  auto made = std::make_unique<const StimulusLibrary>(one_);
  return {*known_.emplace(std::move(key), std::move(made)).first->second, 0};
}

rendering::Scene SessionScenes::scene(const protocols::Trial& trial,
                                      const protocols::Interval& interval) {
  const Place place = find(trial, interval);
  if (interval.stimulus < 0) return place.library.empty_scene(interval.renderer);
  protocols::Trial one;
  one.stimulus = place.stimulus;
  one.renderer = interval.renderer;
  one.orientation = trial.orientation;
  return place.library.scene(one);
}

const SharpEdges& SessionScenes::edges(const protocols::Trial& trial,
                                       const protocols::Interval& interval) {
  static const SharpEdges kNone;
  if (interval.stimulus < 0) return kNone;
  const Place place = find(trial, interval);
  return place.library.edges(place.stimulus);
}

std::optional<protocols::SoundSpec> contact_sound(const protocols::Protocol& protocol,
                                                  const protocols::Trial& trial,
                                                  const protocols::Interval& interval) {
  if (interval.stimulus < 0) return std::nullopt;
  return shown_stimulus(protocol, trial, interval).sound;
}

stimuli::ObjectSpec shown_object(const protocols::Protocol& protocol, const protocols::Trial& trial,
                                 const protocols::Interval& interval) {
  stimuli::ObjectSpec object = shown_stimulus(protocol, trial, interval).object;
  object.pose = stimuli::compose({Vec3(0), trial.orientation}, object.pose);
  return object;
}

}  // namespace palpate::runner::session
