#pragma once
// A recorded trial as its movement is measured: in the object's frame, with the contacts that its
// renderer had, by rendering it again.

#include <memory>
#include <string>
#include <vector>

#include "analysis/movement/measures.h"
#include "data/store/store.h"
#include "protocols/protocol.h"
#include "runner/scene_builder.h"

namespace palpate::runner {

/// A protocol with its stimuli and their surfaces, built once for many trials. Threads may share
/// it.
class TouchedStimuli {
 public:
  explicit TouchedStimuli(protocols::Protocol protocol);

  const protocols::Protocol& protocol() const { return protocol_; }
  const StimulusLibrary& library() const { return library_; }
  /// Index of a stimulus; -1: there is none of that name.
  int stimulus(const std::string& name) const;
  /// Null: it is soft, and has no surface that stays.
  const analysis::TouchedSurface* surface(int stimulus) const {
    return surfaces_[static_cast<std::size_t>(stimulus)].get();
  }

 private:
  protocols::Protocol protocol_;
  StimulusLibrary library_;
  std::vector<std::unique_ptr<const analysis::TouchedSurface>> surfaces_;
};

struct MeasuredTrial {
  std::string missing;  ///< why there is no value; empty: there are some
  std::size_t ticks = 0;
  analysis::MeasureValues values{};
};

/// Renders the trial again, which must give the recorded forces to the bit, and measures it. Up to
/// 5 ticks in a row that were missed are interpolated.
MeasuredTrial measure_trial(const TouchedStimuli& stimuli, const data::StoredTrial& stored,
                            const analysis::MovementSettings& settings);

}  // namespace palpate::runner
