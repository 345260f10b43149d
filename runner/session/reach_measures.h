#pragma once
// Movements from home to a target: when they end, and their measures from the recorded samples.
// World frame, SI units.

#include <cstddef>
#include <functional>
#include <span>
#include <vector>

#include "data/record.h"
#include "protocols/protocol.h"
#include "stimuli/vec.h"

namespace palpate::runner::session {

/// s, between the two places of a speed. Over a single tick the 30 um that devices resolve would
/// read as 30 mm/s.
inline constexpr double kSpeedSpan = 0.02;

/// Whether the tip rests in the target: slower than ReachingSpec::kStopSpeed over the last
/// kSpeedSpan.
class RestInTarget {
 public:
  /// \param radius  m, of the target. \param period  s, of a tick
  RestInTarget(const Vec3& target, double radius, double period);
  /// Takes the tip of the next tick.
  bool rests(const Vec3& tip);

 private:
  Vec3 target_;
  double radius_, most_;    ///< m; most_: of the way in kSpeedSpan
  std::vector<Vec3> last_;  ///< ring
  std::size_t ticks_ = 0;
};

/// N, that the field of the trial's stimulus exerts on the hand at a sample's place, with this
/// velocity of the tip, m/s.
using FieldOfReach = std::function<Vec3(const data::SampleRecord& sample, const Vec3& velocity)>;

/// Definitions: data/record.h and the columns of trials.csv. A movement that never was faster than
/// ReachingSpec::kStopSpeed has no measures.
/// \param samples  of all ticks, in order. \param period  s, of a tick
data::ReachRecord reach_measures(std::span<const data::SampleRecord> samples,
                                 protocols::ReachTrial kind, const Vec3& target, double period,
                                 const FieldOfReach& field);

/// The answer that a movement gives: an index into TaskBlock::answers.
int timing_of(const protocols::TaskBlock& block, const data::ReachRecord& reach);

}  // namespace palpate::runner::session
