#pragma once
// The session's interface to the servo loop.

#include <span>

#include "runner/servo/sample.h"

namespace palpate::runner::servo {

/// Runs in the caller's thread for a simulated participant, in its own thread for a live one.
class TickSource {
 public:
  virtual ~TickSource() = default;
  /// Shows a scene; forces begin once the stylus rests in the home zone.
  virtual void prepare(const rendering::Scene& scene, const rendering::Renderer& renderer,
                       const HomeZone& home) = 0;
  /// Waits for the next tick's sample. Returns every sample, in order.
  virtual const Sample& next() noexcept = 0;
  /// Poses of the scene's moving objects after the tick of the last sample. Valid until the next
  /// call of next(). Empty if nothing moves or forces are off.
  virtual std::span<const rendering::BodyPose> bodies() const noexcept { return {}; }
  /// Switches forces off. \return the trial's servo quality
  virtual ServoQuality stop() noexcept = 0;
};

}  // namespace palpate::runner::servo
