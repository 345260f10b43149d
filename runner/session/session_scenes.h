#pragma once
// The scenes of a session's trials.

#include <map>
#include <memory>
#include <optional>
#include <tuple>

#include "protocols/protocol.h"
#include "protocols/schedule.h"
#include "runner/scene_builder.h"

namespace palpate::runner::session {

/// The scenes of a session. Stimuli at levels that depend on answers are built on demand.
class SessionScenes {
 public:
  /// \param protocol  must outlive it, as must
  /// \param library   of the protocol's stimuli, without levels; null: builds those, too, on demand
  explicit SessionScenes(const protocols::Protocol& protocol,
                         const StimulusLibrary* library = nullptr);

  /// The scene of an interval of a trial, in the trial's orientation.
  rendering::Scene scene(const protocols::Trial& trial, const protocols::Interval& interval);
  /// Its edges, valid until the next call; empty without a stimulus.
  const SharpEdges& edges(const protocols::Trial& trial, const protocols::Interval& interval);

 private:
  struct Place {
    const StimulusLibrary& library;
    int stimulus;  ///< in that library
  };
  Place find(const protocols::Trial& trial, const protocols::Interval& interval);

  const protocols::Protocol& protocol_;
  const StimulusLibrary* library_;
  protocols::Protocol one_;  ///< the protocol with one stimulus
  /// Block, stimulus, level, whether it is the standard, and point.
  using Shown = std::tuple<int, int, std::optional<double>, bool, protocols::LevelPoint>;
  std::map<Shown, std::unique_ptr<const StimulusLibrary>> known_;  ///< only the newest are kept
};

/// The sound of its contacts, at the interval's level; none: silence.
std::optional<protocols::SoundSpec> contact_sound(const protocols::Protocol& protocol,
                                                  const protocols::Trial& trial,
                                                  const protocols::Interval& interval);

/// The object at the interval's level, placed in the world: for drawing.
stimuli::ObjectSpec shown_object(const protocols::Protocol& protocol, const protocols::Trial& trial,
                                 const protocols::Interval& interval);

}  // namespace palpate::runner::session
