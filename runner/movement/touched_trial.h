#pragma once
// A recorded trial prepared for the measures of movement: in the object's frame, with the contacts
// found by rendering it again.

#include <array>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "analysis/movement/measures.h"
#include "analysis/movement/pictures.h"
#include "data/export/settings.h"
#include "data/store/store.h"
#include "protocols/protocol.h"
#include "runner/scene_builder.h"

namespace palpate::runner::movement {

/// A protocol with its stimuli and their surfaces, built once for many trials. Threads may share
/// it.
class TouchedStimuli {
 public:
  explicit TouchedStimuli(protocols::Protocol protocol);

  const protocols::Protocol& protocol() const { return protocol_; }
  const StimulusLibrary& library() const { return library_; }
  /// Index of a stimulus; -1: unknown name.
  int stimulus(const std::string& name) const;
  /// Null: the stimulus is soft, and has no fixed surface.
  const analysis::TouchedSurface* surface(int stimulus) const {
    return surfaces_[static_cast<std::size_t>(stimulus)].get();
  }
  /// The part of a segment that lies on the surface within 0.05 mm, about a contact; the contact
  /// itself where the surface is round, or not of convex parts. Object's frame.
  std::array<Vec3, 2> touched(int stimulus, const Vec3& tip, const Vec3& tail,
                              const Vec3& contact) const;

 private:
  struct Plane {
    Vec3 normal;
    double offset = 0;  ///< m
  };
  using ConvexPart = std::vector<Plane>;
  void add_flat_parts(const rendering::Scene& scene);

  protocols::Protocol protocol_;
  StimulusLibrary library_;
  std::vector<std::unique_ptr<const analysis::TouchedSurface>> surfaces_;
  std::vector<std::vector<ConvexPart>> flat_;  ///< by stimulus: parts with long facets
};

/// The stimuli of each trial of a database, built once for each protocol, or for each run whose
/// device limited them. Threads may share it.
class StudyStimuli {
 public:
  explicit StudyStimuli(std::string mesh_folder) : folder_(std::move(mesh_folder)) {}

  /// \param store  of the calling thread
  std::shared_ptr<const TouchedStimuli> of(data::Store& store, const data::StoredTrial& trial);

 private:
  std::mutex mutex_;
  const std::string folder_;
  /// By the SHA-256 of a protocol and the name of a group.
  std::map<std::pair<std::string, std::string>, std::shared_ptr<const TouchedStimuli>> by_protocol_;
  std::map<std::tuple<std::int64_t, int, std::int64_t, std::int64_t>,
           std::shared_ptr<const TouchedStimuli>>
      by_run_;
};

struct MeasuredTrial {
  std::string missing;  ///< the reason of a missing value; empty: there are values
  std::size_t ticks = 0;
  analysis::MeasureValues values{};
  analysis::TrialTally tally;  ///< empty unless requested
};

/// Renders the trial again, which must reproduce the recorded forces to the bit. Gaps of up to 5
/// missed ticks are interpolated; longer gaps break the record. \return the reason that there is no
/// movement; empty: there is
std::string read_movement(const TouchedStimuli& stimuli, const data::StoredTrial& stored,
                          analysis::MovementTrial& trial);

/// Reads and measures the movement.
MeasuredTrial measure_trial(const TouchedStimuli& stimuli, const data::StoredTrial& stored,
                            const analysis::MovementSettings& settings, bool with_tally = false);

/// The deepest contact of each sample, by rendering the trial again; empty: the recorded forces are
/// not reproduced, or the trial has no samples.
std::vector<std::optional<data::TickContact>> contacts_of(const TouchedStimuli& stimuli,
                                                          const data::StoredTrial& stored);

}  // namespace palpate::runner::movement
