#pragma once
// The line probe, the stylus as a segment, and its motion in a tick.

#include <memory>
#include <span>

#include "stimuli/vec.h"

namespace palpate::rendering {

/// The virtual probe as the device reports it: a segment from tip to tail, m. World frame, or the
/// mesh frame where a function says so. tip == tail: a point.
struct LineProbe {
  Vec3 tip, tail;
};

inline LineProbe translated(const LineProbe& probe, const Vec3& by) {
  return {probe.tip + by, probe.tail + by};
}

// What of a scene moves by itself. The renderers know no more of it than this; a scene in which
// nothing moves has none, and its tick does not ask. World frame, SI units.

class Renderer;
struct RenderState;
struct Rendering;

/// Where a moving object is.
struct BodyPose {
  int object = 0;    ///< index of the object in the scene
  Vec3 centre;       ///< m, of mass
  Quat orientation;  ///< from the object's axes to the world's
  Vec3 velocity;     ///< m/s, of the centre of mass
  Vec3 spin;         ///< rad/s
  Pose moved;        ///< from where the scene placed the object to where it is
};

/// Somebody draws an object by a spring beside the probe, as with the mouse.
struct BodyPull {
  int object = -1;  ///< index in the scene; -1: none is drawn
  Vec3 on_object;   ///< m, world; the place on it, where the scene placed the object at first
  Vec3 to;          ///< m, world; where that place is drawn to
};

/// All that moves, from tick to tick.
class MotionState {
 public:
  virtual ~MotionState() = default;
  virtual std::unique_ptr<MotionState> clone() const = 0;
  /// By object. Valid until the next tick, which changes them in place.
  virtual std::span<const BodyPose> bodies() const = 0;
  /// From the next tick on until the next call. Objects that cannot be drawn stay as they are.
  virtual void pull(const BodyPull& /*pull*/) noexcept {}

 protected:
  MotionState() = default;
  MotionState(const MotionState&) = default;
  MotionState& operator=(const MotionState&) = default;
};

/// How it moves. Immutable, part of the scene.
class SceneMotion {
 public:
  virtual ~SceneMotion() = default;
  virtual std::unique_ptr<MotionState> initial_state() const = 0;
  /// The whole tick: what moves goes on for dt, the probe touches all of the scene.
  virtual Rendering tick(const Renderer& renderer, RenderState& state, const LineProbe& probe,
                         double dt) const noexcept = 0;

 protected:
  SceneMotion() = default;
  SceneMotion(const SceneMotion&) = default;
  SceneMotion& operator=(const SceneMotion&) = default;
};

/// A MotionState that is copied with what holds it. Copying allocates; ticks do not copy.
class OwnedMotion {
 public:
  OwnedMotion() = default;
  explicit OwnedMotion(std::unique_ptr<MotionState> state) : state_(std::move(state)) {}
  OwnedMotion(const OwnedMotion& other) : state_(other.state_ ? other.state_->clone() : nullptr) {}
  OwnedMotion(OwnedMotion&&) noexcept = default;
  OwnedMotion& operator=(const OwnedMotion& other) {
    if (this != &other) state_ = other.state_ ? other.state_->clone() : nullptr;
    return *this;
  }
  OwnedMotion& operator=(OwnedMotion&&) noexcept = default;
  ~OwnedMotion() = default;

  MotionState* get() const { return state_.get(); }
  /// Empty where nothing moves.
  std::span<const BodyPose> bodies() const {
    return state_ ? state_->bodies() : std::span<const BodyPose>();
  }

 private:
  std::unique_ptr<MotionState> state_;
};

}  // namespace palpate::rendering
