#pragma once
// How far a method's answers are from the exact ones.

#include <vector>

#include "rendering/accuracy/methods.h"
#include "rendering/accuracy/ways_out.h"

namespace palpate::rendering {

/// Sizes of one kind of error over the ticks on which it is defined.
struct ErrorSpread {
  std::size_t count = 0;
  double rms = 0, p999 = 0, worst = 0;  ///< p999: 99.9 % are no larger
};

struct ErrorSummary {
  std::size_t ticks = 0;    ///< that were compared
  std::size_t lost = 0;     ///< touching in truth, not by the method; its force is then 0
  std::size_t phantom = 0;  ///< the other way round
  std::size_t gave_up = 0;  ///< of `lost`: the method said so itself
  std::size_t deeper = 0;   ///< ticks held by a way out that is not the least
  ErrorSpread depth;        ///< m, along the way out that is held
  ErrorSpread normal;       ///< rad
  ErrorSpread point;        ///< m; where the contact point is one (kFlat)
  ErrorSpread force;        ///< N, as a vector, at kStiffness
  ErrorSpread torque;       ///< N m, as a vector about the tip, at kStiffness, as for `point`
};

constexpr double kStiffness = 800;  ///< N/m, for forces and torques
/// rad (2 degrees). A probe that is nearer to parallel with a flat of the object touches it along a
/// length: where on it is then a convention (the renderer's is equation (2) within 1 degree).
constexpr double kFlat = 0.0349065850398866;

/// Collects answers and sums up their errors.
class ErrorTally {
 public:
  /// \param truth  all ways out, least first; empty: not touching. The answer is held against the
  /// one nearest to it in direction
  void add(const LineProbe& probe, const std::vector<WayOut>& truth, const Answer& answer);
  ErrorSummary summary() const;

 private:
  ErrorSummary counts_;
  std::vector<double> depth_, normal_, point_, force_, torque_;
};

}  // namespace palpate::rendering
