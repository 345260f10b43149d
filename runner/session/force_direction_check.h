#pragma once
// A weak push to the right before the first trial: the participant feels whether forces have the
// right direction, and the commands are checked against the limits.

#include <functional>
#include <string>

#include "runner/servo/force_limiter.h"
#include "runner/servo/tick_source.h"

namespace palpate::runner {

/// A constant force to the right: 1 N, or half of the largest force allowed where that is less.
class ForceDirectionCheck final : public rendering::Renderer {
 public:
  static constexpr double kSeconds = 1;  ///< of the push

  /// \param limits  that are in force: the smaller of the program's and the device's
  /// \param driven  degrees of freedom that the device drives. 5: push both ends of the stylus;
  ///                fewer: all of it at the grip, even where the device senses an axis
  ForceDirectionCheck(const ForceLimits& limits, int driven);

  double force() const { return force_; }  ///< N, at each end
  bool both_ends() const { return both_ends_; }
  const ForceLimits& limits() const { return limits_; }

  /// Pushes for kSeconds through the servo and its limits as in a trial, then takes the force off.
  /// Must outlive the servo, which may still use it after a stop() that was not answered.
  /// \param stop  asked at each tick; true ends it at once
  /// \return what was wrong with the commands; empty: nothing
  std::string push(TickSource& servo, const std::function<bool()>& stop) const;

  const char* name() const override { return "push"; }
  bool side_contact() const override { return false; }
  rendering::Rendering tick(const rendering::Scene& scene, rendering::RenderState& state,
                            const rendering::LineProbe& probe, double dt) const noexcept override;

 private:
  ForceLimits limits_;
  double force_;
  bool both_ends_;
};

}  // namespace palpate::runner
