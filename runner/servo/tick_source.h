#pragma once
// The servo loop as a session sees it.

#include <span>

#include "runner/servo/sample.h"

namespace palpate::runner {

/// In the caller's thread for a simulated participant, in a thread of its own for a live one.
class TickSource {
 public:
  virtual ~TickSource() = default;
  /// Puts a scene before the stylus and waits for it in the home zone.
  virtual void prepare(const rendering::Scene& scene, const rendering::Renderer& renderer,
                       const HomeZone& home) = 0;
  /// The next tick's sample: every one, in order. Waits for it.
  virtual const Sample& next() noexcept = 0;
  /// Where what moves of the scene is after the tick of the last sample. Valid until the next call
  /// of next(). Empty where nothing moves, and where forces are off.
  virtual std::span<const rendering::BodyPose> bodies() const noexcept { return {}; }
  /// Forces off; what the trial was like.
  virtual ServoQuality stop() noexcept = 0;
};

}  // namespace palpate::runner
