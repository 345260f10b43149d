#pragma once
// A feeble push before the first trial: do the forces reach the hand the right way round, and do
// the limits hold on the device that is open?

#include <functional>
#include <string>

#include "runner/servo/force_limiter.h"
#include "runner/servo/tick_source.h"

namespace palpate::runner {

/// To the right, the same wherever the stylus is: a newton, or half of what the limits leave where
/// that is less.
class ForceDirectionCheck final : public rendering::Renderer {
 public:
  static constexpr double kSeconds = 1;

  /// \param limits     that are in force: the smaller of the program's and the device's
  /// \param both_ends  of a stylus that two devices hold; else all of it at the tip
  ForceDirectionCheck(const ForceLimits& limits, bool both_ends);

  double force() const { return force_; }  ///< N, at each end
  const ForceLimits& limits() const { return limits_; }

  /// Pushes through the servo and its limits as in a trial, then takes the force off. Must outlive
  /// the servo, which a stop() that was not answered leaves with it.
  /// \param stop  asked at each tick; true ends it at once
  /// \return what was wrong with the commands; empty: nothing
  std::string give(TickSource& servo, const std::function<bool()>& stop) const;

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
