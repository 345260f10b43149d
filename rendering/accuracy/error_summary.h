#pragma once
// The errors of a method against the exact local penetration depths.

#include <vector>

#include "rendering/accuracy/local_depths.h"
#include "rendering/accuracy/methods.h"

namespace palpate::rendering {

/// The distribution of one kind of error over the ticks on which it is defined.
struct ErrorSpread {
  std::size_t count = 0;
  double rms = 0, p999 = 0, worst = 0;  ///< p999: 99.9 % are at most this large
};

ErrorSpread error_spread(std::vector<double> errors);

struct ErrorSummary {
  std::size_t ticks = 0;    ///< compared
  std::size_t lost = 0;     ///< false negatives: touching, but no contact found; its force is 0
  std::size_t phantom = 0;  ///< false positives
  std::size_t gave_up = 0;  ///< of `lost`: the method reported a failure
  std::size_t deeper = 0;   ///< ticks held at a local minimum that is not the least
  ErrorSpread depth;        ///< m, along the held direction
  ErrorSpread normal;       ///< rad
  ErrorSpread point;        ///< m; where the contact point is defined (kFlat)
  ErrorSpread force;        ///< N, as a vector, at kStiffness
  ErrorSpread torque;       ///< N m, as a vector about the tip, at kStiffness, as for `point`
};

constexpr double kStiffness = 800;  ///< N/m, of the compared forces and torques
/// rad (2 degrees). A probe closer to parallel with a flat of the object touches it along a length:
/// the contact point is then a convention (the renderer's is equation (2) within 1 degree).
constexpr double kFlat = 0.0349065850398866;

/// Collects estimates and summarises their errors.
class ErrorTally {
 public:
  /// \param truth  all local depths, least first; empty: not touching. The estimate is compared
  /// with the one nearest to it in direction
  void add(const LineProbe& probe, const std::vector<LocalDepth>& truth,
           const ContactEstimate& estimate);
  ErrorSummary summary() const;

 private:
  ErrorSummary counts_;
  std::vector<double> depth_, normal_, point_, force_, torque_;
};

}  // namespace palpate::rendering
