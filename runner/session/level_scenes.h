#pragma once
// The scenes of a session of version 2: stimuli at levels that answers choose, built as they come.

#include <map>
#include <memory>
#include <optional>
#include <tuple>

#include "protocols/protocol.h"
#include "runner/scene_builder.h"

namespace palpate::runner {

class LevelScenes {
 public:
  /// \param protocol  must outlive it
  explicit LevelScenes(const protocols::Protocol& protocol);

  /// What an interval of a trial shows, in the trial's orientation.
  rendering::Scene scene(const protocols::Trial& trial, const protocols::Interval& interval);
  /// Its edges, until the next call; nothing to feel has none.
  const SharpEdges& edges(const protocols::Trial& trial, const protocols::Interval& interval);

 private:
  const StimulusLibrary& library(const protocols::Trial& trial,
                                 const protocols::Interval& interval);

  const protocols::Protocol& protocol_;
  protocols::Protocol one_;  ///< the protocol with one stimulus
  /// By block, stimulus and level; the newest ones.
  std::map<std::tuple<int, int, std::optional<double>>, std::unique_ptr<const StimulusLibrary>>
      known_;
};

/// The level as the scene has it, in the world: for whoever draws it.
stimuli::ObjectSpec shown_object(const protocols::Protocol& protocol, const protocols::Trial& trial,
                                 const protocols::Interval& interval);

}  // namespace palpate::runner
